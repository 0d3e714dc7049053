"""Fits and derivatives of a diagnosis as plain arrays, for the store of finished work (`bushcli.runtime.store`)."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from bushcli.selection.model import Fitted


class FitCodec:
    """Fits, derivatives and failures as arrays (`bushcli.runtime.store.Codec`)."""

    def encode(self, answer: Any) -> dict[str, Any]:
        """Return an answer as arrays: a fit, a tuple of arrays, or nothing."""
        if answer is None:
            return {"kind": np.array("nothing")}
        if isinstance(answer, Fitted):
            details = {
                "names": list(answer.names),
                "values": answer.values,
                "converged": answer.converged,
                "solves": answer.solves,
                "failed": answer.failed,
                "channels": len(answer.simulated),
            }
            arrays = {f"simulated{i}": force for i, force in enumerate(answer.simulated)}
            arrays |= {f"jacobian{i}": slopes for i, slopes in enumerate(answer.jacobians)}
            arrays |= {"x": answer.x, "states": answer.states}
            return {"kind": np.array("fit"), "about": np.array(json.dumps(details)), **arrays}
        arrays = {f"array{i}": np.asarray(value) for i, value in enumerate(answer)}
        return {"kind": np.array("arrays"), "count": np.array(len(arrays)), **arrays}

    def decode(self, arrays: dict[str, Any], question: tuple[Any, ...]) -> Any:
        """Return the answer that `encode` wrote; the model of a fit is that of the question, with other values.

        Parameters
        ----------
        arrays : mapping
            The saved arrays.
        question : tuple
            Arguments of the fit.
        """
        kind = str(arrays["kind"])
        if kind == "nothing":
            return None
        if kind == "arrays":
            return tuple(arrays[f"array{i}"] for i in range(int(arrays["count"])))
        details = json.loads(str(arrays["about"]))
        channels = range(int(details["channels"]))
        return Fitted(
            question[1].at(details["values"]),
            tuple(details["names"]),
            arrays["x"],
            tuple(arrays[f"simulated{i}"] for i in channels),
            tuple(arrays[f"jacobian{i}"] for i in channels),
            bool(details["converged"]),
            int(details["solves"]),
            int(details["failed"]),
            arrays["states"],
        )
