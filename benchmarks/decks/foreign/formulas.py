"""The foreign formulas: the values that each draws, and the force that it gives for a bushing and a program.

Sizing multiplies a formula's `amplitude`, at zero of which the physics is absent. Values that depend on the channel
(forces, displacements) are drawn as shares of the elastic bushing's largest ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from benchmarks.concealed.simulate import Channel
from benchmarks.concealed.truth import Specimen
from benchmarks.decks import elastic as third_order
from benchmarks.decks.foreign import component
from benchmarks.decks.foreign.external import ask
from benchmarks.decks.foreign.halfplane import Bond, HalfPlane, Rubber, curve, force_at_samples
from benchmarks.decks.foreign.rubbers import (
    BergstroemBoyce,
    Damage,
    DamagedSimo,
    DorfmannOgden,
    Holzapfel,
    Law,
    Simo,
)

Array = NDArray[np.float64]
Values = Mapping[str, float]
Curve = Callable[[Array], Array]

# Points on each side of rest at which a curve is solved.
POINTS, SOLID_POINTS = 12, 6
# The published constants of MORPH (Besdo and Ihlemann 2003, doi:10.1016/S0749-6419(02)00091-8).
MORPH = (0.039, 0.371, 0.174, 2.41, 0.0094, 6.84, 5.65, 0.244)


@dataclass(frozen=True)
class Situation:
    """Quantities on which usual values depend: mm, s, MPa; times are those of the first channel."""

    thickness: float
    length: float
    fast: float
    duration: float
    shear: float
    strain: float


@dataclass(frozen=True)
class Formula:
    """A formula.

    Attributes
    ----------
    truth : tuple of str
        Names of the catalogue that are physically right.
    values : callable
        ``values(rng, situation)``: all numbers, `amplitude` among them at its usual size.
    force : callable
        ``force(values, specimen, channel)``: force at the samples.
    least, most : float
        Limits of the amplitude, relative to its usual size.
    menu : tuple of tuple of str
        Sets of channels, one of which is drawn.
    also_right : tuple of tuple of str
    base : {"third_order", "halfplane", "solid", "morph"}
        Code whose elastic curve it starts from.
    """

    truth: tuple[str, ...]
    values: Callable[[np.random.Generator, Situation], dict[str, float]]
    force: Callable[[Values, Specimen, Channel], Array]
    least: float
    most: float
    menu: tuple[tuple[str, ...], ...]
    also_right: tuple[tuple[str, ...], ...] = ()
    base: str = "third_order"
    marched: bool = field(default=False)


AXIAL = (("axial",),)
FLAT = (("axial",), ("axial",), ("axial", "torsional"))
TWISTED = (("axial", "torsional"),)
SOLID = (("axial", "radial"),)


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.5g}")


def _uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(f"{rng.uniform(low, high):.5g}")


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


# -- elastic curves ----------------------------------------------------------------------------------------------


def law_of(body: Specimen, **changes: Any) -> Law:
    """The specimen's law; an infinite bulk modulus is replaced by a very large one."""
    bulk = body.bulk_modulus if np.isfinite(body.bulk_modulus) else 4000.0
    return Law(body.law, dict(body.parameters), **({"bulk": bulk} | changes))


def elastic(body: Specimen, c: Channel) -> Curve:
    """Elastic curve by third-order elements."""
    return third_order.elastic(body, c.name, float(c.displacement.min()), float(c.displacement.max()))


def span(c: Channel) -> tuple[float, float]:
    """Range of displacements with some room."""
    room = third_order.ROOM
    return room * min(float(c.displacement.min()), 0.0), room * max(float(c.displacement.max()), 0.0)


def spline_of(c: Channel, answer: Callable[[Array], Array], points: int, odd: bool) -> Curve:
    """A spline through a curve that is solved on both sides of rest, or on one where it is odd."""
    low, high = span(c)
    if odd:
        reach = max(high, -low)
        q = np.linspace(0, reach, points + 1)
        f = answer(q)
        return CubicSpline(np.concatenate([-q[:0:-1], q]), np.concatenate([-f[:0:-1], f]))
    q = np.unique(
        np.concatenate(
            [np.linspace(low, 0, points + 1) if low < 0 else [0.0], np.linspace(0, high, points + 1)]
        )
    )
    return CubicSpline(q, answer(q))


