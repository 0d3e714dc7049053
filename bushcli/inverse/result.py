"""Result of an identification: parameters with their uncertainty, curves before and after, the search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Material
from bushcli.curve.curve import Curve
from bushcli.effects.active import ActiveEffect
from bushcli.faults import DataFault
from bushcli.recording import Recording
from bushcli.runtime.condition import Condition
from bushcli.simulate.dynamic_tables import ComparedTable

Array = NDArray[np.float64]
Weighting = Literal["absolute", "relative"]
Limit = Literal["misfit", "stability", "unsolvable", "bound", "open"]

# A parameter is poorly determined, and gets a profile, if its standard error exceeds this share of its value.
POOR = 0.2
# Standard errors to each side of a value that hold 95 % of a normal distribution.
NORMAL = 1.96


@dataclass(frozen=True)
class Estimate:
    """An identified parameter.

    Attributes
    ----------
    value, std : float
        Best value and standard error (MPa or 1), from the misfit that remains, with its autocorrelation.
    lower, upper : float
        Bounds of the search.
    at_bound : bool
        Whether the value lies on a bound.
    interval : tuple of float, optional
        95 % interval by profile likelihood, where a standard error would mislead: one of the parameters is poorly
        determined, or the search ended at the edge of stability or of what can be solved.
    limits : tuple of str
        What ends the interval below and above, see `Profile`.
    quantile : float
        Number of standard errors to each side of the value that hold 95 %, by Student's distribution.
    scale : {"straight", "logarithm", "effect"}
        What the misfit is closest to a parabola in: a law's parameter itself near its value, the logarithm of a
        parameter that is searched in it, or an effect's parameter whatever its size.
    """

    value: float
    std: float
    lower: float
    upper: float
    at_bound: bool
    interval: tuple[float, float] | None = None
    limits: tuple[Limit, Limit] = ("misfit", "misfit")
    quantile: float = NORMAL
    scale: Literal["straight", "logarithm", "effect"] = "straight"

    @property
    def range95(self) -> tuple[float, float] | None:
        """The 95 % interval: by profile likelihood, else by the standard error; None where neither means anything.

        A standard error means something where it is small: it is that of a model that is linear in the parameter, or
        in its logarithm. An effect's amplitude changes the curves nearly in proportion.
        """
        most = abs(self.value) * {"straight": POOR, "logarithm": 1.0, "effect": np.inf}[self.scale]
        if self.interval is not None or not 0.0 < self.std <= most:
            return self.interval
        low, high = self.value - self.quantile * self.std, self.value + self.quantile * self.std
        if self.scale == "logarithm":
            factor = float(np.exp(self.quantile * self.std / self.value))
            low, high = self.value / factor, self.value * factor
        return max(low, self.lower), min(high, self.upper)


@dataclass(frozen=True)
class FittedCurve:
    """A recorded curve and the law's answer at the same displacements.

    Attributes
    ----------
    fitted, started : Curve
        Curve with the identified parameters, and with those that the search started from.
    rms_percent, started_percent, noise_percent : float
        Root mean square misfit with each, and the recording's own noise, percent of the recorded force range; without
        bad samples.
    held_out : bool
        The curve was predicted, not fitted.
    smooth : Curve, optional
        The fitted curve without the recording's cycles and noise, to be drawn.
    branch : str
        Of a coupon that is loaded and unloaded: what was fitted, "loading", "unloading" or "both".
    samples : int
        Number of samples that were compared.
    """

    name: str
    recording: Recording
    fitted: Curve
    rms_percent: float
    started: Curve | None = None
    started_percent: float = float("nan")
    noise_percent: float = float("nan")
    held_out: bool = False
    smooth: Curve | None = None
    branch: str = ""
    samples: int = 0


@dataclass(frozen=True)
class Combination:
    """A direction in parameter space that the curves do not determine, in words and as weights by parameter."""

    weights: Mapping[str, float]
    singular_value: float
    text: str


@dataclass(frozen=True)
class Evaluation:
    """One evaluation of all channels.

    Attributes
    ----------
    number : int
        Counted from 1.
    parameters
    cost : float
        Mean square misfit in noise units; NaN where a march did not converge.
    best : bool
        Whether it is the best of this start so far.
    stage : {"search", "profile"}
        "profile" after the best is found.
    start : int
        Number of the start whose search it belongs to, from 0.
    iteration : int
        Iteration of the trust region: trials of the same iteration start from the same point. 0 without trust region.
    """

    number: int
    parameters: Mapping[str, float]
    cost: float
    best: bool
    stage: Literal["search", "profile"] = "search"
    start: int = 0
    iteration: int = 0


@dataclass(frozen=True)
class EndPoint:
    """Where one start ended: start and end parameters, cost at the end, and the optimiser's message."""

    start: Mapping[str, float]
    parameters: Mapping[str, float]
    cost: float
    message: str


