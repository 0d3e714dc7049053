"""Priors: odds of each effect and law, and the scales of the priors of values.

The file of an effect says how often it occurs, in three classes. Their odds are an engineer's judgement of how often a
bushing on a rig has an effect that is large enough to be seen. `uniform=True` gives all effects the same odds, whatever
else is present.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bushcli.case import Case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import Kind, effect
from bushcli.effects.prior import Prior, Scales
from bushcli.recording import Recording
from bushcli.recording.dynamic.rows import RecordedTable
from cases.mode import modes

# Odds that an effect is present in a size that is visible beside the errors of the formulas. Engineering judgement, in
# three classes: filled rubber softens, creeps and slips visibly in many tests; assembly and rig are imperfect in some;
# the rest is rare. According to all odds together, an effect is missing in one test of four (tables: one of three).
USUAL, OCCASIONAL, RARE = 0.03, 0.01, 0.005
ODDS = {"usual": USUAL, "occasional": OCCASIONAL, "rare": RARE}
# Factor on the odds of each further kind of what filled rubber does, beside one that is present: dissipation, softening
# and set have one cause, the filler, and are measured together (Diani, Fayolle and Gilormini 2009,
# doi:10.1016/j.eurpolymj.2008.11.017). Judgement: 2 to 10 change the answers of each deck by two recordings at most
# (`benchmarks/decks/odds.md`).
FILLED = 5.0
# Odds that a table shows no loss of the rubber. Judgement: the loss angle of unfilled natural rubber is 1 to 3 degrees,
# that of what suspensions are made of 3 to 15, and rigs measure it to 0.3.
LOSSLESS = 0.01
# Share of the odds of an effect of the rig that all modes may share, for that case: a load frame is as often at fault
# as a fixture. Engineering judgement.
SHARED = 0.5
# Odds of an effect that is not in the catalogue. Judgement: the odds of an occasional effect of the catalogue; half
# and twice this value change probabilities by up to 0.03 (`benchmarks/constants.md`).
UNKNOWN = 0.01
# Probability that the error of a formula is the change that another effect of the catalogue makes
# (`diagnosis.resemblance`): of 0.05 to 0.4 the one that gives the right answers of 28 recordings of the development
# deck the highest probability. Of their eleven foreign formulas, two leave what a second effect removes.
RESEMBLES = 0.2
# Odds of another law than the case's; and of a law identified from the recordings in place of the coupons', for rubber
# whose curve differs in shape from that of its coupons: rare, because another batch usually differs in modulus only.
OTHER_LAW, FREED_LAW = 0.03, 0.003
# Odds of another law than one of a single parameter: even. Judgement: such a law has no shape that could be fitted, and
# bushings are strained by 100 %, where rubber stiffens.
OTHER_THAN_ONE_PARAMETER = 1.0
# Standard deviation of a law's parameter: the change that alone would change the forces by this share of themselves.
# Half and twice this value change probabilities by less than 0.002 (`benchmarks/constants.md`).
LAW_SHARE = 1.0
# A recording shows the unloaded bushing if the force is near zero at a displacement near zero, by this share of the
# largest ones: 3 standard deviations of a zero that was set by hand.
NEAR_ZERO = 0.1


def effect_odds(name: str, uniform: bool = False, in_tables: bool = False) -> float:
    """Odds of an effect of the catalogue.

    Parameters
    ----------
    name : str
    uniform : bool
        Whether all effects have the same odds.
    in_tables : bool
        Whether tables of dynamic stiffness are among the recordings; then it applies to slow curves beside them, too.
    """
    if uniform:
        return OCCASIONAL
    known = effect(name)
    return ODDS[(known.how_often_in_tables if in_tables else None) or known.how_often]


def log_odds_together(names: Collection[str], uniform: bool = False, in_tables: bool = False) -> float:
    """Logarithm of the odds of effects together, before they are divided among rigs, branches and choices.

    Parameters
    ----------
    names : collection of str
        Names of effects, each once or several times.
    uniform : bool
        Whether all effects have the same odds, and none is more probable beside another.
    in_tables : bool
        As in `effect_odds`.
    """
    kinds = {effect(name).of_fillers for name in names} - {None}
    further = 0 if uniform else max(len(kinds) - 1, 0)
    odds = (effect_odds(name, uniform, in_tables) for name in names)
    together = sum(map(math.log, odds)) + further * math.log(FILLED)
    if in_tables and not uniform and "dissipation" in kinds:
        # One dissipation of the usual odds against none.
        together -= math.log(LOSSLESS * USUAL)
    return together


def log_odds(
    effects: Sequence[ActiveEffect],
    other_law: bool,
    freed: bool,
    unknown: bool,
    channels: Collection[tuple[str, Kind]],
    uniform: bool = False,
    of_one_parameter: bool = False,
) -> float:
    """Logarithm of the prior odds of a model against the plain law.

    Parameters
    ----------
    effects
        The odds of an effect that belongs to the rig of one mode are divided among the rigs, after the share of one
        that all modes have in common.
    other_law, freed, unknown : bool
        Whether the law is not the case's; is identified although coupons give one; whether the unknown effect acts.
    channels : collection of (str, Kind)
        Modes that were recorded, along a path or as dynamic stiffness.
    uniform : bool
        Whether all effects have the same odds.
    of_one_parameter : bool
        Whether the case's law has a single parameter. That counts where all channels are paths: tables show little of
        a law's shape.
    """
    paths = all(kind == "static" for _, kind in channels)
    total = log_odds_together([active.effect.name for active in effects], uniform, in_tables=not paths)
    for active in effects:
        odds = 1.0
        rigs = len({channel for channel in channels if active.effect.acts_on(*channel)})
        if rigs > 1 and active.effect.may_be_shared:
            odds *= SHARED if active.channels is None else (1.0 - SHARED) / rigs
        elif rigs > 1 and active.effect.of_channel:
            odds /= rigs
        total += math.log(odds)
        # Each number of branches, each variant, each value of a choice or of a scanned dimension is a separate model.
        variants = [p for p in active.effect.variants if paths or not p.along_path]
        total -= math.log(active.effect.branches + len(variants))
        for parameter in active.parameters:
            total -= math.log(max(1, len(parameter.choices or parameter.scan))) if parameter.of_mesh else 0.0
    other = OTHER_THAN_ONE_PARAMETER if of_one_parameter and paths else OTHER_LAW
    for applies, odds in ((other_law, other), (freed, FREED_LAW), (unknown, UNKNOWN)):
        if applies:
            total += math.log(odds)
    return total


def scales_of(case: Case, shear: float, recordings: Sequence[Recording]) -> Scales:
    """Return the scales of priors, from the recordings on which an effect acts and from the specimen.

    Parameters
    ----------
    case : Case
    shear : float
        Shear modulus, MPa.
    recordings : sequence of Recording
    """
    spans, sizes = (
        [recording.span for recording in recordings if recording.has_time],
        [recording.largest for recording in recordings],
    )
    stiffness = max((force / max(travel, 1e-300) for travel, force in sizes), default=1.0)
    wall = case.geometry.wall
    thickness = wall.thickness if wall is not None else 10.0
    length = wall.inner[1] - wall.inner[0] if wall is not None else 4.0 * thickness
    # From a mass to a moment of inertia, where all channels are of rotations.
    outer = wall.inner_radius + thickness if wall is not None else thickness
    turned = bool(recordings) and all(modes()[recording.mode].rotational for recording in recordings)
    return {
        "duration": max((span[1] for span in spans), default=1.0),
        # A table shows a rig's lag of microseconds, a slow curve beside it is sampled every half second.
        "interval": min((span[0] for span in spans), default=1.0),
        "travel": max((size[0] for size in sizes), default=1.0),
        "force": max((size[1] for size in sizes), default=1.0),
        "stiffness": stiffness,
        "compliance": 1.0 / stiffness,
        "thickness": thickness,
        "length": length,
        "shear": shear,
        "1/shear": 1.0 / shear,
        "squared arm": outer**2 if turned else 1.0,
    }


def _shows_rest(recording: Recording) -> bool:
    """Whether a recording passes near zero force at, or on both sides of, a displacement near zero."""
    whole = recording.record
    q, force = (x / max(float(np.abs(x).max()), 1e-300) for x in (whole.displacement, whole.force))
    at = q[np.abs(force) <= NEAR_ZERO]
    return bool(len(at) and at.min() <= NEAR_ZERO and at.max() >= -NEAR_ZERO)


@dataclass(frozen=True)
class ParameterPrior:
    """The prior of one identified parameter.

    Attributes
    ----------
    prior : Prior
    scales : Scales
    one_sided : bool
        Whether its off value is its lower bound.
    """

    prior: Prior
    scales: Scales
    one_sided: bool

    def row(self, value: float) -> tuple[float, float]:
        """A residual whose half square is the negative logarithm of the prior, up to a constant, and its derivative."""
        return self.prior.row(value, self.scales)

    def pull(self, value: float) -> float:
        """The precision of a zero-mean normal prior with the same gradient; 0 for a prior of the logarithm."""
        return 0.0 if self.prior.is_logarithmic else self.prior.weight(value, self.scales)


def _in_tables(prior: Prior, scales: Scales, recordings: Sequence[Recording]) -> Prior:
    """Return the prior of a time, extended down to a third of the shortest time that a dynamic table shows."""
    fastest = min(
        (recording.times[0] for recording in recordings if isinstance(recording, RecordedTable)),
        default=np.inf,
    )
    if prior.of != "duration" or prior.shape != "log_uniform" or fastest == np.inf:
        return prior
    return replace(prior, low=min(prior.low, fastest / 3.0 / scales["duration"]))


def known_parameters(
    case: Case, effects: Sequence[ActiveEffect], shear: float, recordings: Sequence[Recording]
) -> dict[str, ParameterPrior]:
    """Priors of the effects' parameters that have one, by full name.

    Parameters
    ----------
    case : Case
    effects : sequence of ActiveEffect
    shear : float
        Shear modulus, MPa.
    recordings : sequence of Recording
    """
    priors = {}
    for active in effects:
        affected = [
            recording
            for recording in recordings
            if active.acts_on(recording.name, recording.mode, recording.kind)
        ]
        scales = scales_of(case, shear, affected)
        for parameter in active.parameters:
            prior = parameter.prior
            if prior is not None:
                if prior.unrested and not any(
                    recording.kind == "static" and _shows_rest(recording) for recording in affected
                ):
                    prior = replace(prior, low=prior.unrested)
                one_sided = parameter.off is not None and parameter.off == parameter.lower
                prior = _in_tables(prior, scales, affected)
                priors[active.full_name(parameter)] = ParameterPrior(prior, scales, one_sided)
    return priors