def halfplane(body: Specimen, c: Channel, **changes: Any) -> Curve:
    """Elastic curve by `HalfPlane`, with its bonds, sleeve reduction and shrinkage."""
    law = changes.pop("law", None) or law_of(body)
    model = HalfPlane(body.dimensions, c.name == "torsional", law, **changes)
    return spline_of(c, lambda q: curve(model, list(q)), POINTS, not changes or c.name == "torsional")


def solid(body: Specimen, c: Channel, odd: bool = True, **changes: Any) -> Curve:
    """Elastic curve by FElupe in three dimensions."""
    p = body.parameters
    law = law_of(body)
    task = {
        "dimensions": dict(body.dimensions),
        "yeoh": [p["C10"], p["C20"], p["C30"]],
        "bulk": law.bulk,
        **changes,
    }

    def answer(q: Array) -> Array:
        forces = np.zeros(len(q))
        for side in (np.flatnonzero(q >= 0), np.flatnonzero(q < 0)[::-1]):
            if len(side):
                forces[side] = ask("solid", task | {"targets": q[side].tolist()})
        return forces

    return spline_of(c, answer, SOLID_POINTS, odd)


def plain(formula: Formula, body: Specimen, c: Channel) -> Array:
    """Elastic force at the samples by the code that the formula starts from."""
    return np.asarray(_plain(formula.base, _Frozen(body), c.name, *span(c))(c.displacement))


class _Frozen:
    """A specimen as a key of a cache."""

    def __init__(self, body: Specimen) -> None:
        self.body = body
        self._key = repr(body)

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Frozen) and self._key == other._key


@lru_cache(maxsize=16)
def _plain(base: str, frozen: _Frozen, name: str, low: float, high: float) -> Curve:
    room = third_order.ROOM
    c = Channel(name, np.zeros(2), np.array([low / room, high / room]))
    if base == "halfplane":
        return halfplane(frozen.body, c)
    if base == "solid":
        return solid(frozen.body, c) if name == "radial" else halfplane(frozen.body, c)
    return elastic(frozen.body, c)


def elastic_force(body: Specimen, c: Channel) -> tuple[Array, float, float]:
    """Elastic force by third-order elements, its largest size and the largest displacement."""
    force = np.asarray(_plain("third_order", _Frozen(body), c.name, *span(c))(c.displacement))
    return force, float(np.abs(force).max()), float(np.abs(c.displacement).max())


# -- in the rubber -----------------------------------------------------------------------------------------------


def _marched_force(rubber: Callable[[Values, Law], Rubber]) -> Callable[[Values, Specimen, Channel], Array]:
    def force(v: Values, body: Specimen, c: Channel) -> Array:
        model = HalfPlane(body.dimensions, c.name == "torsional", rubber(v, law_of(body)))
        return force_at_samples(model, c.time, c.displacement)

    return force


def _energy(s: Situation) -> float:
    return 0.5 * s.shear * s.strain**2