@dataclass(frozen=True)
class Profile:
    """Cost along one parameter, all others refitted.

    Attributes
    ----------
    name : str
    values, rise : shape (n,)
        Values of the parameter, and the rise of the cost above the best one, in units of the observed noise.
    limits : tuple of str
        What ends the profile below and above: "misfit", the rise itself; "stability", a law that would be unstable in
        the rubber; "unsolvable", marches that fail; "bound"; "open", nothing within the range searched.
    """

    name: str
    values: Array
    rise: Array
    limits: tuple[Limit, Limit] = ("misfit", "misfit")


@dataclass(frozen=True)
class Fit:
    """An identified law.

    Attributes
    ----------
    material : Material
        Law with the identified parameters.
    parameters
        Name -> estimate.
    correlation : shape (parameters, parameters)
    curves
        Recorded against fitted, one per channel; held-out channels are marked.
    stability
        Coupon mode -> stretches between which the law is stable (0 and inf: over the whole range scanned).
    weighting
        What divides the misfit of coupons: "absolute", the coupon's largest stress; "relative", each stress itself.
        Recordings are weighted by their own noise.
    forward_solves, sweeps, failed_solves, iterations : int
        Counts of the search: simulations of one channel; evaluations of all channels; evaluations that did not
        converge; the optimiser's iterations.
    profile_sweeps : int
        Evaluations after the search, for the profiles.
    converged : bool
    singular_values
        Singular values of the weighted Jacobian per relative change of each parameter, relative to the largest, which
        comes first.
    undetermined
        Combinations that the curves leave open.
    seconds : float
    conditions
        What is doubtful about the result.
    method, message : str
        Optimiser, and its message at the end.
    cost : float
        Mean over the channels of the mean square misfit in units of the channel's noise.
    evaluations
        The search, evaluation by evaluation.
    end_points
        Where each start ended, best first.
    profiles
        Profiles of the parameters whose standard errors would mislead.
    leverage
        Channel -> parameter -> relative change of the parameter if that channel's force were 1 % larger: the influence
        of an error of calibration, of the mesh or of the model.
    faults
        Faults of the recordings or coupons, which are in the conditions too.
    tables
        Tables of dynamic stiffness beside the simulation, those held out too.
    """

    material: Material
    parameters: Mapping[str, Estimate]
    correlation: Array
    curves: tuple[FittedCurve, ...]
    stability: Mapping[str, tuple[float, float]]
    weighting: Weighting
    forward_solves: int
    sweeps: int
    failed_solves: int
    iterations: int
    converged: bool
    singular_values: Array
    undetermined: tuple[Combination, ...]
    seconds: float
    conditions: tuple[Condition, ...]
    method: str = "trf"
    message: str = ""
    cost: float = float("nan")
    evaluations: tuple[Evaluation, ...] = field(default=(), repr=False)
    end_points: tuple[EndPoint, ...] = ()
    profiles: tuple[Profile, ...] = ()
    profile_sweeps: int = 0
    leverage: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    effects: tuple[ActiveEffect, ...] = ()
    faults: tuple[DataFault, ...] = ()
    tables: tuple[ComparedTable, ...] = ()
