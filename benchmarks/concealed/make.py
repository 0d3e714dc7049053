"""Make recordings: draw, size the effect by what it shows, compute with the finer model, add noise, write.

Nothing in a case depends on the kind of recording: names, files and keys are those of any user. Only some cases have
coupon tests, to which the law is then fixed.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed import draw, programs, refit
from benchmarks.concealed.simulate import Channel, force
from benchmarks.concealed.sizes import SIZES, Situation, effect_of_size
from benchmarks.concealed.strength import apart, beside_a_factor, strength
from benchmarks.concealed.truth import FAINT, LARGEST, Specimen, Truth, write_truth
from bushcli.curve.curve import Curve
from bushcli.curve.segment import excursions
from bushcli.effects.active import ActiveEffect, effects_on_channel
from bushcli.effects.effect import effect
from bushcli.effects.rig import NoEquilibrium
from bushcli.recording import write_curve_csv
from cases.march import NotConverged
from cases.mode import modes
from cases.stability import nominal_stress
from forms.law import law

Array = NDArray[np.float64]

# Noise of the force, percent of the recorded range.
NOISE = (0.1, 1.0)
# Noise of the displacement's transducer, as a share of the amplitude.
DISPLACEMENT_NOISE = 2e-4
# Where the default mesh is off by more standard errors than this, the noise is raised: a recording cleaner than the
# model would test the mesh, for which there is `bushcli direct --mesh-check`.
MESH = 2.0
# Standard deviation of a factor common to all forces of a channel, in the half-plane and in three dimensions: rigs of
# class 0.5 and default meshes are no better, and a change that is only such a factor is no evidence of an effect.
CALIBRATION = {False: 0.005, True: 0.01}
# Two effects whose best fits are nearer than this (standard errors) look alike: chi square differs by at most 16.
TOLD = 4.0
# Seconds of a slow leg over the amplitude.
SLOW = (30.0, 120.0)
ATTEMPTS = 12
# Size, relative to the usual one, of an effect that a poor program does not show.
HIDDEN = (0.3, 1.5)
# First cycle with another stiffness, for the effect that is not in the catalogue.
STEP_CYCLE = 4
COUPONS = {"uniaxial": 2.2, "planar": 2.0, "equibiaxial": 1.7}
COUPON_NOISE = 0.1


class Unsuitable(Exception):
    """The drawn effect cannot be seen, or cannot be computed."""


@dataclass(frozen=True)
class Bench:
    """A specimen with its programs, and the plain model's answers to them.

    Attributes
    ----------
    specimen : Specimen
    channels : tuple of Channel
    plain, fine : tuple of (n,) arrays
        Plain force by the default mesh and by the finer one.
    sigma : tuple of float
        Noise of the force, by channel.
    slopes : tuple of (n, parameters) arrays
        Derivatives by the law's parameters; no columns where coupons hold the law.
    fast : float
        Seconds of the fastest leg over the amplitude, first channel.
    """

    specimen: Specimen
    channels: tuple[Channel, ...]
    plain: tuple[Array, ...]
    fine: tuple[Array, ...]
    sigma: tuple[float, ...]
    slopes: tuple[Array, ...]
    fast: float

    def weigh(self, values: Sequence[Array]) -> Array:
        """All channels' values over their noise, concatenated, with the uncertain calibration factor weighted down."""
        rows = [
            beside_a_factor(v / s, plain / s, CALIBRATION[modes()[c.name].section is None])
            for v, plain, s, c in zip(values, self.plain, self.sigma, self.channels, strict=True)
        ]
        return np.concatenate(rows)

    def over_noise(self, values: Sequence[Array]) -> Array:
        """All channels' values over their noise, concatenated."""
        return np.concatenate([v / s for v, s in zip(values, self.sigma, strict=True)])

    @property
    def law_changes(self) -> list[Array]:
        """Changes that the law's parameters can make."""
        return [self.weigh(self.slopes)]

    @property
    def mesh(self) -> float:
        """Error of the default mesh in standard errors."""
        off = [b - a for a, b in zip(self.plain, self.fine, strict=True)]
        return strength(self.over_noise(off), [self.over_noise(self.slopes)])

    def change(self, active: Sequence[ActiveEffect]) -> Array:
        """Weighed change of the forces by effects, on the default mesh."""
        moved = [force(self.specimen, c, active, finer=False)[0] for c in self.channels]
        return self.weigh([b - a for a, b in zip(self.plain, moved, strict=True)])

    def without(self, active: Sequence[ActiveEffect], gone: ActiveEffect) -> float:
        """Standard errors that remain when the law and all effects but one are refitted to curves with all effects."""
        others = [other for other in active if other is not gone]
        names = () if self.slopes[0].shape[1] == 0 else tuple(self.specimen.parameters)
        free = [(other, p) for other in others for p in other.effect.parameters if p.name in other.values]
        whole = (*names, *(other.full_name(p) for other, p in free))
        target = self.change(active)
        if not whole:
            return float(np.linalg.norm(target - (self.change(others) if others else 0.0)))

        def curves(x: Array) -> tuple[Array, Array]:
            values, slopes = [], []
            given = dict(zip(whole, map(float, x), strict=True))
            for c, plain in zip(self.channels, self.plain, strict=True):
                here = {other.name for other in effects_on_channel(others, c.name, c.name)}
                own = [n for n in whole if "." not in n or n.partition(".")[0] in here]
                value, slope = force(self.specimen, c, others, finer=False, values=given, names=own)
                values.append(value - plain)
                slopes.append(np.zeros((len(value), len(whole))))
                slopes[-1][:, [whole.index(n) for n in own]] = slope
            return self.weigh(values), self.weigh(slopes)

        return refit.remaining_misfit(
            curves,
            target,
            np.array(
                [*map(self.specimen.parameters.__getitem__, names), *(o.values[p.name] for o, p in free)]
            ),
            np.array([*[-np.inf] * len(names), *(p.lower for _, p in free)]),
            np.array([*[np.inf] * len(names), *(p.upper for _, p in free)]),
        )

    def situation(self, name: str) -> Situation:
        """The quantities on which usual values of an effect depend."""
        shape = self.specimen.dimensions
        acting = [i for i, c in enumerate(self.channels) if effect(name).acts_on(c.name)]
        first = self.channels[acting[0]]
        amplitude, thickness = (
            self.specimen.amplitude[first.name],
            shape["outer_radius"] - shape["inner_radius"],
        )
        straight = [
            float(np.abs(f).max()) / self.specimen.amplitude[c.name]
            for c, f in zip(self.channels, self.plain, strict=True)
            if c.name != "torsional"
        ]
        strain = max(
            self.specimen.amplitude[c.name] * (_turn(shape) if c.name == "torsional" else 1 / thickness)
            for c in self.channels
        )
        return Situation(
            thickness=thickness,
            length=shape.get("length", shape.get("inner_length", 0.0)),
            amplitude=amplitude,
            force=float(np.abs(self.plain[acting[0]]).max()),
            stiffness=max(straight, default=1.0),
            duration=float(first.time[-1]),
            fast=self.fast,
            shear=float(law(self.specimen.law).shear_modulus(**self.specimen.parameters)),
            strain=strain,
        )


