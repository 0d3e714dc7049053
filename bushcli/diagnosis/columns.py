"""What each effect of the catalogue would do to the recordings, beside a model at its best: columns to be tested.

The derivative of the curves by an effect's amplitude at its off value comes from one run of the model with the effect
in it, switched off: it changes nothing, and its derivative is exact. Shape parameters (times, gaps, thresholds), which
have no derivative there, are scanned on a small grid. An effect that starts with zero slope is tried at finite size.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bushcli.active import ActiveEffect
from bushcli.casefile import Case
from bushcli.diagnosis import kept, weighing
from bushcli.diagnosis.model import Fitted, Model
from bushcli.diagnosis.likelihood.noise import Compared
from bushcli.diagnosis.score import Candidate
from bushcli.diagnosis.usual import in_words, usual_size, usual_value
from bushcli.effect import Effect, EffectParameter, effect_name, effects, in_rig, rig_of, unsuited
from bushcli.inverse.channel import Channel
from bushcli.recording import Recording
from cases.march import NotConverged
from geometry.ring import Ring

Array = NDArray[np.float64]

# A derivative at the off value that is this small beside the effect of a typical amplitude says nothing.
FLAT = 1e-3
# Steps of a march, over the usual, that do for a first estimate; a coarse mesh does for it, too.
HALF = 0.5


@dataclass(frozen=True)
class Trial:
    """An effect at one point of its grid, switched off.

    Attributes
    ----------
    effect : Effect
    active : ActiveEffect
        What is to be added to the model; of an effect that the model has already, with one branch more.
    amplitudes : tuple of str
        Parameters by which derivatives are taken, by the effect's names.
    shape : mapping
        The grid's point.
    size : float, optional
        The first amplitude's finite value that is tried in place of its derivative.
    """

    effect: Effect
    active: ActiveEffect
    amplitudes: tuple[str, ...]
    shape: Mapping[str, float]
    size: float | None = None


@dataclass(frozen=True)
class Grid:
    """What is tried of an effect.

    Attributes
    ----------
    name : str
        The effect's; with the rig where another one has it already.
    trials : list of Trial
    reason : str
        Why there are none.
    """

    name: str
    trials: list[Trial]
    reason: str = ""


def grids(case: Case, fitted: Fitted, effect: Effect) -> list[Grid]:
    """The grid of an effect, or why it cannot be tested with these recordings; one for each rig that lacks it yet."""
    model = fitted.model
    acting = [c for c in fitted.channels if effect.acts_on(c.recording.mode)]
    if not acting:
        return [Grid(effect.name, [], "it does not act on the recorded modes")]
    if effect.needs_time and all(c.recording.time is None for c in acting):
        return [Grid(effect.name, [], "the recordings have no time")]
    reason = unfit(case, (*model.names, effect.name))
    if reason:
        return [Grid(effect.name, [], reason)]

    def made(present: ActiveEffect | None, rig: tuple[str, ...] | None, name: str) -> list[Trial]:
        there = [c.recording for c in acting if rig is None or c.recording.name in rig]
        return _grid(case, model, effect, present, name, rig, there)

    having = [one for one in model.effects if one.effect.name == effect.name]
    if not having:
        return [Grid(effect.name, [t for rig in rigs(effect, acting) for t in made(None, rig, effect.name)])]
    found = [Grid(one.name, trials) for one in having if (trials := made(one, one.channels, one.name))]
    if effect.of_channel:
        known = {name for one in having for name in one.channels or [c.recording.name for c in acting]}
        for rig in rigs(effect, acting):
            if rig is not None and not known & set(rig):
                name = in_rig(effect, rig[0])
                found.append(Grid(name, made(None, rig, name)))
    return found or [Grid(effect.name, [], "it is in the model already")]


def unfit(case: Case, names: Sequence[str]) -> str:
    """Why the specimen cannot have these effects together; empty where it can."""
    known = list(dict.fromkeys(map(effect_name, names)))
    for name in known:
        for what, _ in unsuited(effects()[name], case.geometry, [other for other in known if other != name]):
            return f"{name}: {what}"
    return ""


def rigs(effect: Effect, acting: Sequence[Compared]) -> list[tuple[str, ...] | None]:
    """Names of the channels that have an effect at a time; None = all that it acts on.

    What is offset, stopped or loose belongs to the rig of one mode: another one has another fixture and load cell. What
    needs time is tried where there is time.
    """
    timed = tuple(c.recording.name for c in acting if c.recording.time is not None)
    if effect.needs_time and 0 < len(timed) < len(acting):
        return [timed]
    found = dict.fromkeys(c.recording.mode for c in acting)
    if len(found) < 2 or not effect.of_channel:
        return [None]
    return [tuple(c.recording.name for c in acting if c.recording.mode == mode) for mode in found]


def _grid(
    case: Case,
    model: Model,
    effect: Effect,
    present: ActiveEffect | None,
    name: str,
    rig: tuple[str, ...] | None,
    recordings: Sequence[Recording],
) -> list[Trial]:
    """All points of the grid on some channels; none where the model has all of the effect there."""
    chosen = _parameters(effect, present)
    if not chosen:
        return []
    times = [one.time for one in recordings if one.time is not None]
    scales = {
        "": 1.0,
        "duration": max((float(t[-1] - t[0]) for t in times), default=1.0),
        "amplitude": max(float(np.abs(one.displacement).max()) for one in recordings),
    }
    shear = _shear(model, case)
    amplitudes = tuple(p for p in chosen if p.off is not None)
    shapes = [p for p in chosen if p.off is None]

    def values(parameter: EffectParameter) -> list[float]:
        if not parameter.scan or parameter.of_mesh:
            return [usual_value(effect, parameter, recordings)]
        # A grid of stresses is meant for a rubber of about 1 MPa.
        scale = shear if parameter.unit == "MPa" else scales[parameter.scale]
        grid = [float(np.clip(v * scale, parameter.lower, parameter.upper)) for v in parameter.scan]
        return [v for v in grid if not _taken(parameter, v, present)]

    found = []
    for point in product(*(values(p) for p in shapes)):
        shape = dict(zip((p.name for p in shapes), point, strict=True))
        off = {p.name: float(p.off or 0.0) for p in amplitudes}
        before = {} if present is None else dict(present.values)
        active = ActiveEffect(effect, before | off | shape, rig, rig_of(name))
        names = tuple(p.name for p in amplitudes)
        sizes: list[float | None] = [None]
        if amplitudes[0].sizes and isinstance(case.geometry, Ring):
            sizes = [share * case.geometry.thickness for share in amplitudes[0].sizes]
        found += [Trial(effect, active, names, shape, size) for size in sizes]
    return found


def _parameters(effect: Effect, present: ActiveEffect | None) -> tuple[EffectParameter, ...]:
    """Parameters of the effect that the model does not have: all but optional ones, or those of one branch more."""
    if present is None:
        return tuple(p for p in effect.parameters if not p.optional)
    missing = [p for p in effect.parameters if p.optional and p.name not in present.values]
    if not missing:
        return ()
    number = missing[0].name.lstrip("abcdefghijklmnopqrstuvwxyz_")
    return tuple(p for p in missing if p.name.endswith(number))


def _taken(parameter: EffectParameter, value: float, present: ActiveEffect | None) -> bool:
    """Whether a branch of the effect has about this value already: the new one would be its twin."""
    if present is None:
        return False
    stem = parameter.name.rstrip("0123456789")
    others = [v for name, v in present.values.items() if name.rstrip("0123456789") == stem]
    return any(0.5 < value / other < 2.0 for other in others if other > 0)


def _shear(model: Model, case: Case) -> float:
    law = model.task(case).law
    return float(law.shear_modulus(**model.start))


def columns(case: Case, fitted: Fitted, trial: Trial) -> tuple[Array, ...] | None:
    """Derivative of each channel's force by the amplitudes, shape (n, k) each; None where it cannot be solved."""
    model = replace(fitted.model, effects=(*_beside(fitted.model, trial), trial.active))
    # Beside others of its kind it may have another name there.
    there = next(
        one
        for one in model.effects
        if (one.effect.name, one.channels) == (trial.effect.name, trial.active.channels)
    )
    names = [f"{there.name}.{name}" for name in trial.amplitudes]
    coarse: kept.Coarse = "memory" if trial.effect.acts == "assembly" else "solid"
    channels = kept.channels(model.task(case), HALF, coarse)
    found: list[Array] = []
    for channel, compared in zip(channels, fitted.channels, strict=True):
        recording = compared.recording
        if not trial.active.acts_on(recording.name, recording.mode):
            found.append(np.zeros((len(recording.force), len(names))))
            continue
        slope = _solved(channel, (_values(model), _values(_at_own_shape(model, case))), names, trial)
        if slope is None:
            return None
        found.append(slope)
    return tuple(found)


