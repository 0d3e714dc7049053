"""Result of a diagnosis: where the simulation misses the recordings, the missing physics, and its probability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.diagnosis.words import sentences
from bushcli.faults import DataFault
from bushcli.mismatch.maps import LocalMap, Missing
from bushcli.mismatch.record import Location
from bushcli.recording import Recording
from bushcli.runtime.condition import Condition
from bushcli.selection.search_extent import SearchExtent
from bushcli.simulate.dynamic_tables import ComparedTable

Array = NDArray[np.float64]

# Share of the probability that fits may still change above which a search has hardly begun: judgement, more than half.
UNSEARCHED = 0.5
# Effects that are less probable than this have one row together in the report; only they may be called unnoticed.
# Words only.
SMALL = 0.01
Verdict = Literal["explained", "missing_physics", "law_too_poor", "unexplained", "faulty_data"]


@dataclass(frozen=True)
class Quantity:
    """An identified parameter of the most probable model.

    Attributes
    ----------
    value, std : float
        Most probable value and standard deviation of the posterior, in `unit` (N, mm, MPa, s, rad, 1).
    lower, upper : float
        95 % interval of the posterior.
    derived : mapping
        The value under the name that is common in the field, such as {"r": (3.2, "1")}; empty where there is none.
    channels : tuple of str, optional
        Names of those that have its effect; None = all that it acts on.
    prior : tuple of float, optional
        95 % interval of the prior, of the absolute value where both signs are possible; None for a law's parameter.
    prior_tail : float
        Prior probability of a value at least as far out: small if few bushings have such a value.
    word : str
        Value of a choice in words ("outer_top").
    with_form_error : float, optional
        Value of the fit that allows for the error of form and for the prior, if that is another one than `value`, with
        which the model comes closest to the recordings.
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
    with_form_error: float | None = None


