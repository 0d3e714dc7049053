"""Result of a diagnosis: where the simulation misses the recordings, the missing physics, and its probability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.diagnosis.searched import Searched
from bushcli.diagnosis.where.maps import LocalMap, Missing
from bushcli.diagnosis.where.record import Location
from bushcli.faults import DataFault
from bushcli.recording import Recording
from bushcli.runtime.condition import Condition

Array = NDArray[np.float64]

Verdict = Literal["explained", "missing_physics", "law_too_poor", "unexplained", "faulty_data"]


@dataclass(frozen=True)
class Quantity:
    """An identified parameter of the most probable model.

    Attributes
    ----------
    value, std : float
        Most probable value and standard deviation of the posterior, in `unit` (N, mm, MPa, s, rad, 1).
    unit, meaning : str
    lower, upper : float
        95 % interval of the posterior.
    derived : mapping
        The same under the name by which the field knows it, such as {"r": (3.2, "1")}; empty where there is none.
    channels : tuple of str, optional
        Names of those that have its effect; None = all that it acts on.
    prior : tuple of float, optional
        95 % interval of the prior, of the absolute value where both signs are possible; None of a law's parameter.
    prior_tail : float
        Probability of a value at least as far out by the prior: small where few bushings have it.
    prior_source : str
    word : str
        Of a choice: its value in words ("outer_top").
    """

    value: float
    std: float
    unit: str
    meaning: str
    lower: float
    upper: float
    derived: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    channels: tuple[str, ...] | None = None
    prior: tuple[float, float] | None = None
    prior_tail: float = 1.0
    prior_source: str = ""
    word: str = ""


@dataclass(frozen=True)
class Named:
    """An effect of the most probable model.

    Attributes
    ----------
    name, title, summary : str
        Its name among the model's: with the rig where another one has the same effect, "offset@radial"; its name for
        people; what it means in a sentence.
    parameters : mapping
        By the effect's own names.
    probability : float
        Of the effect: sum over all models that have it.
    evidence : float
        Twice the natural logarithm of the Bayes factor of the model against the same without it; NaN where that was
        not fitted.
    plausible : bool
        Whether its values lie where the priors have 99.9 % of their probability.
    remark : str
        Which value does not, or what else to know.
    channels : tuple of str, optional
        Names of those that have it, as the rig of one mode; None = all that it acts on.
    """

    name: str
    title: str
    summary: str
    parameters: Mapping[str, Quantity]
    probability: float
    evidence: float
    plausible: bool
    remark: str = ""
    channels: tuple[str, ...] | None = None

    @property
    def label(self) -> str:
        """Its name for people, with the channels that have it where not all of them have: "Offset (axial)"."""
        return self.title if self.channels is None else f"{self.title} ({', '.join(self.channels)})"


@dataclass(frozen=True)
class RankedModel:
    """A model that was compared.

    Attributes
    ----------
    law : str
    effects : tuple of str
        Their names with the rig where they belong to one ("offset@radial"); "free_law" where the law is
        identified although coupons give one, and "unknown" last where the model has the unknown effect.
    probability : float
    log_evidence : float
        Natural logarithm, less that of the plain law alone.
    misfit : float, optional
        Root mean square misfit over the noise; None where the model was not fitted and counts by its prediction.
    form_error : float, optional
        Error of the model's formulas that its likelihood took as most probable, as a share of the plain law's misfit.
    variants : mapping of str to str
        Effect -> what distinguishes it from the same effect in another model: "2 branches", "outer bottom".
    """

    law: str
    effects: tuple[str, ...]
    probability: float
    log_evidence: float
    misfit: float | None
    form_error: float | None
    variants: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Group:
    """Effects of which one is probable, though the recordings do not say which.

    Attributes
    ----------
    name : str
        What they have in common: "dissipation"; empty where there is no word for it.
    effects : tuple of str
    probability : float
        That at least one of them is there.
    text : str
        For people: "dissipation: internal friction or viscoelasticity, which one rate cannot tell".
    """

    name: str
    effects: tuple[str, ...]
    probability: float
    text: str


@dataclass(frozen=True)
class FormError:
    """Assumed form error of the most probable model.

    Attributes
    ----------
    share : float
        Over the plain law's misfit.
    percent : mapping of str to float
        Its root mean square by channel, percent of the recorded force range.
    covers : float
        Share of the squared misfit above the noise, left by the most probable model, that is within it; at most 1.
    """

    share: float
    percent: Mapping[str, float]
    covers: float


@dataclass(frozen=True)
class DiagnosedChannel:
    """A channel before and after.

    Attributes
    ----------
    name, mode : str
    recording : Recording
    before, after : shape (n,)
        Simulated force at the samples with the plain law and with the most probable model.
    before_percent, after_percent, noise_percent : float
        Root mean square misfit, and noise, percent of the recorded force range; samples that are data faults left out.
    held_out : bool
        Whether the channel took part in nothing: not in the fits, the screening or the evidence.
    path : shape (n,)
        Displacement without the sensor's noise, mm or rad.
    faulty : shape (n,) of bool
        Samples that are data faults and were left out.
    """

    name: str
    mode: str
    recording: Recording
    before: Array
    after: Array
    before_percent: float
    after_percent: float
    noise_percent: float
    held_out: bool
    path: Array
    faulty: NDArray[np.bool_]


@dataclass(frozen=True)
class NextTest:
    """The recording that would tell most about the rivals, per minute of testing.

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
    information : float
        Expected gain of information about which model is right, bit.
    possible : float
        Most that there is to gain: the entropy of the rivals' probabilities, bit.
    separates : tuple of (str, str)
        Pairs of rivals that it would tell apart, each a name or names joined by " + "; none where no recording does.
    text : str
    """

    name: str
    channel: str
    points: tuple[float, ...]
    rates: tuple[float, ...]
    holds: tuple[float, ...]
    minutes: float
    information: float
    possible: float
    separates: tuple[tuple[str, str], ...]
    text: str


@dataclass(frozen=True)
class Diagnosis:
    """Result of a diagnosis.

    Attributes
    ----------
    verdict
        By sums over models: "explained", the plain law alone; "missing_physics", effects are named;
        "law_too_poor", another law without any effect; "unexplained", with the unknown effect. "faulty_data": a fault
        of the data must be mended first, and nothing was fitted beyond the plain law.
    asked
        Effects that were considered, where not all were.
    law_from : {"recordings", "coupons"}
        Where the plain model's law comes from; that of coupons is fixed.
    law_fixed
        Whether the most probable model has kept it.
    plain, material : Material
        Law of the plain and of the most probable model.
    parameters
        All identified parameters of the most probable model, the law's among them.
    effects
        Those of the most probable model, the most probable first.
    probability : mapping
        Of every effect of the catalogue that was considered, by name, of "free_law" where coupons give the law, and of
        "unknown" and "nothing".
    models
        All with a probability of at least 0.1 %, best first.
    rivals
        Names of effects of the smallest set of models that holds 95 % of the posterior, without the first; one entry
        per set of effects, the most probable first. Empty where the first model holds 95 % alone.
    groups
    form_error
    missing
        What the unknown effect looks like; None where the misfit is noise.
    searched
    location
        Where in the record the plain model misses.
    remaining
        Where the most probable model still misses.
    next_test
        None where nothing has to be separated.
    maps
        Of the plain model's misfit, in the bushing.
    faults : tuple of DataFault
        What is wrong with the data.
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
    probability: Mapping[str, float]
    models: tuple[RankedModel, ...]
    rivals: tuple[tuple[str, ...], ...]
    groups: tuple[Group, ...]
    form_error: FormError
    missing: Missing | None
    searched: Searched
    channels: tuple[DiagnosedChannel, ...]
    location: Location
    remaining: Location
    next_test: NextTest | None
    maps: tuple[LocalMap, ...]
    faults: tuple[DataFault, ...]
    conditions: tuple[Condition, ...]
    forward_solves: int
    failed_solves: int
    seconds: float