def _solved(
    channel: Channel, points: Sequence[Mapping[str, float]], names: Sequence[str], trial: Trial
) -> Array | None:
    """Derivative at the first of several points that can be solved."""
    for values in points:
        try:
            return _derivative(channel, values, names, trial)
        except NotConverged:
            continue
    return None


def _at_own_shape(model: Model, case: Case) -> Model:
    """The model with the law's own start values at the stiffness of the fitted ones.

    A law that has bent towards an effect it lacks may not bear the bushing with it; a derivative beside another law is
    a fair first estimate, too.
    """
    chosen = model.task(case).law
    own = {p.name: p.start for p in chosen.parameters if p.name in model.start}
    factor = _shear(model, case) / float(chosen.shear_modulus(**own))
    scaled = {name: value * factor if name in chosen.linear else value for name, value in own.items()}
    return replace(model, start=scaled)


def _beside(model: Model, trial: Trial) -> tuple[ActiveEffect, ...]:
    """The effects of the model beside which an effect is tried.

    What acts in the bushing is tried beside what the rig does, and without what else acts in the bushing: the kernels
    of every combination would have to be compiled, some ten of which one is refitted. One branch more of an effect is
    tried beside those it has.
    """
    others = tuple(one for one in model.effects if one.name != trial.active.name)
    if trial.effect.acts == "rig" or len(others) < len(model.effects):
        return others
    return tuple(one for one in others if one.effect.acts == "rig")


