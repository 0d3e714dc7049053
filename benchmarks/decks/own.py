"""The own deck: the catalogue's formulas, by third-order elements on another mesh, with other steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.make import MESH, Bench
from benchmarks.concealed.simulate import force
from benchmarks.concealed.sizes import SIZES, effect_of_size
from benchmarks.concealed.strength import rest_beside, strength
from benchmarks.decks.drawing import CALIBRATION, Unsuitable, channel, channel_programs, sensors, specimen
from benchmarks.decks.manifest import Entry
from benchmarks.decks.plan import Card
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect, effects
from bushcli.effects.rig import NoEquilibrium
from cases.march import NotConverged
from cases.mode import modes

Array = NDArray[np.float64]

# Percent of the force range (rms) beyond what law and calibration can imitate.
SHARE = (0.5, 15.0)
# Below this strength a rich program is drawn again; largest number of attempts.
SEEN, ATTEMPTS = 4.0, 8
# Laws beside effects in the finite-element model, each of which is compiled once per effect and mode; not Ogden's.
LAWS = ("yeoh", "mooney_rivlin", "gent")


def draw_recording(card: Card) -> Entry:
    """Draw a recording.

    Raises
    ------
    Unsuitable
    """
    reasons = []
    for attempt in range(ATTEMPTS):
        seed = (*card.seed, attempt)
        try:
            return _attempt(card, seed)
        except (Unsuitable, NotConverged, NoEquilibrium) as failure:
            reasons.append(f"{type(failure).__name__}: {failure}")
    raise Unsuitable("; ".join(reasons))


def _attempt(card: Card, seed: tuple[int, ...]) -> Entry:
    rng = np.random.default_rng(seed)
    rig = all(effects()[name].acts == "rig" for name in card.names)
    body = specimen(rng, card.channels, () if rig else LAWS)
    programs, fast = channel_programs(rng, card.program, card.channels)
    felt = sensors(rng, seed, card.channels)
    wanted = float(np.exp(rng.uniform(*np.log(SHARE))))
    channels = tuple(channel(p, body) for p in programs)
    names = () if card.coupons else tuple(body.parameters)
    answers = [force(body, c, finer=False, names=names) for c in channels]
    fine = tuple(force(body, c, finer=True)[0] for c in channels)
    sigma = tuple(s.noise / 100 * float(np.ptp(f)) for s, f in zip(felt, fine, strict=True))
    bench = Bench(
        body, channels, tuple(a[0] for a in answers), fine, sigma, tuple(a[1] for a in answers), fast
    )
    if bench.mesh > MESH:
        factor = bench.mesh / MESH
        felt = tuple(replace(s, noise=round(min(s.noise * factor, 2.0), 4)) for s in felt)
        bench = replace(bench, sigma=tuple(s * factor for s in sigma))
    entry = Entry(
        name="",
        part="own",
        kind=card.kind,
        program=card.program,
        seed=seed,
        specimen=body,
        programs=programs,
        sensors=felt,
        coupons=card.coupons,
        mesh=round(bench.mesh, 2),
    )
    active: list[ActiveEffect] = []
    changes: list[Array] = []
    for name in card.names:
        effect, change = _effect_of_share(rng, name, bench, wanted)
        active.append(effect)
        changes.append(change)
    shown = {}
    for i, effect in enumerate(active):
        others = [c for k, c in enumerate(changes) if k != i]
        shown[effect.name] = round(strength(changes[i], [*bench.law_changes, *others]), 2)
        if card.program == "rich" and shown[effect.name] < SEEN:
            raise Unsuitable(f"{effect.name} shows by {shown[effect.name]:.1f} standard errors")
    whole = bench.change(active) if len(active) > 1 else changes[0] if active else np.zeros(1)
    return replace(
        entry,
        effects={effect.name: {k: float(f"{v:.6g}") for k, v in effect.values.items()} for effect in active},
        truth=tuple(sorted(effect.name for effect in active)),
        strength=shown,
        share=round(share(bench, whole), 3) if active else 0.0,
    )


def share(bench: Bench, change: Array) -> float:
    """Percent of the range (rms) of a weighed change that law and calibration factors cannot imitate."""
    rest = rest_beside(change, bench.law_changes)
    scale = np.concatenate(
        [np.full(len(f), s / float(np.ptp(f))) for s, f in zip(bench.sigma, bench.fine, strict=True)]
    )
    return 100 * float(np.sqrt(np.mean((rest * scale) ** 2)))


def _effect_of_share(
    rng: np.random.Generator, name: str, bench: Bench, wanted: float
) -> tuple[ActiveEffect, Array]:
    """Return an effect that changes the curves by the wanted share, as far as its usual range allows."""
    sizes = SIZES[name]
    values = sizes.values(rng, bench.situation(name))
    size = 1.0
    effect = effect_of_size(name, values, size)
    change = bench.change([effect])
    for _ in range(2):
        current = share(bench, change)
        best = float(np.clip(size * wanted / max(current, 1e-9), sizes.least, sizes.most))
        if abs(np.log(best / size)) < 0.15:
            break
        size = best
        effect = effect_of_size(name, values, size)
        change = bench.change([effect])
    return effect, change


def forces(entry: Entry, exact: bool = True) -> tuple[list[Array], list[Array]]:
    """Noise-free forces of the channels with the effects and without them, by the finer model."""
    active = [ActiveEffect(effect(name), values) for name, values in entry.effects.items()]
    channels = [channel(p, entry.specimen) for p in entry.programs]
    with_ = [force(entry.specimen, c, active, finer=exact)[0] for c in channels]
    without = [force(entry.specimen, c, finer=exact)[0] for c in channels]
    return with_, without


def solid(mode: str) -> bool:
    """Whether a channel is computed in three dimensions."""
    return modes()[mode].section is None


__all__ = ["CALIBRATION", "draw_recording", "forces", "share", "solid"]
