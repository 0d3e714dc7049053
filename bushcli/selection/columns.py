"""Derivatives of the curves by each effect of the catalogue, at the best fit of a model.

The derivative of the curves by an effect's amplitude at its off value comes from one run of the model that has the
effect switched off: it changes nothing, and its derivative is exact. Shape parameters (times, gaps, thresholds), which
have no derivative there, are scanned on a small grid. An effect whose derivative is zero is tried at a finite size.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import Effect, EffectParameter, effects, reasons_against
from bushcli.effects.names import effect_name, rig_of
from bushcli.effects.rig import NoEquilibrium
from bushcli.evidence.prior import scales_of
from bushcli.inverse.channel import StepLimit
from bushcli.inverse.table_channel import AnyChannel
from bushcli.recording import Recording
from bushcli.recording.dynamic.rows import SAMPLED, RecordedTable
from bushcli.recording.dynamic.table import temperature_levels
from bushcli.selection.model import Model
from bushcli.selection.model_cache import ESTIMATED, Coarse, ModelCache
from cases.march import NotConverged
from cases.mode import modes
from cases.six import MOTIONS

Array = NDArray[np.float64]

# If a typical amplitude times the derivative at off is below this share of the force range, a secant is tried. Other
# values change probabilities by less than 0.002 (`benchmarks/constants.md`).
FLAT = 1e-3
# Factor on the default number of steps of a march: enough for a first estimate, as is a coarse mesh.
HALF = 0.5
# Failed steps after which a march is given up: another point of the grid is as good.
FAILED_STEPS = 2
# Relaxation times tried per decade of the frequencies of a table, as of a recording's duration.
DECADE = 2


@dataclass(frozen=True)
class Candidate:
    """An effect at one point of its grid, switched off.

    Attributes
    ----------
    active : ActiveEffect
        The effect to be added to the model; one that the model has already gets one branch more.
    amplitudes : tuple of str
        Parameters by which derivatives are taken, by the effect's names.
    shape : mapping
        Values of the shape parameters at the grid's point.
    size : float, optional
        Finite value of the first amplitude that is tried in place of the derivative by it.
    """

    active: ActiveEffect
    amplitudes: tuple[str, ...]
    shape: Mapping[str, float]
    size: float | None = None

    @property
    def effect(self) -> Effect:
        """The effect."""
        return self.active.effect

    def add_to(self, model: Model) -> Model:
        """Return the model with the effect switched off, or with one more branch if the model has the effect."""
        others = [active for active in model.effects if active.identity != self.active.identity]
        return replace(model, effects=(*others, self.active))


def trials(
    case: Case, model: Model, effect: Effect, recordings: Sequence[Recording], shear: float
) -> tuple[list[Candidate], str]:
    """Return the variants of an effect to try beside a model; if there are none, the reason.

    Grids of stresses and energies follow from the shear modulus `shear` (MPa): one for all models, so that derivatives
    are reused.
    """
    acting = [recording for recording in recordings if effect.acts_on(recording.mode, recording.kind)]
    if not acting:
        return [], "it does not act on the recorded modes"
    if effect.needs_time and not any(recording.has_time for recording in acting):
        return [], "the recordings have no time"
    if effect.needs_temperature:
        degrees = np.concatenate(list(temperatures(case, recordings).values()))
        if np.isnan(degrees).any():
            return [], "a recording has no temperature"
        if len(temperature_levels(degrees)) < 2:
            return [], "the recordings have one temperature"
    if effect.needs_amplitudes and all(
        isinstance(recording, RecordedTable) and not recording.has_amplitudes for recording in acting
    ):
        return [], "the tables have one amplitude"
    reason = incompatibility(case, (*(active.effect.name for active in model.effects), effect.name))
    if reason:
        return [], reason
    instances = [active for active in model.effects if active.effect.name == effect.name]
    candidates: list[Candidate] = []
    everywhere = [recording.name for recording in recordings]
    for instance in instances:
        group = [
            recording
            for recording in acting
            if instance.channels is None or recording.name in instance.channels
        ]
        candidates += _grid(case, shear, effect, instance, instance.channels, group)
    known = {name for active in instances for name in active.channels or [r.name for r in acting]}
    for rig in _rigs(effect, acting):
        own = rig or [recording.name for recording in acting]
        if not effect.differs_from_law(own, everywhere, model.fixed):
            continue
        if not instances or (rig is not None and not known & set(rig)):
            group = [recording for recording in acting if rig is None or recording.name in rig]
            candidates += _grid(case, shear, effect, None, rig, group)
    if candidates or instances:
        return candidates, "" if candidates else "it is in the model already"
    return [], "the law, which is identified from the same recordings, can reproduce its influence"


def incompatibility(case: Case, names: Sequence[str]) -> str:
    """Return why the specimen cannot have these effects together; empty if it can."""
    known = list(dict.fromkeys(map(effect_name, names)))
    for name in known:
        others = [other for other in known if other != name]
        for reason, _ in reasons_against(effects()[name], case.geometry, others):
            return f"{name}: {reason}"
    return ""


def _rigs(effect: Effect, acting: Sequence[Recording]) -> list[tuple[str, ...] | None]:
    """Return the groups of channels that share one instance of the effect; None = all on which it acts.

    Offsets, stops and free play belong to the rig of one mode: another one has another fixture and load cell, and so
    has a dynamic rig. All modes may share a load frame and a logger, or one of them have its own. An effect that needs
    time is tried on the channels that have time.
    """
    timed = [recording for recording in acting if recording.has_time]
    only_timed = effect.needs_time and 0 < len(timed) < len(acting)
    tried = timed if only_timed else acting
    rigs = dict.fromkeys((recording.mode, recording.kind) for recording in tried)
    shared = tuple(recording.name for recording in timed) if only_timed else None
    if len(rigs) < 2 or not effect.of_rig:
        return [shared]
    own: list[tuple[str, ...] | None] = [
        tuple(recording.name for recording in tried if (recording.mode, recording.kind) == rig)
        for rig in rigs
    ]
    # One that some channels share would have the name of its first channel's own one.
    return [None, *own] if effect.may_be_shared and not only_timed else own


def _grid(
    case: Case,
    shear: float,
    effect: Effect,
    present: ActiveEffect | None,
    rig: tuple[str, ...] | None,
    recordings: Sequence[Recording],
) -> list[Candidate]:
    """Return the points of the grid on some channels; none if the model already has the whole effect there."""
    moved = [
        {MOTIONS[recording.six.number]} if recording.six else modes()[recording.mode].motions
        for recording in recordings
    ]
    chosen = _parameters(effect, present, frozenset().union(*moved))
    scales = scales_of(case, shear, recordings)
    amplitudes = [p for p in chosen if p.off is not None]
    shapes = [p for p in chosen if p.off is None]
    if not amplitudes:
        return []
    along_path = all(recording.kind == "static" for recording in recordings)
    variants = [[], *([p] for p in effect.variants if present is None and (along_path or not p.along_path))]
    before = {} if present is None else dict(present.values)
    sizes_of = {"shear": shear, "duration": scales["duration"], "amplitude": scales["travel"]}

    def values(parameter: EffectParameter) -> list[float]:
        if parameter.choices:
            words = parameter.distinct_choices(case.geometry, [recording.mode for recording in recordings])
            return [float(parameter.choices.index(word)) for word in words]
        if parameter.unit == "degC":
            return [float(np.mean(warm))]
        if not parameter.scan:
            return [parameter.start if parameter.prior is None else parameter.prior.median(scales)]
        grid = _times(parameter, recordings) if parameter.scale == "duration" else parameter.grid(sizes_of)
        same = [] if present is None else [p.name for p in effect.parameters if p.stem == parameter.stem]
        others = [before[name] for name in same if before.get(name, 0.0) > 0.0]
        # A new branch near one that the effect has already would duplicate it.
        return [v for v in grid if not any(0.5 < v / other < 2.0 for other in others)]

    degrees = temperatures(case, recordings) if effect.needs_temperature else {}
    warm = np.concatenate([*degrees.values(), np.zeros(0)])
    at = {name: float(np.mean(own)) for name, own in degrees.items()}
    points = [
        dict(zip((p.name for p in scanned), point, strict=True))
        for scanned in ([*shapes, *variant] for variant in variants)
        for point in product(*map(values, scanned))
    ]
    candidates = []
    for shape in points:
        off = {p.name: float(p.off or 0.0) for p in amplitudes}
        active = ActiveEffect(
            effect, before | off | shape, rig, "" if present is None else rig_of(present.name), at
        )
        used = [p for p in amplitudes if p in active.parameters]
        unit = scales["travel"] if used[0].scale else scales["thickness"]
        sizes: list[float | None] = [share * unit for share in used[0].sizes]
        by = tuple(p.name for p in used)
        candidates += [Candidate(active, by, shape, size) for size in sizes or [None]]
    return candidates


def temperatures(case: Case, recordings: Sequence[Recording]) -> dict[str, Array]:
    """Return the temperatures of each recording, degrees C, nan where they are not known.

    Parameters
    ----------
    case : Case
    recordings : sequence of Recording
    """
    of_case = np.nan if case.temperature is None else case.temperature
    given = {source.label: source.temperature for source in case.recordings}
    sources = {name: value for name, value in given.items() if value is not None}
    degrees = {}
    for recording in recordings:
        own = recording.temperature
        if isinstance(recording, RecordedTable):
            own = np.where(np.isnan(recording.table.temperature), of_case, recording.table.temperature)
        elif own is None:
            own = np.array([sources.get(recording.name, of_case)])
        degrees[recording.name] = own
    return degrees


def _times(parameter: EffectParameter, recordings: Sequence[Recording]) -> list[float]:
    """Return the times of a grid: shares of the durations of paths, and as many as tables resolve."""
    times: list[float] = []
    paths = [recording for recording in recordings if recording.kind == "static" and recording.has_time]
    longest = max((recording.span[1] for recording in paths), default=0.0)
    if longest:
        times += parameter.grid({"duration": longest})
    for fast, slow in (recording.times for recording in recordings if isinstance(recording, RecordedTable)):
        own = np.geomspace(fast, slow, max(2, round(DECADE * np.log10(slow / fast)) + 1))
        times += [float(v) for v in own if all(abs(np.log(v / other)) > np.log(2.0) for other in times)]
    return sorted(times)


def _parameters(
    effect: Effect, present: ActiveEffect | None, motions: Collection[str]
) -> tuple[EffectParameter, ...]:
    """Parameters of the effect that the model does not have: all but optional ones, or those of one branch more.

    Optional ones that change the reactions to the recorded `motions` to first order come with the effect.
    """
    if present is None:
        return tuple(p for p in effect.parameters if not p.optional or p.motions & set(motions))
    missing = [p for p in effect.parameters if p.is_of_branch and p.name not in present.values]
    return tuple(p for p in missing if p.branch == missing[0].branch)


def shear_modulus(model: Model, case: Case) -> float:
    """Initial shear modulus of a model's law, MPa."""
    return float(model.task(case).law.shear_modulus(**model.start))