def _turn(shape: Mapping[str, float]) -> float:
    """Shear strain at the inner bond per radian of torsion."""
    a, b = shape["inner_radius"], shape["outer_radius"]
    return 2 * b**2 / (b**2 - a**2)


def make(seed: int, folder: Path) -> Truth:
    """Make the recording of a seed, if it does not exist yet.

    Raises
    ------
    Unsuitable
        No attempt could be computed and seen.
    """
    plan = draw.draw_concealed(seed)
    begin, given_up = time.perf_counter(), []
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([seed, 3, attempt])
        try:
            bench = _bench(rng, plan)
            truth, forces = _conceal(rng, plan, bench)
        except (NotConverged, NoEquilibrium, Unsuitable) as failure:
            given_up.append(f"{type(failure).__name__}: {failure}")
            continue
        truth = replace(truth, seed=seed, attempt=attempt, given_up=tuple(given_up))
        noise = _write(rng, folder, truth, bench, forces)
        truth = replace(truth, noise=noise, seconds=round(time.perf_counter() - begin, 1))
        (folder / "truth").mkdir(parents=True, exist_ok=True)
        write_truth(truth, folder / "truth" / f"{truth.name}.json")
        return truth
    raise Unsuitable(f"seed {seed}: " + "; ".join(given_up))


