"""Find a recording's look-alikes, other single effects that it cannot distinguish, and write them into the manifest.

For each effect the change of the curves is computed at a usual size over the grid of its shape parameters (`scan` in
its file), and multiplied by the amplitudes that come nearest to the concealed change; the law's parameters are
refitted, and the calibration factors are free within their uncertainty, all to first order. An effect that then differs
by less than four standard errors, or a fifth of the concealed change, is a look-alike. Effects with memory are left out
in radial channels, where they cost too much.

The other effects' changes are computed with the Yeoh law nearest to the recording's law, since each law is compiled
once per effect and mode, which takes minutes. The refitted law is the recording's. The grid and the list of effects are
those of the day on which the deck is judged; the manifest keeps the result.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from benchmarks.concealed.draw import MEMORY
from benchmarks.concealed.make import Bench
from benchmarks.concealed.simulate import force
from benchmarks.concealed.sizes import SIZES, effect_of_size
from benchmarks.concealed.strength import rest_beside
from benchmarks.concealed.truth import Specimen
from benchmarks.decks import manifest
from benchmarks.decks.drawing import channels_of
from benchmarks.decks.manifest import Entry
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import Effect, EffectParameter, effects_on
from bushcli.effects.rig import NoEquilibrium
from cases.march import NotConverged
from cases.stability import nominal_stress
from forms.law import law

Array = NDArray[np.float64]

# Standard errors, and share of the concealed change, within which another effect looks alike.
TOLD, FORM = 4.0, 0.2
# Size relative to the usual one; effects that are nonlinear in their amplitude are tried at a smaller size, too.
SIZE, SMALLER = 1.0, 0.3
BENT = ("debonding", "misalignment")
# Of grids with more points than this only every second one is used: the nearest is within 10 % of the travel.
DENSE = 12
# Largest local stretch in these bushings, up to which laws are compared.
STRETCH = 1.7


def judge_all(deck: str, folder: Path) -> Iterator[str]:
    """Judge the recordings with a rich program and an effect that have not been judged yet; yield a line for each."""
    for name, entry in manifest.read(deck).items():
        file = folder / "truth" / f"{name}.npz"
        if entry.look_alikes is not None or not entry.rich or not entry.truth or entry.outside:
            continue
        if not file.exists():
            yield f"{name}: not made"
            continue
        begin = time.perf_counter()
        alike = look_alikes(entry, dict(np.load(file)))
        manifest.put(deck, replace(manifest.read(deck)[name], look_alikes=alike))
        yield f"{name}: {time.perf_counter() - begin:.0f} s"


def look_alikes(entry: Entry, made: Mapping[str, Array]) -> tuple[str, ...]:
    """Names of a recording's look-alikes, from its noise-free forces."""
    bench = _bench(entry, made)
    near = (
        bench if entry.specimen.law == "yeoh" else _bench(replace(entry, specimen=yeoh(entry.specimen)), made)
    )
    changes = [made[f"exact_{c}"] - made[f"plain_{c}"] for c in entry.channels]
    d = rest_beside(bench.weigh(changes), bench.law_changes)
    within = max(TOLD, FORM * float(np.linalg.norm(d)))
    alike = []
    for name, other in effects_on("static").items():
        if {name} in (set(names) for names in entry.right) or not _possible(entry, other):
            continue
        if any(_apart(d, columns, other, bench) < within for columns in _columns(entry, near, other)):
            alike.append(name)
    return tuple(alike)


def yeoh(body: Specimen) -> Specimen:
    """Return the same bushing with the Yeoh law that is nearest in pure shear."""
    stretch = np.linspace(1.02, STRETCH, 40)
    stress = nominal_stress(law(body.law), body.parameters, "planar", stretch)
    e = stretch**2 + stretch**-2 - 2
    columns = (2 * (stretch - stretch**-3))[:, None] * np.column_stack([e**0, 2 * e, 3 * e**2])
    C = np.linalg.lstsq(columns, stress, rcond=None)[0]
    return replace(body, law="yeoh", parameters=dict(zip(("C10", "C20", "C30"), map(float, C), strict=True)))


def _bench(entry: Entry, made: Mapping[str, Array]) -> Bench:
    channels = tuple(channels_of(entry))
    names = () if entry.coupons else tuple(entry.specimen.parameters)
    answers = [force(entry.specimen, c, finer=False, names=names) for c in channels]
    exact = tuple(made[f"exact_{c}"] for c in entry.channels)
    sigma = tuple(s.noise / 100 * float(np.ptp(f)) for s, f in zip(entry.sensors, exact, strict=True))
    fast = entry.programs[0].slow / max(pace for _, pace in entry.programs[0].legs)
    return Bench(
        entry.specimen,
        channels,
        tuple(a[0] for a in answers),
        exact,
        sigma,
        tuple(a[1] for a in answers),
        fast,
    )


def _possible(entry: Entry, other: Effect) -> bool:
    if not any(other.acts_on(c) for c in entry.channels) or other.name not in SIZES:
        return False
    if other.name == "batch_stiffness" and not entry.coupons:
        return False
    return not (other.name in MEMORY and "radial" in entry.channels)


def _columns(entry: Entry, bench: Bench, other: Effect) -> Iterator[Array]:
    """Changes (n, amplitudes) by an effect, one matrix for each size and each point of the grid."""
    rng = np.random.default_rng([*entry.seed, 6])
    usual = dict(SIZES[other.name].values(rng, bench.situation(other.name)))
    rigs = [c for c in entry.channels if other.acts_on(c)] if other.of_channel else [""]
    shapes = [p for p in other.parameters if p.off is None and p.name in usual and p.scan]
    duration = float(bench.channels[0].time[-1])
    for point in itertools.product(*(p.scan[:: 2 if len(p.scan) > DENSE else 1] for p in shapes)):
        for size in (SIZE, SMALLER) if other.name in BENT else (SIZE,):
            columns = []
            for rig in rigs:
                reach = float(
                    np.abs(bench.channels[entry.channels.index(rig) if rig else 0].displacement).max()
                )
                scale = {"duration": duration, "amplitude": reach, "": 1.0}
                values = usual | {p.name: x * scale[p.scale] for p, x in zip(shapes, point, strict=True)}
                for amplitude in other.amplitudes:
                    if amplitude.name in usual:
                        active = _only(effect_of_size(other.name, values, size), amplitude)
                        columns.append(replace(active, channels=(rig,)) if rig else active)
            try:
                yield np.column_stack([bench.change([active]) for active in columns])
            except (NotConverged, NoEquilibrium):
                continue


def _only(active: ActiveEffect, amplitude: EffectParameter) -> ActiveEffect:
    """Return the effect with all other amplitudes off."""
    off = {p.name: float(p.off or 0.0) for p in active.effect.amplitudes if p.name != amplitude.name}
    return replace(active, values=dict(active.values) | {k: v for k, v in off.items() if k in active.values})


def _apart(d: Array, columns: Array, other: Effect, bench: Bench) -> float:
    """Distance (standard errors) of a change from the nearest combination of columns, not negative if one-sided."""
    G = np.column_stack([rest_beside(column, bench.law_changes) for column in columns.T])
    scale = np.maximum(np.linalg.norm(G, axis=0), 1e-12)
    G = G / scale
    if all(p.off == p.lower for p in other.amplitudes):
        return float(nnls(G, d)[1])
    return float(np.linalg.norm(d - G @ np.linalg.lstsq(G, d, rcond=1e-8)[0]))
