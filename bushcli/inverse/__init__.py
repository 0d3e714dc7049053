"""Identify a law's parameters from measured curves: coupons or bushings, one or several channels together.

The least-squares problem is bounded, its Jacobian exact, each channel weighed by its own noise. A trial that cannot be
solved makes the trust region shrink; it is counted, and never becomes a number.
"""

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