# -- derivatives ---------------------------------------------------------------------------------------------------


def columns(
    cache: ModelCache, case: Case, base: Model, candidates: Sequence[Candidate], known: Collection[str] = ()
) -> tuple[Array, ...]:
    """Derivative of each channel's force by k amplitudes, (points, n, k) each; NaN where it cannot be solved.

    `base` has its best-fitting values. The candidates are one effect at points of its grid that differ in parameters of
    one body: one task, because what they share is then solved once. Channels whose names are `known` are not solved:
    their derivatives are zero.
    """
    points = [_columns(cache, case, base, candidate, known) for candidate in candidates]
    return tuple(np.array(channel) for channel in zip(*points, strict=True))


def _columns(
    cache: ModelCache, case: Case, base: Model, trial: Candidate, known: Collection[str]
) -> list[Array]:
    """Derivatives of each channel's force by the amplitudes of one candidate, (n, k) each."""
    model = replace(base, effects=(*effects_beside(case, base, trial), trial.active))
    # If the model has the same effect in another rig, this one may have another name there.
    added = next(active for active in model.effects if active.identity == trial.active.identity)
    names = [f"{added.name}.{name}" for name in trial.amplitudes]
    # The default mesh for effects of the assembly, but not for a CAD part, where it costs ten times as much.
    usual = trial.effect.acts == "assembly" and (case.geometry.structured or case.geometry.axisymmetric)
    coarse: Coarse = "memory" if usual else "always"
    channels = cache.channels(model.task(case), HALF, coarse, tolerance=ESTIMATED)
    slopes: list[Array] = [np.zeros((len(channel.recording.force), len(names))) for channel in channels]
    points, law = (model.values, _with_own_shape(model, case).values), () if base.fixed else tuple(base.start)
    for i, channel in enumerate(channels):
        recording = channel.recording
        acts = trial.active.acts_on(recording.name, recording.mode, recording.kind)
        if not acts or recording.name in known:
            continue
        for values in points:
            with suppress(NotConverged, NoEquilibrium):
                slopes[i] = _derivative(channel, values, names, trial, case, law)
                break
        else:
            return [np.full_like(slope, np.nan) for slope in slopes]
    return slopes


