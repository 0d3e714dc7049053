"""What a diagnosis returns: where the simulation misses the recordings, what was left out, and how that was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.casefile import Case, Material
from bushcli.condition import Condition
from bushcli.diagnosis.locate import Location
from bushcli.effect import effect_name
from bushcli.recording import Recording

Array = NDArray[np.float64]

Verdict = Literal["explained", "missing_physics", "law_too_poor", "unexplained"]


@dataclass(frozen=True)
class Quantity:
    """An identified parameter of the final model.

    Attributes
    ----------
    value, std : float
        Best value and standard error, in `unit` (N, mm, MPa, s, rad, 1).
    unit, meaning : str
    lower, upper : float
        95 % interval.
    derived : mapping
        The same under the name by which the field knows it, such as {"r": (3.2, "1")}; empty where there is none.
    channels : tuple of str, optional
        Names of those that have its effect; None = all that it acts on.
    """

    value: float
    std: float
    unit: str
    meaning: str
    lower: float
    upper: float
    derived: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    channels: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Named:
    """An effect that the diagnosis has found.

    Attributes
    ----------
    name, summary : str
        Its name among the model's: with the rig where another one has the same effect, "offset@radial".
    parameters : mapping
        By the effect's own names.
    evidence : float
        By how much BIC is worse without it (2 ln of the Bayes factor, roughly); above 6 is strong, above 10 decisive.
        NaN where the model without it cannot be solved.
    plausible : bool
    remark : str
        Why it is or is not plausible, or what else to know.
    channels : tuple of str, optional
        Names of those that have it, as the rig of one mode; None = all that it acts on.
    """

    name: str
    summary: str
    parameters: Mapping[str, Quantity]
    evidence: float
    plausible: bool
    remark: str = ""
    channels: tuple[str, ...] | None = None

    @property
    def label(self) -> str:
        """Its name, with the channels that have it where not all of them have: "offset (axial)"."""
        name = effect_name(self.name)
        return name if self.channels is None else f"{name} ({', '.join(self.channels)})"


@dataclass(frozen=True)
class Hypothesis:
    """A row of the table of all that was thought of.

    Attributes
    ----------
    name : str
        An effect, or "law: yeoh".
    testable : bool
    reason : str
        Why it cannot be tested with these recordings; empty when it can.
    drop : float
        Fall of chi square that the score test expects of it, beside the plain law.
    z, p : float
        Of the score test; NaN where there was none.
    amplitude : mapping
        First-order estimate, parameter -> value.
    refitted : bool
        Whether it was fitted together with the law.
    bic : float
        Change of BIC that the refit brought, against the plain law; NaN where it was not refitted.
    misfit : float
        Root mean square misfit over the noise after the refit, NaN likewise.
    chosen : bool
    channels : tuple of str, optional
        Names of those that have it in the score test; None = all that it acts on.
    """

    name: str
    testable: bool
    reason: str
    drop: float
    z: float
    p: float
    amplitude: Mapping[str, float]
    refitted: bool = False
    bic: float = float("nan")
    misfit: float = float("nan")
    chosen: bool = False
    channels: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Stage:
    """A step of the selection.

    Attributes
    ----------
    action : {"fit", "add", "drop", "refuse", "stop"}
    effects : tuple of str
        In the model after it.
    law : str
    bic : float
        Of the model; the less the better.
    misfit : float
        Root mean square misfit over the noise.
    held_out : float
        The same on samples that the model was not fitted to; NaN where none were held out.
    text : str
        What was done and why.
    """

    action: Literal["fit", "add", "drop", "refuse", "stop"]
    effects: tuple[str, ...]
    law: str
    bic: float
    misfit: float
    held_out: float
    text: str


@dataclass(frozen=True)
class DiagnosedChannel:
    """A channel before and after.

    Attributes
    ----------
    name, mode : str
    recording : Recording
    before, after : shape (n,)
        Simulated force at the samples with the plain law and with the final model.
    before_percent, after_percent, noise_percent : float
        Root mean square misfit, and noise, percent of the recorded force range.
    held_out : shape (n,) of bool
        Samples kept from the fits behind the next two.
    held_out_text : str
        "cycle 4".
    held_out_before, held_out_after : float
        Root mean square misfit on them, percent of the force range; NaN where nothing was held out.
    path : shape (n,)
        Displacement without the sensor's noise, mm or rad.
    """

    name: str
    mode: str
    recording: Recording
    before: Array
    after: Array
    before_percent: float
    after_percent: float
    noise_percent: float
    held_out: NDArray[np.bool_]
    held_out_text: str
    held_out_before: float
    held_out_after: float
    path: Array


@dataclass(frozen=True)
class NextTest:
    """The cheapest recording that would separate the rivals.

    Attributes
    ----------
    name, channel : str
    points : tuple of float
        Displacements that the path goes through, mm or rad.
    rates : tuple of float
        Of each way, mm/s or rad/s.
    holds : tuple of float
        At each point, s.
    minutes : float
    separates : tuple of (str, str)
        Pairs of rivals that it would tell apart, each a name or names joined by " + "; none where no recording does.
    distance : float
        Smallest difference of two rivals in standard errors; above 4.65 one recording decides.
    text : str
    """

    name: str
    channel: str
    points: tuple[float, ...]
    rates: tuple[float, ...]
    holds: tuple[float, ...]
    minutes: float
    separates: tuple[tuple[str, str], ...]
    distance: float
    text: str


@dataclass(frozen=True)
class LocalMap:
    """Where in the rubber a change of stiffness would help some channels together.

    Attributes
    ----------
    channels : tuple of str
    points : shape (n, 2) or (n, 3)
        Corners of the cells, mm: (R, Z) of the half-plane, or x, y, z.
    cells : shape (m, 4) or (m, 8)
        Corners by cell.
    factor : shape (m,)
        Regularised change of stiffness that the misfit asks for: 0.1 is 10 % stiffer.
    local_gain, uniform_gain : float
        Share of the misfit's sum of squares that the map, and the best uniform factor, would take away (beside what the
        law's parameters can do).
    helps_locally : bool
        Whether a local change helps significantly more than a uniform one.
    text : str
    """

    channels: tuple[str, ...]
    points: Array
    cells: NDArray[np.int64]
    factor: Array
    local_gain: float
    uniform_gain: float
    helps_locally: bool
    text: str

    @property
    def name(self) -> str:
        """Names of the channels: "axial + radial"."""
        return " + ".join(self.channels)


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer.

    Attributes
    ----------
    verdict
        "explained": the plain law reaches the noise; "missing_physics": effects are named; "law_too_poor": another law,
        without any effect, reaches it or at least halves the misfit; "unexplained": nothing in the catalogue helps
        enough.
    asked
        Effects that were to be thought of, where not all were.
    law_from : {"recordings", "coupons"}
        Where the plain model's law comes from; that of coupons is fixed.
    law_fixed
        Whether the final model has kept it.
    plain, material : Material
        Law of the plain and of the final model.
    parameters
        All identified parameters of the final model, the law's among them.
    effects
        What was left out, strongest evidence first.
    hypotheses
        All that was thought of, best first, those that cannot be tested last.
    path
        The selection, step by step.
    location
        Where in the record the plain model misses.
    remaining
        Where the final model still misses.
    rivals
        Sets of effects (names joined in a tuple; empty tuple = no effect) that these recordings cannot tell apart; the
        chosen one first.
    next_test
        None where nothing has to be separated.
    maps
        Of the plain model's misfit, in the bushing.
    """

    case: Case
    verdict: Verdict
    asked: tuple[str, ...] | None
    law_from: Literal["recordings", "coupons"]
    law_fixed: bool
    plain: Material
    material: Material
    parameters: Mapping[str, Quantity]
    effects: tuple[Named, ...]
    hypotheses: tuple[Hypothesis, ...]
    path: tuple[Stage, ...]
    channels: tuple[DiagnosedChannel, ...]
    location: Location
    remaining: Location
    rivals: tuple[tuple[str, ...], ...]
    next_test: NextTest | None
    maps: tuple[LocalMap, ...]
    conditions: tuple[Condition, ...]
    forward_solves: int
    failed_solves: int
    seconds: float