def _bench(rng: np.random.Generator, plan: draw.Concealed) -> Bench:
    specimen = draw.specimen(rng, plan.channels)
    slow = float(rng.uniform(*SLOW))
    channels, fast = [], slow
    for i, name in enumerate(plan.channels):
        kind = plan.program if i == 0 else "short"
        legs = programs.PROGRAMS[kind](rng)
        if i == 0:
            fast = slow / max(leg.pace for leg in legs)
        t, q = programs.path(legs, specimen.amplitude[name], slow, programs.SAMPLES[kind])
        channels.append(Channel(name, t, q))
    names = () if plan.coupons else tuple(specimen.parameters)
    answers = [force(specimen, c, finer=False, names=names) for c in channels]
    fine = tuple(force(specimen, c, finer=True)[0] for c in channels)
    level = float(np.exp(rng.uniform(*np.log(NOISE))))
    shares = level / 100 * rng.uniform(0.7, 1.4, len(channels))
    sigma = tuple(float(s * np.ptp(f)) for s, f in zip(shares, fine, strict=True))
    plain, slopes = tuple(a[0] for a in answers), tuple(a[1] for a in answers)
    bench = Bench(specimen, tuple(channels), plain, fine, sigma, slopes, fast)
    if bench.mesh > MESH:
        bench = replace(bench, sigma=tuple(s * bench.mesh / MESH for s in sigma))
    return bench


def _conceal(rng: np.random.Generator, plan: draw.Concealed, bench: Bench) -> tuple[Truth, list[Array]]:
    """Draw the truth, except for values known only when it is written, and the noise-free forces of the finer model."""
    truth = Truth(
        seed=0,
        attempt=0,
        kind=plan.kind,
        program=plan.program,
        coupons=plan.coupons,
        specimen=bench.specimen,
        effects={},
        strength={},
        look_alikes=(),
        mesh=bench.mesh,
        noise={},
    )
    if plan.kind == "none":
        return truth, list(bench.fine)
    if plan.kind == "outside":
        return _step(rng, truth, bench)
    hidden = plan.program != "rich"
    active: list[ActiveEffect] = []
    changes: list[Array] = []
    for name in plan.names:
        effect, change = _large_enough(rng, name, bench, [*bench.law_changes, *changes], hidden)
        active.append(effect)
        changes.append(change)
    strengths = {}
    for i, effect in enumerate(active):
        others = [c for k, c in enumerate(changes) if k != i]
        shown = (
            strength(changes[i], [*bench.law_changes, *others]) if hidden else bench.without(active, effect)
        )
        strengths[effect.name] = round(shown, 2)
        if shown < FAINT and not hidden:
            raise Unsuitable(f"{effect.name} shows by {shown:.1f} standard errors only")
    alike = _look_alikes(rng, active[0], changes[0], bench) if plan.kind == "single" else ()
    forces = [force(bench.specimen, c, active, finer=True)[0] for c in bench.channels]
    values = {effect.name: dict(effect.values) for effect in active}
    return replace(truth, effects=values, strength=strengths, look_alikes=alike), forces


def _large_enough(
    rng: np.random.Generator, name: str, bench: Bench, taken: Sequence[Array], hidden: bool
) -> tuple[ActiveEffect, Array]:
    """Return an effect of the drawn strength, as far as its range allows, and the change of the forces by it.

    Where not even the largest size can be seen, the effect gets a usual size, if it may be hidden.

    Raises
    ------
    Unsuitable
        Not even the largest can be seen, and it may not be hidden.
    """
    sizes = SIZES[name]
    values = sizes.values(rng, bench.situation(name))
    wanted = float(np.exp(rng.uniform(np.log(1.1 * FAINT), np.log(LARGEST))))
    size, shown = 1.0, 0.0
    change: Array = np.zeros(0)
    # The strength need not be met exactly: most effects are nearly linear, and one correction is enough.
    for _ in range(3):
        change = bench.change([effect_of_size(name, values, size)])
        shown = strength(change, taken)
        best = float(np.clip(size * wanted / max(shown, 1e-9), sizes.least, sizes.most))
        if abs(np.log(best / size)) < 0.7:
            break
        size = best
    else:
        change = bench.change([effect_of_size(name, values, size)])
        shown = strength(change, taken)
    if shown >= FAINT:
        return effect_of_size(name, values, size), change
    if not hidden:
        raise Unsuitable(f"{name} shows by {shown:.1f} standard errors only")
    size = float(np.exp(rng.uniform(*np.log(HIDDEN))))
    return effect_of_size(name, values, size), bench.change([effect_of_size(name, values, size)])


