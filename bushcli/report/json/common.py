"""Entries that every result has, and JSON's own types.

A dataclass becomes an object with its fields as keys, nan becomes null, and infinity "inf".
"""

from __future__ import annotations

import importlib
import importlib.metadata
import math
import platform
import sys
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bushcli import __version__
from bushcli.case import case_json

if TYPE_CHECKING:
    from bushcli.case import Case, Material
    from bushcli.faults import DataFault
    from bushcli.runtime.condition import Condition

# Python package -> the distribution that declares its version.
_PROGRAMS = {"dolfinx": "fenics-dolfinx", "gmsh": "gmsh", "numpy": "numpy", "scipy": "scipy"}


def result_json(
    command: str,
    case: Case,
    problems: Iterable[Condition],
    entries: Mapping[str, Any],
    timings: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Return the entries that every result has, then those of this one; the command adds its own timings (s) later.

    Parameters
    ----------
    command : str
        Its name.
    case : Case
    problems : iterable of Condition
        What the user has to know.
    entries : mapping of str to object
        Those of this result.
    timings : mapping of str to float, optional
        Seconds by part of the calculation.
    """
    common = {
        "command": command,
        "case": case_json(case),
        "versions": versions(),
        "timings_s": dict(timings or {}),
        "problems": list(problems),
    }
    return json_value({**common, **entries})


def select(value: object, names: str) -> dict[str, Any]:
    """Return attributes that have the same names in JSON."""
    return {name: getattr(value, name) for name in names.split()}


def versions() -> dict[str, str]:
    """Return program -> version: bushcli, python, dolfinx, gmsh, numpy, scipy, petsc.

    The programs are not loaded where avoidable: `bushcli check` needs no finite elements, which take half a second to
    load.
    """
    programs = {"bushcli": __version__, "python": platform.python_version()}
    for name, distribution in _PROGRAMS.items():
        loaded = str(getattr(sys.modules.get(name), "__version__", ""))
        programs[name] = loaded or _version(name, distribution)
    petsc = sys.modules.get("petsc4py.PETSc")
    # petsc4py is released with PETSc, and their version numbers agree except for the last part.
    installed = petsc.Sys.getVersion() if petsc else _version("petsc4py", "petsc4py").split(".")[:2]
    return programs | {"petsc": ".".join(map(str, installed))}


def _version(module: str, distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return str(importlib.import_module(module).__version__)


def faults_json(faults: Iterable[DataFault]) -> list[dict[str, Any]]:
    """Return faults of recordings as JSON-ready data."""
    return [
        select(fault, "channel kind where remedy fatal probability")
        | {"samples": int(np.count_nonzero(fault.samples))}
        for fault in faults
    ]


def material_json(material: Material) -> dict[str, Any]:
    """Return a law with its parameters."""
    return select(material, "law bulk_modulus parameters")


def json_value(value: Any) -> Any:
    """Return a value in JSON's own types."""
    if is_dataclass(value):
        return {field.name: json_value(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return json_value(value.tolist())
    if isinstance(value, (list, tuple)):
        return [json_value(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else "inf" if value > 0 else "-inf"
    return value
