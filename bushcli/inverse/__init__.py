"""Identify a law's parameters from measured curves: coupons or bushings, one or several channels together.

The least-squares problem is bounded, its Jacobian exact, each channel weighed by its own noise. A trial that cannot be
solved makes the trust region shrink; it is counted, and never becomes a number.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bushcli.inverse.identify import fit_coupons, identify
    from bushcli.inverse.result import (
        Combination,
        EndPoint,
        Estimate,
        Evaluation,
        Fit,
        FittedCurve,
        Profile,
        Weighting,
    )
    from bushcli.inverse.task import Task

__all__ = [
    "Combination",
    "EndPoint",
    "Estimate",
    "Evaluation",
    "Fit",
    "FittedCurve",
    "Profile",
    "Task",
    "Weighting",
    "fit_coupons",
    "identify",
]

# Where each name is. Loaded when it is first used: a report needs names and units of parameters, not the search.
_MODULES = {
    "identify": ("fit_coupons", "identify"),
    "result": (
        "Combination",
        "EndPoint",
        "Estimate",
        "Evaluation",
        "Fit",
        "FittedCurve",
        "Profile",
        "Weighting",
    ),
    "task": ("Task",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