def _with_own_shape(model: Model, case: Case) -> Model:
    """The model with the law's own start values, scaled to the stiffness of the fitted ones.

    If the fitted parameters imitate an effect that is missing, the bushing may be unsolvable once the effect is added.
    Derivatives beside other parameters are a fair first estimate, too.
    """
    chosen = model.task(case).law
    own = {p.name: p.start for p in chosen.parameters if p.name in model.start}
    factor = shear_modulus(model, case) / float(chosen.shear_modulus(**own))
    scaled = {name: value * factor if name in chosen.linear else value for name, value in own.items()}
    return replace(model, start=scaled)


def effects_beside(case: Case, model: Model, trial: Candidate) -> tuple[ActiveEffect, ...]:
    """Return the effects of the model that stay active while an effect is tried.

    An effect in the bushing is tried without the other effects in the bushing, so that its derivatives can be reused
    for all models that differ in these (`derivatives`), and beside those of the rig that move the bushing otherwise or
    log its force late. One that only scales the force, or adds to it, changes the derivatives by no more than that
    factor, and so does any of a dynamic rig alone, about one preload. Effects of the rig, one branch more of an effect,
    and the temperature, which changes what others do, are tried beside all effects of the model.
    """
    others = tuple(active for active in model.effects if active.identity != trial.active.identity)
    if trial.effect.acts == "rig" or len(others) < len(model.effects) or trial.effect.needs_temperature:
        return others
    tables = {table.label for table in case.dynamic}
    return tuple(
        active
        for active in others
        if active.effect.acts == "rig" and active.effect.rig and active.effect.rig.moves
        if active.channels is None or not tables.issuperset(active.channels)
    )