@dataclass(frozen=True)
class DiagnosedEffect:
    """An effect of the most probable model.

    Attributes
    ----------
    name, title, summary : str
        Name within the model, with the rig if another rig has the same effect ("offset@radial"); name for readers;
        meaning in a sentence.
    parameters : mapping
        By the effect's own names.
    probability : float
        That these channels have it: sum over all models with that.
    evidence : float
        Twice the natural logarithm of the Bayes factor of the model against the same model without the effect; NaN if
        that was not fitted.
    plausible : bool
        Whether its values lie where the priors have 99.9 % of their probability.
    remark : str
        Names the values that do not; empty if all do.
    channels : tuple of str, optional
        Names of those that have it, for an effect in the rig of one mode; None = all that it acts on.
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
        """Its name for readers, with the channels that have it unless all have it: "Offset (axial)"."""
        return self.title if self.channels is None else f"{self.title} ({', '.join(self.channels)})"


@dataclass(frozen=True)
class RankedModel:
    """A model that was compared.

    Attributes
    ----------
    effects : tuple of str
        Their names, with the rig if they belong to one ("offset@radial"); then "free_law" if the law is identified
        although coupons give one; "unknown" last if the model has the unknown effect.
    log_evidence : float
        Natural logarithm, less that of the plain law alone.
    misfit : float, optional
        Root mean square misfit over the noise; None where the model was not fitted and counts by its prediction.
    form_error : float, optional
        Posterior mean of the error of the model's formulas, as a share of the rms misfit that it explains.
    variants : mapping of str to str
        Effect -> what distinguishes it from the same effect in other models: "2 branches", "outer bottom".
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
    """Effects of which one is probable, although the recordings cannot tell which.

    Attributes
    ----------
    name : str
        What they have in common: "dissipation"; empty where there is no word for it.
    probability : float
        That at least one of them is present.
    text : str
        For readers: "dissipation: internal friction or viscoelasticity, which these recordings cannot tell apart".
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
        Of the rms misfit that the model explains.
    percent : mapping of str to float
        Root mean square of the form error by channel, percent of the recorded force range.
    covers : float
        Share of the most probable model's squared misfit above the noise that the form error covers; at most 1. It
        concerns the features, which do not show what changes faster along a branch.
    fast : mapping of str to float
        Root mean square by channel of the misfit that changes faster than the features, percent of the recorded force
        range; of recordings along a path where it exceeds the noise twice.
    """

    share: float
    percent: Mapping[str, float]
    covers: float
    fast: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class DiagnosedChannel:
    """A channel with its simulations by the plain law and by the most probable model.

    Attributes
    ----------
    before, after : shape (n,)
        Simulated force at the samples with the plain law and with the most probable model.
    before_percent, after_percent, noise_percent : float
        Root mean square misfit, and noise, percent of the recorded force range, without samples that are data faults.
    held_out : bool
        Whether the channel was left out of the fits, the derivatives and the evidence.
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

    # What the percentages are relative to.
    of: ClassVar[str] = "of the force range"
    kind: ClassVar[Literal["static", "dynamic"]] = "static"


@dataclass(frozen=True)
class DiagnosedTable:
    """A table of dynamic stiffness with its simulations by the plain law and by the most probable model.

    Attributes
    ----------
    compared : ComparedTable
        Of the most probable model, with `started` of the plain law; without rows that are data faults.
    before_percent, after_percent, noise_percent : float
        Root mean square misfit of K*, and noise, relative to the measured one, percent.
    held_out : bool
        Whether the table was left out of the fits, the derivatives and the evidence.
    places : tuple of str
        Where the plain law misses it, in words, the largest part first.
    remaining : tuple of str
        Where the most probable model does.
    """

    compared: ComparedTable
    before_percent: float
    after_percent: float
    noise_percent: float
    held_out: bool
    places: tuple[str, ...]
    remaining: tuple[str, ...]

    # What the percentages are relative to.
    of: ClassVar[str] = "of K*"
    kind: ClassVar[Literal["static", "dynamic"]] = "dynamic"

    @property
    def name(self) -> str:
        """Name of the channel."""
        return self.compared.table.name

    @property
    def mode(self) -> str:
        """Its mode."""
        return self.compared.table.mode


@dataclass(frozen=True)
class NextTest:
    """The recording that is expected to say most about the rivals per minute of testing.

    Attributes
    ----------
    points : tuple of float
        Displacements that the path goes through, mm or rad.
    rates : tuple of float
        From each point to the next, mm/s or rad/s.
    holds : tuple of float
        At each point, s.
    information : float
        Expected gain of information about which model is right, bit.
    possible : float
        Largest possible gain: the entropy of the rivals' probabilities, bit.
    separates : tuple of (str, str)
        Pairs of rivals that it would distinguish, each a name or names joined by " + "; may be empty.
    frequency, amplitude, temperature : tuple of float
        Of a table of dynamic stiffness, Hz, mm or rad, degrees C: `points` are its preloads. Empty for a path.
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
    frequency: tuple[float, ...] = ()
    amplitude: tuple[float, ...] = ()
    temperature: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Result of a diagnosis.

    Attributes
    ----------
    verdict
        By sums over models: "explained", the plain law alone; "missing_physics", effects are named;
        "law_too_poor", another law without any effect; "unexplained", with the unknown effect. "faulty_data": a fault
        of the data must be corrected first, and nothing was fitted.
    asked
        Effects that were considered; None if all were.
    law_from : {"recordings", "coupons"}
        What the plain law was fitted to; a law from coupons is fixed.
    law_fixed
        Whether the law of the most probable model is fixed.
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
        All with a probability of at least 0.1 %, best first; none if the data are faulty or the search hardly began.
    rivals
        The fewest sets of effects that hold 95 % of the posterior together, by the names of their effects, the most
        probable first; without the set of the first model, and empty if that holds 95 % alone.
    missing
        The smooth part of the most probable model's misfit; None if the verdict is "explained".
    location
        Where in the record the plain law misses the recordings.
    remaining
        Where the most probable model still misses them.
    next_test
        None if there are no rivals, or if no recording is expected to distinguish them.
    maps
        Of the plain law's misfit, in the bushing.
    faults : tuple of DataFault
        What is wrong with the data.
    uniform_odds
        Whether all effects had the same prior odds.
    """

    case: Case
    verdict: Verdict
    asked: tuple[str, ...] | None
    law_from: Literal["recordings", "coupons"]
    law_fixed: bool
    plain: Material
    material: Material
    parameters: Mapping[str, Quantity] = field(default_factory=dict)
    effects: tuple[DiagnosedEffect, ...] = ()
    probability: Mapping[str, float] = field(default_factory=dict)
    models: tuple[RankedModel, ...] = ()
    rivals: tuple[tuple[str, ...], ...] = ()
    groups: tuple[Group, ...] = ()
    form_error: FormError
    missing: Missing | None = None
    searched: SearchExtent
    channels: tuple[DiagnosedChannel, ...]
    location: Location
    remaining: Location
    next_test: NextTest | None = None
    maps: tuple[LocalMap, ...] = ()
    faults: tuple[DataFault, ...]
    conditions: tuple[Condition, ...]
    forward_solves: int = 0
    failed_solves: int = 0
    seconds: float
    uniform_odds: bool = False
    tables: tuple[DiagnosedTable, ...] = ()

    @property
    def measured_channels(self) -> tuple[DiagnosedChannel | DiagnosedTable, ...]:
        """Recordings along a path, and tables."""
        return (*self.channels, *self.tables)

    @property
    def places(self) -> tuple[str, ...]:
        """Where the plain law misses what was measured, in words."""
        places = sentences(self.location) if self.channels or not self.tables else ()
        return (*places, *(text for table in self.tables for text in table.places))

    @property
    def remaining_places(self) -> tuple[str, ...]:
        """Where the most probable model still misses it, in words; empty where it is noise."""
        places = sentences(self.remaining) if self.remaining.mismatch else ()
        return (*places, *(text for table in self.tables for text in table.remaining))

    @property
    def is_unsearched(self) -> bool:
        """Whether the search ended before it had looked at most models: nothing is named then, nor ruled out."""
        return self.verdict == "unexplained" and self.searched.left > UNSEARCHED