def _look_alikes(
    rng: np.random.Generator, concealed: ActiveEffect, change: Array, bench: Bench
) -> tuple[str, ...]:
    """Other effects that cannot be distinguished from the concealed one, with usual values of shape parameters.

    Effects with memory are left out in three dimensions, where they cost too much; this only makes the score stricter.
    """
    names = [c.name for c in bench.channels]
    alike = ["nothing"] if strength(change, bench.law_changes) < FAINT else []
    for name in draw.CONCEALED:
        other = effect(name)
        memory = name in draw.MEMORY
        held = bench.slopes[0].shape[1] == 0
        if name == concealed.name or (name == "batch_stiffness" and not held):
            continue
        if not any(other.acts_on(n) for n in names) or (memory and "radial" in names):
            continue
        size = 0.3
        try:
            there = bench.change([effect_of_size(name, SIZES[name].values(rng, bench.situation(name)), size)])
        except (NotConverged, NoEquilibrium):
            continue
        one_sided = all(p.off == p.lower for p in other.amplitudes)
        if apart(change, there, bench.law_changes, one_sided) < TOLD:
            alike.append(name)
    return tuple(alike)


def _step(rng: np.random.Generator, truth: Truth, bench: Bench) -> tuple[Truth, list[Array]]:
    """Conceal a stiffness that falls once, after the third cycle, which is not an effect of the catalogue."""
    channel, plain = bench.channels[0], bench.fine[0]
    begin = next(b.start for b in excursions(channel.displacement, channel.time) if b.cycle >= STEP_CYCLE)
    after = np.where(np.arange(len(plain)) >= begin, 1.0, 0.0)
    usual = strength(bench.weigh([-0.1 * after * bench.plain[0]]), bench.law_changes)
    wanted = float(np.exp(rng.uniform(np.log(2 * FAINT), np.log(LARGEST))))
    loss = float(np.clip(0.1 * wanted / usual, 0.02, 0.4))
    shown = usual * loss / 0.1
    if shown < FAINT:
        raise Unsuitable(f"the step shows by {shown:.1f} standard errors only")
    step = {"cycle": float(STEP_CYCLE), "factor": round(1.0 - loss, 4)}
    forces: list[Array] = [plain * (1.0 - after * (1.0 - step["factor"]))]
    return replace(truth, strength={"stiffness_step": round(shown, 2)}, step=step), forces


# -- files -------------------------------------------------------------------------------------------------------


def _write(
    rng: np.random.Generator, folder: Path, truth: Truth, bench: Bench, forces: Sequence[Array]
) -> dict[str, float]:
    """Write the files that a user would have; return the noise of each channel, percent of the recorded range."""
    case = folder / "cases" / truth.name
    part = case.with_suffix(f".{os.getpid()}")
    part.mkdir(parents=True, exist_ok=True)
    specimen, noise = truth.specimen, {}
    text = [f'title = "bushing {truth.name}"', "", "[geometry]", f'shape = "{specimen.shape}"']
    text += [f"{key} = {value:g}" for key, value in specimen.dimensions.items()]
    text += ["", "[material]", f'law = "{specimen.law}"', f"bulk_modulus = {specimen.bulk_modulus:g}"]
    if specimen.law == "ogden":
        text.append("terms = 2")
    for channel, exact, sigma in zip(bench.channels, forces, bench.sigma, strict=True):
        measured = exact + sigma * rng.standard_normal(len(exact))
        spread = DISPLACEMENT_NOISE * specimen.amplitude[channel.name]
        q = channel.displacement + spread * rng.standard_normal(len(exact))
        write_curve_csv(part / f"{channel.name}.csv", Curve(channel.name, q, measured, channel.time))
        noise[channel.name] = round(100 * sigma / float(np.ptp(measured)), 4)
        text += ["", "[[recordings]]", f'mode = "{channel.name}"', f'file = "{channel.name}.csv"']
    if truth.coupons:
        for mode, largest in COUPONS.items():
            stretch = np.linspace(1.0, largest, 31)[1:]
            stress = nominal_stress(law(specimen.law), specimen.parameters, mode, stretch)
            stress = stress + COUPON_NOISE / 100 * stress.max() * rng.standard_normal(len(stress))
            write_curve_csv(part / f"{mode}.csv", Curve(mode, stretch - 1.0, stress))
            text += ["", "[[coupons]]", f'mode = "{mode}"', f'file = "{mode}.csv"']
    (part / "case.toml").write_text("\n".join(text) + "\n", encoding="utf-8")
    if case.exists():
        shutil.rmtree(case)
    part.rename(case)
    return noise