def _derivative(
    channel: AnyChannel,
    values: Mapping[str, float],
    names: Sequence[str],
    trial: Candidate,
    case: Case,
    law: Sequence[str],
) -> Array:
    """Return the derivative at the off value, or a difference over a finite size where that derivative vanishes.

    A rig that moves the bushing to another part of its curve changes what the law's parameters `law` do: the difference
    is that with the parameters that fit the channel best there. A resonance changes a stiffness with the square of its
    period.
    """

    def solved(at: Mapping[str, float], by: Sequence[str]) -> tuple[Array, Array]:
        return channel.at_samples(channel.solve(at, by, StepLimit(FAILED_STEPS)))

    if trial.size is not None and trial.effect.acts == "rig":
        at = {**values, names[0]: values[names[0]] + trial.size}
        force, slope = solved(values, [*names[1:], *law])
        moved, by_law = solved(at, law)
        weight = 1.0 / channel.scale
        scaled = np.array([values[name] for name in law])
        step = np.linalg.lstsq(
            by_law * np.outer(weight, scaled), weight * (channel.measured - moved), rcond=None
        )[0]
        further = (by_law - slope[:, len(names) - 1 :]) @ (scaled * step)
        return np.column_stack([(moved - force + further) / trial.size, slope[:, : len(names) - 1]])
    if trial.size is not None:
        # The derivative by the first amplitude is not computed: in three dimensions it costs more than the force.
        force, slope = solved(values, names[1:])
        moved, _ = solved({**values, names[0]: values[names[0]] + trial.size}, ())
        return np.column_stack([(moved - force) / trial.size, slope])
    force, slope = solved(values, names)
    recording = channel.recording
    if trial.effect.acts in ("rig", "rubber") and (recording.kind == "static" or slope.any()):
        return slope
    period = recording.span[0] / SAMPLED if recording.kind == "dynamic" else None
    for i, name in enumerate(names):
        size = trial.effect.parameter(trial.amplitudes[i]).fit_range(case.geometry, period)[0]
        if float(np.abs(slope[:, i]).max()) * size > FLAT * float(np.ptp(force)):
            continue
        moved, _ = solved({**values, name: values[name] + size}, ())
        secant = (moved - force) / size
        if float(np.abs(secant).max()) > float(np.abs(slope[:, i]).max()):
            slope = slope.copy()
            slope[:, i] = secant
    return slope