def _bergstroem_boyce(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    m, time = _uniform(rng, 2.5, 5.0), s.fast * _log(rng, 1.0, 10.0)
    # At half the largest strain the dashpot then relaxes in about this time.
    return {"amplitude": 0.2, "m": m, "rate": float(f"{0.03 * (0.5 * s.strain) ** (1 - m) / time:.5g}")}


def _two_times(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    time = s.fast * _log(rng, 0.7, 8.0)
    return {
        "amplitude": 0.15,
        "tau": float(f"{time:.5g}"),
        "slower": _log(rng, 3.0, 15.0),
        "second": _uniform(rng, 0.3, 1.0),
    }


def _one_time(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.2, "tau": float(f"{s.fast * _log(rng, 0.7, 12.0):.5g}")}


def _simo(v: Values, law: Law) -> Simo:
    g, t = v["amplitude"], v["tau"]
    return Simo(law, (g, g * v["second"]), (t, t * v["slower"]))


def _dorfmann_ogden(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {
        "amplitude": 0.3,
        "m": float(f"{_energy(s) * _log(rng, 0.15, 0.8):.5g}"),
        "residual": _uniform(rng, 0.05, 0.3),
    }


def _damage(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.3, "scale": float(f"{_energy(s) * _log(rng, 0.3, 2.0):.5g}")}


def _damage_simo(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {**_two_times(rng, s), "scale": float(f"{_energy(s) * _log(rng, 0.3, 2.0):.5g}"), "amplitude": 0.2}


def _endochronic(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.2, "slip": float(f"{s.strain * _log(rng, 0.05, 0.25):.5g}")}


def _morph(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": _uniform(rng, 0.3, 1.0), "stiffness": _uniform(rng, 1.0, 2.5), "bulk": 800.0}


def _morph_force(v: Values, body: Specimen, c: Channel) -> Array:
    p1, p2, p3, p4, p5, p6, p7, p8 = MORPH
    k, a = v["stiffness"], v["amplitude"]
    # The softening and slipping parts are scaled by the amplitude; the others keep their stiffness.
    p = [k * (p1 + (1 - a) * p2 * 0.5), k * a * p2, p3, p4, k * a * p5, p6, p7, k * a * p8]
    # Every third sample of a leg is marched; between them the curve is smooth.
    sign = np.sign(np.diff(c.displacement))
    turns = [0, *(np.flatnonzero(np.diff(sign)) + 1), len(c.displacement) - 1]
    nodes = sorted({i for a_, b_ in pairwise(turns) for i in (*range(a_, b_, 3), b_)})
    q = c.displacement[nodes]
    forces = ask(
        "morph", {"dimensions": dict(body.dimensions), "p": p, "bulk": v["bulk"], "displacement": q.tolist()}
    )
    return np.asarray(PchipInterpolator(nodes, forces)(np.arange(len(c.displacement))))


# -- of the whole bushing ----------------------------------------------------------------------------------------


def _power_law(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.15, "exponent": _uniform(rng, 0.1, 0.5), "shortest": float(f"{s.fast * 0.05:.5g}")}


def _power_law_force(v: Values, body: Specimen, c: Channel) -> Array:
    force, _, _ = elastic_force(body, c)
    return force + component.power_law(c.time, force, v["amplitude"], v["exponent"], v["shortest"])


def _reach(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.05, "reach": _log(rng, 0.03, 0.2)}


def _bouc_wen(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {**_reach(rng, s), "power": _uniform(rng, 0.8, 2.5), "lean": _uniform(rng, 0.5, 0.9)}


def _berg_force(v: Values, body: Specimen, c: Channel) -> Array:
    force, most, q = elastic_force(body, c)
    return force + component.berg(c.displacement, v["amplitude"] * most, v["reach"] * q)


def _bouc_wen_force(v: Values, body: Specimen, c: Channel) -> Array:
    force, most, q = elastic_force(body, c)
    return force + component.bouc_wen(
        c.displacement, v["amplitude"] * most, v["reach"] * q, v["power"], v["lean"]
    )


def _iwan_force(v: Values, body: Specimen, c: Channel) -> Array:
    force, most, q = elastic_force(body, c)
    return force + component.iwan(c.displacement, v["amplitude"] * most, v["reach"] * q)


def _both_values(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {**_bouc_wen(rng, s), **_power_law(rng, s), "friction": _uniform(rng, 0.2, 0.5), "amplitude": 0.15}


def _both_force(v: Values, body: Specimen, c: Channel) -> Array:
    force, most, q = elastic_force(body, c)
    slip = component.bouc_wen(
        c.displacement, v["friction"] * v["amplitude"] * most, v["reach"] * q, v["power"], v["lean"]
    )
    return force + slip + component.power_law(c.time, force, v["amplitude"], v["exponent"], v["shortest"])


def _force_of_path(
    path: Callable[[Values, Channel, float], Array],
) -> Callable[[Values, Specimen, Channel], Array]:
    """The elastic force at a displacement that differs from the rig's."""

    def force(v: Values, body: Specimen, c: Channel) -> Array:
        curve_ = _plain("third_order", _Frozen(body), c.name, *span(c))
        q = float(np.abs(c.displacement).max())
        return np.asarray(curve_(c.displacement - path(v, c, q)))

    return force


def _set_saturating(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.03, "way": _uniform(rng, 0.5, 2.5)}


def _set_power(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {
        "amplitude": 0.03,
        "exponent": float(rng.choice([_uniform(rng, 0.5, 0.75), _uniform(rng, 1.4, 2.2)])),
    }


def _low_pass(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": float(f"{0.02 * s.fast:.5g}")}


def _low_pass_force(v: Values, body: Specimen, c: Channel) -> Array:
    force, _, _ = elastic_force(body, c)
    return component.low_pass(c.time, force, max(v["amplitude"], 1e-9))


# -- in the rig --------------------------------------------------------------------------------------------------


def _in_series(
    give: Callable[[Values, Array, float, float], Array],
) -> Callable[[Values, Specimen, Channel], Array]:
    """Force of a bushing in series with a compliance: q = q_b + give(F(q_b)), by interpolation in a table."""

    def force(v: Values, body: Specimen, c: Channel) -> Array:
        curve_ = _plain("third_order", _Frozen(body), c.name, *span(c))
        if c.name == "torsional":
            return np.asarray(curve_(c.displacement))
        low, high = span(c)
        inner = np.linspace(low, high, 4001)
        F = np.asarray(curve_(inner))
        most, q = float(np.abs(curve_(c.displacement)).max()), float(np.abs(c.displacement).max())
        rig = inner + give(v, F, most, q)
        return np.asarray(np.interp(c.displacement, rig, F))

    return force


def _hardening(v: Values, F: Array, most: float, q: float) -> Array:
    """A joint that closes: soft at small forces."""
    x = F / (v["knee"] * v["largest"])
    return v["amplitude"] * (np.tanh(x) + v["rest"] * F / v["largest"])


def _softening(v: Values, F: Array, most: float, q: float) -> Array:
    """A fixture that becomes more compliant as it bends."""
    x = F / v["largest"]
    return v["amplitude"] * (x + v["more"] * x * np.abs(x))


def _edges(v: Values, F: Array, most: float, q: float) -> Array:
    """A dead band with elastic edges: a small force moves the rig within it."""
    return v["amplitude"] * q * np.tanh(F / (v["edge"] * most))


def _stop(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {
        "amplitude": 0.5,
        "gap": _sign(rng) * _uniform(rng, 0.4, 0.75),
        "width": _uniform(rng, 0.08, 0.25),
    }


def _beside(law: Callable[[Values, Array], Array]) -> Callable[[Values, Specimen, Channel], Array]:
    """A soft stop beside the bushing; forces and displacements relative to the largest."""

    def force(v: Values, body: Specimen, c: Channel) -> Array:
        elastic_, most, q = elastic_force(body, c)
        side = np.sign(v["gap"])
        # The negative side has a smaller travel, to which its gap is relative.
        reach = q if side > 0 else float(-c.displacement.min())
        over = np.maximum(side * c.displacement - abs(v["gap"]) * reach, 0.0) / q
        return elastic_ + side * v["amplitude"] * most * law(v, over)

    return force


def _quadratic(v: Values, over: Array) -> Array:
    return over**2 / 0.25


def _ramp(v: Values, over: Array) -> Array:
    """A stiffness that rises linearly over a width and is then constant."""
    w = v["width"]
    return np.where(over < w, 0.5 * over**2 / w, over - 0.5 * w)


# -- in the assembly ---------------------------------------------------------------------------------------------


def _free(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    # Both meshes have a line where the bond ends; in the first decks it ended at the last node.
    return {"amplitude": 0.12 * s.length, "on_line": 1.0}


def _debonded_force(sleeve: str, end: str) -> Callable[[Values, Specimen, Channel], Array]:
    def force(v: Values, body: Specimen, c: Channel) -> Array:
        free, on_line = v["amplitude"], bool(v.get("on_line"))
        if c.name == "radial":
            curve = solid(body, c, free=free, sleeve=sleeve, end=end, on_line=on_line)
        else:
            curve = halfplane(body, c, **{sleeve: Bond(free, end, on_line)})
        return np.asarray(curve(c.displacement))

    return force


def _uneven_values(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.02 * s.thickness, "slope": _uniform(rng, 0.2, 0.8) * _sign(rng)}


def _swaged_force(v: Values, body: Specimen, c: Channel) -> Array:
    mean, slope = v["amplitude"], v["amplitude"] * v["slope"]
    if c.name == "radial":
        return np.asarray(solid(body, c, reduction=[mean, slope])(c.displacement))
    half = 0.5 * body.dimensions.get("length", body.dimensions.get("outer_length", 0.0))
    curve = halfplane(body, c, reduction=lambda z: mean + slope * z / half)
    return np.asarray(curve(c.displacement))


def _shrunk_values(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.01, "slope": _uniform(rng, 0.5, 1.5)}


def _shrunk_force(v: Values, body: Specimen, c: Channel) -> Array:
    mean, slope = v["amplitude"], v["amplitude"] * v["slope"]
    if c.name == "radial":
        return np.asarray(solid(body, c, shrinkage=[mean, slope])(c.displacement))
    a, b = body.dimensions["inner_radius"], body.dimensions["outer_radius"]
    curve = halfplane(body, c, shrinkage=lambda R: mean + slope * ((R - a) / (b - a) - 0.5))
    return np.asarray(curve(c.displacement))


def _volume(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": float(f"{1 / (150 * s.shear):.5g}")}


def _other_volume(v: Values, body: Specimen, c: Channel) -> Array:
    bulk = 1 / (v["amplitude"] + 1 / law_of(body).bulk)
    if c.name == "radial":
        return np.asarray(solid(body, c, bulk=bulk, volumetric="log")(c.displacement))
    curve = halfplane(body, c, law=law_of(body, bulk=bulk, volumetric="log"))
    return np.asarray(curve(c.displacement))


def _tilt(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.05 * s.thickness, "slope": _uniform(rng, 0.3, 1.0)}


def _tilted_force(v: Values, body: Specimen, c: Channel) -> Array:
    if c.name != "radial":
        return plain(FORMULAS["tilted"], body, c)
    mean, slope = v["amplitude"], v["amplitude"] * v["slope"]
    return np.asarray(solid(body, c, odd=False, offset=[mean, slope])(c.displacement))


def _joint(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {
        "amplitude": 0.01 * s.thickness,
        "knee": _uniform(rng, 0.05, 0.3),
        "rest": _uniform(rng, 0.2, 1.0),
    }


def _bend(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.01 * s.thickness, "more": _uniform(rng, 0.3, 1.5)}


def _play(rng: np.random.Generator, s: Situation) -> dict[str, float]:
    return {"amplitude": 0.02, "edge": _log(rng, 0.004, 0.03)}


# Softening by more than about half localises the strain, so that no mesh converges; `most` stays below that.
SOFT = (("mullins", "permanent_set"),)
SLIPS = (("friction", "mullins", "permanent_set"), ("friction", "permanent_set"))


def _rubber(
    truth: tuple[str, ...],
    values: Callable[[np.random.Generator, Situation], dict[str, float]],
    rubber: Callable[[Values, Law], Rubber],
    most: float = 4.0,
    also: Sequence[tuple[str, ...]] = (),
) -> Formula:
    return Formula(truth, values, _marched_force(rubber), 0.02, most, FLAT, tuple(also), "halfplane", True)


VISCOUS, SOFTENED, FRICTION = ("viscoelasticity",), ("mullins",), ("friction",)
FORMULAS: Mapping[str, Formula] = {
    "bergstroem_boyce": _rubber(
        VISCOUS,
        _bergstroem_boyce,
        lambda v, law: BergstroemBoyce(law, v["amplitude"], v["rate"], v["m"]),
        5.0,
    ),
    "simo": _rubber(VISCOUS, _two_times, _simo, 5.0),
    "holzapfel": _rubber(
        VISCOUS, _one_time, lambda v, law: Holzapfel(law, (v["amplitude"],), (v["tau"],)), 5.0
    ),
    "dorfmann_ogden": _rubber(
        SOFTENED,
        _dorfmann_ogden,
        lambda v, law: DorfmannOgden(law, v["amplitude"], v["m"], v["residual"] * v["amplitude"]),
        1.6,
        SOFT,
    ),
    "damage": _rubber(SOFTENED, _damage, lambda v, law: Damage(law, v["amplitude"], v["scale"]), 1.6),
    "damage_simo": _rubber(
        ("mullins", "viscoelasticity"),
        _damage_simo,
        lambda v, law: DamagedSimo(_simo(v, law), v["amplitude"], v["scale"]),
        3.0,
    ),
    "endochronic": _rubber(
        FRICTION, _endochronic, lambda v, law: Holzapfel(law, (v["amplitude"],), (v["slip"],), True)
    ),
    "morph": Formula(("friction", "mullins"), _morph, _morph_force, 1.0, 1.0, AXIAL, SLIPS, "morph", True),
    "power_law": Formula(VISCOUS, _power_law, _power_law_force, 0.02, 4.0, FLAT),
    "berg": Formula(FRICTION, _reach, _berg_force, 0.05, 6.0, FLAT),
    "bouc_wen": Formula(FRICTION, _bouc_wen, _bouc_wen_force, 0.05, 6.0, FLAT),
    "iwan": Formula(FRICTION, _reach, _iwan_force, 0.05, 6.0, FLAT),
    "power_law_bouc_wen": Formula(("friction", "viscoelasticity"), _both_values, _both_force, 0.1, 3.0, FLAT),
    "set_saturating": Formula(
        ("permanent_set",),
        _set_saturating,
        _force_of_path(
            lambda v, c, q: component.set_saturating(c.displacement, v["amplitude"], v["way"] * q)
        ),
        0.1,
        5.0,
        FLAT,
    ),
    "set_power": Formula(
        ("permanent_set",),
        _set_power,
        _force_of_path(lambda v, c, q: component.set_power(c.displacement, v["amplitude"], q, v["exponent"])),
        0.1,
        5.0,
        FLAT,
    ),
    "low_pass": Formula(("time_lag",), _low_pass, _low_pass_force, 0.05, 4.0, FLAT),
    "debonded_outer": Formula(
        ("debonding",), _free, _debonded_force("outer", "top"), 0.2, 3.0, (*TWISTED, *SOLID), base="solid"
    ),
    "debonded_bottom": Formula(
        ("debonding",), _free, _debonded_force("inner", "bottom"), 0.2, 3.0, (*TWISTED, *SOLID), base="solid"
    ),
    "swaged_unevenly": Formula(("swaging",), _uneven_values, _swaged_force, 0.1, 3.0, SOLID, base="solid"),
    "shrunk_unevenly": Formula(
        ("cure_shrinkage",), _shrunk_values, _shrunk_force, 0.1, 3.0, SOLID, base="solid"
    ),
    "other_volume": Formula(("compressibility",), _volume, _other_volume, 0.1, 3.0, SOLID, base="solid"),
    "tilted": Formula(("misalignment",), _tilt, _tilted_force, 0.2, 4.0, (("radial",),), base="solid"),
    "compliance_hardening": Formula(
        ("rig_compliance",), _joint, _in_series(_hardening), 0.1, 8.0, (*TWISTED, *SOLID)
    ),
    "compliance_softening": Formula(
        ("rig_compliance",), _bend, _in_series(_softening), 0.1, 8.0, (*TWISTED, *SOLID)
    ),
    "stop_quadratic": Formula(("bump_stop",), _stop, _beside(_quadratic), 0.05, 10.0, AXIAL),
    "stop_ramp": Formula(("bump_stop",), _stop, _beside(_ramp), 0.05, 10.0, AXIAL),
    "play_edges": Formula(("free_play",), _play, _in_series(_edges), 0.1, 5.0, AXIAL),
}
