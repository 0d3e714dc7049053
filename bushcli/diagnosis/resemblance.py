"""Errors of form that resemble an effect: which share of a model's probability belongs to the model without it.

The formula of a true effect leaves a share phi of what it explains, and a law leaves a share lambda of the force
(`likelihood.form`), in any direction. But formulas of one rubber on one rig have much in common: what a wrong formula
leaves is often what another effect does; where a fixture hardens, a linear one leaves what free play does. The fit with
this second effect is much better then, although it is absent. Therefore an error of form resembles an effect of the
catalogue with probability `RESEMBLES`, and is then the change that this effect makes, as large as an error of form.

The likelihood of this is that of the model with the second effect; its prior differs: the odds are those of the
resemblance, and the density of the effect's amplitude a follows from the size of its change, r, in proportion to a:

    ratio = RESEMBLES / (1 - RESEMBLES) / n / (odds of all effects / odds of those left) p(ln r) / (|a| pi(a))

for n effects in the catalogue, with pi the prior density of the amplitude, and p log-normal about phi. Of several
amplitudes, such as those of a force and of a displacement, a is the one that changes the recordings most; the others
keep their priors. r is relative to what the effects do that are left. That is measured twice, and the smaller r counts:
with the law fitted, as the part of the change that the other parameters cannot imitate relative to the misfit of the
plain law; and with all other parameters held, relative to the largest change by one of these effects. The law adapts
itself to nearly all that a swaging does, but not to its error: a swaging that is uneven along the bushing moves the
inner sleeve, as an offset does. If no effect is left, p is log-normal about lambda with r relative to the force. Six
limits: beyond the 95 % range of its prior pi(a) |a| counts as at the end of that range, so that an error of form is
there as improbable as the effect itself; an effect whose change is as large as what the others do is no error of form;
the error of an effect lies in the channels on which it acts, and elsewhere there is only that of the law; in each
branch it is no larger than `PHI_MOST` of what the effect does there, and what is larger is as improbable as an error of
the law of that size (a stop does nothing before it is met, a lag nothing in slow motion: an offset of the force there
is none of their errors); the force that a law or an effect without memory makes wrong depends on the displacement
alone, so that its error resembles no effect with memory; and the error of relaxation in a table, with other effects of
the rig or without, resembles no lag, mass, resonance or compliance of the rig. Of what three branches leave of 200
relaxations of other formulas a fourth branch leaves a third (median), a lag 0.63, a mass or a resonance 0.8 and a
compliance all; of what `payne` leaves of other relaxations that amplitude thins they leave nearly all
(`benchmarks/branches.py`).

References
----------
Brynjarsdóttir and O'Hagan (2014), Learning about physical parameters: the importance of model discrepancy, Inverse
Probl. 30:114007, doi:10.1088/0266-5611/30/11/114007: parameters of a model without discrepancy, or with one of which
nothing is known, become certain and wrong.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import EffectParameter, effects_on
from bushcli.evidence.prior import RESEMBLES, log_odds_together
from bushcli.likelihood.form import LAMBDA, LAMBDA_SPREAD, PHI, PHI_MOST, PHI_SPREAD
from bushcli.selection.additions import RELAXING
from bushcli.selection.model import Key
from bushcli.selection.state import State

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Size:
    """Size of the change of the features by an effect.

    Attributes
    ----------
    whole : float
        Root of the sum of squares while all other parameters stay, in units of the noise.
    own : float
        The same of what the parameters of the law and of the effects that are left cannot imitate.
    whole_by_branch, own_by_branch : shape (b,)
        The same of each branch of the recordings along a path.
    """

    whole: float
    own: float
    whole_by_branch: Array
    own_by_branch: Array

    @classmethod
    def of(cls, state: State, active: ActiveEffect, removed: Sequence[ActiveEffect]) -> Size:
        """Return the size of an effect of a model, to first order in its amplitudes; those `removed` are not left."""
        parameters = {effect.full_name(p) for effect in (active, *removed) for p in effect.parameters}
        names, slopes = state.fitted.names, np.vstack(state.slopes)
        change = np.concatenate(_changes(state, active))
        own, others = change, slopes[:, [name not in parameters for name in names]]
        if others.shape[1]:
            others = others / np.maximum(np.linalg.norm(others, axis=0), 1e-300)
            own = change - others @ np.linalg.lstsq(others, change, rcond=None)[0]
        number = _branches(state)
        by_branch = (np.sqrt(np.bincount(number, rows**2))[1:] for rows in (change, own))
        return cls(float(np.linalg.norm(change)), float(np.linalg.norm(own)), *by_branch)

    def relative_to(self, others: Sequence[Size], explained: float, form: float = 1.0) -> float:
        """Return the size relative to the effects beside which it is, one at least.

        `explained` is the root of the sum of squares of the features that all effects explain, in units of the noise,
        times `form`: the error of form over that in recordings along a path.
        """
        most = form * max(other.whole for other in others)
        return min(self.own / max(explained, 1e-300), self.whole / max(most, 1e-300))

    def beyond(self, others: Sequence[Size]) -> float:
        """Return the size of what no error of the effects beside it can do, because they do too little there.

        In each branch their errors may be as large as the largest share of what they do.
        """
        most = PHI_MOST * np.max([other.whole_by_branch for other in others], axis=0)
        return float(np.linalg.norm(np.maximum(self.own_by_branch - most, 0.0)))


def resemblances(
    state: State, uniform: bool = False, fits: Mapping[Key, State] | None = None
) -> Iterator[tuple[tuple[str, ...], float]]:
    """Yield sets of effects of a model, each with how probable it is that errors of form resemble them.

    Yields
    ------
    tuple of str
        Identities of effects of the model that are errors of form of the rest.
    float
        Logarithm of the probability of this, over that of the model with all its effects; none is minus infinity.
    """
    active = {effect.identity: effect for effect in state.model.effects}
    if not active:
        return
    names = {name: effect.effect.name for name, effect in active.items()}
    in_tables = any(recording.kind == "dynamic" for recording in state.problem.recordings)
    odds = log_odds_together(list(names.values()), uniform, in_tables)
    densities = {name: _log_density_of_size(state, effect) for name, effect in active.items()}
    # Any effect of the catalogue that acts on recordings along a path, whichever the user asks for.
    resembles = math.log(RESEMBLES / (1.0 - RESEMBLES) / len(effects_on("static")))
    likelihood = state.problem.likelihood
    explained, signal = (
        math.sqrt(float(values.sum())) for values in (likelihood.explained_squares, likelihood.signal)
    )
    for length in range(1, len(active) + 1):
        for removed in combinations(sorted(active), length):
            left = [effect for name, effect in active.items() if name not in removed]
            sizes = {
                name: Size.of(state, effect, [active[other] for other in removed])
                for name, effect in active.items()
            }
            largest = max(removed, key=lambda name: sizes[name].own)
            together = _fitted_size(state, left, fits or {})
            sizes[largest] = replace(sizes[largest], own=max(sizes[largest].own, together))
            total = log_odds_together([names[effect.identity] for effect in left], uniform, in_tables) - odds
            for name in removed:
                # An error of form of one effect can resemble another in a channel that both have.
                own = active[name].channels
                beside = [
                    effect
                    for effect in left
                    if own is None or effect.channels is None or not set(own).isdisjoint(effect.channels)
                ]
                remembers = any(effect.effect.has_memory for effect in beside)
                if (active[name].effect.has_memory and not remembers) or _is_no_error_of_relaxation(
                    state, active[name], beside
                ):
                    total = -math.inf
                    break
                size, others = sizes[name], [sizes[effect.identity] for effect in beside]
                total += resembles - densities[name]
                if not others:
                    total += _log_density(size.own, LAMBDA * signal, LAMBDA_SPREAD)
                    continue
                relative = size.relative_to(others, explained, likelihood.form)
                total += _log_density(relative, PHI, PHI_SPREAD, PHI_MOST / PHI)
                # Where they do nothing, only the law can be as wrong.
                total += _log_exceeded(size.beyond(others), LAMBDA * signal, LAMBDA_SPREAD)
            if math.isfinite(total):
                yield removed, total


def _changes(state: State, active: ActiveEffect) -> list[Array]:
    """Return the change of the features of each channel by an effect of a model, to first order in its amplitudes."""
    off = {active.full_name(p): float(p.off or 0.0) for p in active.effect.amplitudes}
    pairs = zip(state.fitted.names, state.fitted.x, strict=True)
    amplitudes = np.array([x - off[name] if name in off else 0.0 for name, x in pairs])
    return [slopes @ amplitudes for slopes in state.slopes]


def _is_no_error_of_relaxation(state: State, active: ActiveEffect, beside: Sequence[ActiveEffect]) -> bool:
    """Whether an effect is a lag, mass, resonance or compliance of the rig that tables show beside relaxation alone.

    They show it if it changes them more than the other recordings, and of the effects beside it only relaxation and
    others of the rig act on them: in one table these are linear, and of a given frequency.
    """
    rig = active.effect.rig
    if rig is None or not (rig.vibrate or rig.clock or rig.spring):
        return False
    beside_relaxation = elsewhere = 0.0
    for recording, change in zip(state.problem.recordings, _changes(state, active), strict=True):
        parts = {
            effect.effect.in_force_law
            for effect in beside
            if effect.effect.acts != "rig" and effect.acts_on(recording.name, recording.mode, recording.kind)
        }
        if recording.kind == "dynamic" and parts and parts <= RELAXING:
            beside_relaxation += float(change @ change)
        else:
            elsewhere += float(change @ change)
    return beside_relaxation > elsewhere


def _fitted_size(state: State, left: Sequence[ActiveEffect], fits: Mapping[Key, State]) -> float:
    """Return the size of the misfit that the removed effects explain, in units of the noise; 0 if unknown.

    The fit without them says what the other parameters can imitate, within their bounds and beyond first order.
    """
    fitted = fits.get(replace(state.model, effects=tuple(left)).structure)
    if fitted is None or not (fitted.fitted.converged or not left):
        return 0.0
    more = fitted.evidence.left.excess.sum() - state.evidence.left.excess.sum()
    return math.sqrt(max(float(more), 0.0))


def _log_density_of_size(state: State, active: ActiveEffect) -> float:
    """Logarithm of the prior density of ln |a|, a being the leading amplitude; infinite without a prior, or at zero."""
    parameter = _leading_amplitude(state, active)
    known = state.priors.get(active.full_name(parameter))
    off, value = float(parameter.off or 0.0), float(active.values[parameter.name])
    size = abs(value - off)
    if known is None or size == 0.0:
        return math.inf
    # An error of form resembles an effect as it may be: beyond the range of its prior both are equally improbable.
    most = min(size, known.prior.range(known.scales)[1])
    density = known.prior.log_density(off + math.copysign(most, value - off), known.scales) + math.log(most)
    return density + (0.0 if known.one_sided else math.log(2.0))


def _leading_amplitude(state: State, active: ActiveEffect) -> EffectParameter:
    """Return the amplitude of an effect that changes the features most: the size of the change is in proportion to it.

    An amplitude that the recordings do not show may be anywhere within its prior, also at zero: its density says
    nothing about the size of the change.
    """
    names, slopes = state.fitted.names, np.vstack(state.slopes)

    def change(parameter: EffectParameter) -> float:
        name = active.full_name(parameter)
        if name not in names:
            return 0.0
        i = names.index(name)
        return float(np.linalg.norm(slopes[:, i]) * abs(state.fitted.x[i] - float(parameter.off or 0.0)))

    return max(active.effect.amplitudes, key=change)


def _log_density(size: float, median: float, spread: float, most: float = math.inf) -> float:
    """Logarithm of a log-normal density, of the logarithm of the size, cut off at `most` medians."""
    if not 0.0 < size < most * median:
        return -math.inf
    z = math.log(size / median) / spread
    inside = math.log(ndtr(math.log(most) / spread)) if math.isfinite(most) else 0.0
    return -0.5 * z * z - math.log(spread) - 0.5 * math.log(2.0 * math.pi) - inside


def _log_exceeded(size: float, median: float, spread: float) -> float:
    """Logarithm of a log-normal density of the logarithm of the size over its largest value; 0 below the median."""
    return -0.5 * (math.log(max(size / median, 1.0)) / spread) ** 2


def _branches(state: State) -> NDArray[np.intp]:
    """Return the number, from 1, of the branch of each feature of all channels; 0 in tables."""
    numbers, last = [], 0
    for feature in state.problem.likelihood.features:
        own = np.cumsum(feature.degrees == 0) + last
        numbers.append(np.zeros_like(own) if feature.independent else own)
        last = int(numbers[-1].max(initial=last))
    return np.concatenate(numbers)