def _values(model: Model) -> dict[str, float]:
    values = dict(model.start)
    for one in model.effects:
        values |= {one.full_name(p): one.values[p.name] for p in one.parameters}
    return values


def _derivative(channel: Channel, values: Mapping[str, float], names: Sequence[str], trial: Trial) -> Array:
    """Derivative at the off value; over a finite size where there is next to none."""
    if trial.size is not None:
        # The first amplitude's derivative is not asked for: in three dimensions it costs more than the force.
        force, slope = channel.at_samples(channel.solve(values, names[1:]))
        moved, _ = channel.at_samples(channel.solve({**values, names[0]: values[names[0]] + trial.size}, ()))
        return np.column_stack([(moved - force) / trial.size, slope])
    force, slope = channel.at_samples(channel.solve(values, names))
    if trial.effect.acts in ("rig", "rubber"):
        return slope
    for i, name in enumerate(names):
        size = next(p.start for p in trial.effect.parameters if p.name == trial.amplitudes[i])
        if float(np.abs(slope[:, i]).max()) * size > FLAT * float(np.ptp(force)):
            continue
        moved, _ = channel.at_samples(channel.solve({**values, name: values[name] + size}, ()))
        secant = (moved - force) / size
        if float(np.abs(secant).max()) > float(np.abs(slope[:, i]).max()):
            slope = slope.copy()
            slope[:, i] = secant
    return slope


def candidate(
    fitted: Fitted, effect: Effect, grid: Grid, found: Sequence[tuple[Array, ...] | None]
) -> Candidate:
    """Make a candidate of the columns at the points of a grid."""
    usable = [(t, c) for t, c in zip(grid.trials, found, strict=True) if c is not None]
    if not usable:
        reason = grid.reason or "the model cannot be solved with it"
        return Candidate(grid.name, ("",), (), (), (0,), untestable=reason)
    amplitudes = usable[0][0].amplitudes
    parameters = [next(p for p in effect.parameters if p.name == name) for name in amplitudes]
    return Candidate(
        name=grid.name,
        amplitudes=amplitudes,
        columns=tuple(calibration.columns(fitted.channels, fitted.used, c) for _, c in usable),
        points=tuple(t.shape for t, _ in usable),
        signs=tuple(1 if p.off == p.lower else 0 for p in parameters),
        typical=tuple(_typical(effect, parameters, fitted, t) for t, _ in usable),
        said=tuple(_said(effect, parameters, fitted, t) for t, _ in usable),
        sizes=tuple(t.size for t, _ in usable),
        channels=tuple(t.active.channels for t, _ in usable),
    )


def _typical(
    effect: Effect, parameters: Sequence[EffectParameter], fitted: Fitted, trial: Trial
) -> tuple[float, ...]:
    return tuple(usual_size(effect, p, _having(fitted, trial)) for p in parameters)


def _said(effect: Effect, parameters: Sequence[EffectParameter], fitted: Fitted, trial: Trial) -> str:
    """Typical amplitudes in words, at the door: "force = 3 N, displacement = 0.02 mm"."""
    recordings = _having(fitted, trial)
    return ", ".join(in_words(p, usual_size(effect, p, recordings), recordings) for p in parameters)


def _having(fitted: Fitted, trial: Trial) -> list[Recording]:
    """The recordings of the channels that have an effect."""
    there = [c.recording for c in fitted.channels]
    return [one for one in there if trial.active.acts_on(one.name, one.mode)]


def catalogue(names: Sequence[str] | None, known: Mapping[str, Effect], specimen: str) -> Iterator[Effect]:
    """The effects to be thought of, of those that a specimen can have."""
    for name, effect in known.items():
        if specimen in effect.specimens and (names is None or name in names):
            yield effect
