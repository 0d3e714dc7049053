"""Identify a law's parameters from measured curves: coupons or bushings, one or several channels together.

The least-squares problem has bounds and an exact Jacobian, and each channel is weighted by its own noise. A trial that
cannot be solved makes the trust region shrink; it is counted as failed, and no penalty value stands in for its misfit.
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
from bushcli.inverse.task import Task, refuse_fixed

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
    "refuse_fixed",
]
