"""Contact: comparison with other codes, cost where no surfaces touch, and random marches.

``setup/enter python benchmarks/contact.py bump``, ``void``, ``hertz``, ``solid`` (a void of the kidney STEP, closed
in three dimensions), ``thick`` (a plain bushing to 80 % of its thickness), ``speed``, or ``random 30`` (seeds 0 to 29;
``random 30 7`` begins with seed 7). The results are in docs/contact.md. Data: tests/verification/data/real.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402

from cases.equilibrium import Equilibrium  # noqa: E402
from cases.march import NotConverged, march  # noqa: E402
from cases.mode import modes  # noqa: E402
from cases.program import Program  # noqa: E402
from cases.simulate import Rubber, prepare  # noqa: E402
from cases.stretches import stretch_points, stretches_at  # noqa: E402
from forms.law import laws  # noqa: E402
from geometry.shape import Shape, shapes  # noqa: E402
from tests.ball import RUBBER, Ball, hertz, johnson  # noqa: E402
from tests.slices import LAYER, KidneySlice, Roller, slices  # noqa: E402

YEOH = Rubber(laws()["yeoh"], {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
CASES = {
    "bump": ("slice_Abump_contact.csv", KidneySlice(bump=True, size=2.2), np.linspace(0.2, 2.0, 10)),
    "void": ("slice_A_void_closing.csv", KidneySlice(size=2.2, tip=0.5), np.linspace(0.25, 6.0, 24)),
}


def compare(name: str) -> None:
    """March one slice and print its deviation from the reference at each point, as it comes."""
    file, shape, path = CASES[name]
    q, force = np.loadtxt(ROOT / "tests/verification/data/real" / file, delimiter=",", skiprows=1)[:, :2].T
    begin = time.process_time()

    def tell(solver: Equilibrium) -> None:
        own, known = solver.force / (2 * LAYER), np.flatnonzero(np.abs(q - solver.q) < 1e-9)
        off = f"{100 * (own / force[known[0]] - 1):+.2f} %" if len(known) else ""
        print(f"{solver.q:.3f} mm  {own:.4f} N/mm  {off}  {time.process_time() - begin:.1f} s", flush=True)

    try:
        model, history = slices(shape, modes()["radial"], YEOH, path, observer=tell)
        print(f"{model.space.dofmap.index_map.size_global} unknowns")
    except NotConverged as stopped:
        print(stopped)
        history = stopped.history
    rejected = sum(not attempt.accepted for attempt in history.attempts)
    seconds = time.process_time() - begin
    print(f"{seconds:.1f} s of processor, {len(history.attempts)} steps tried, {rejected} cut back")


def speed(runs: int = 7) -> None:
    """March a plain bushing alternately with and without contact, and print the least processor time of each."""
    for mode, end in (("axial", 8.0), ("radial", 4.0)):
        shape = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
        made = {
            on: prepare(shape.model_copy(update={"contact": on}), modes()[mode], YEOH) for on in (False, True)
        }
        times: dict[bool, list[float]] = {False: [], True: []}
        for _ in range(runs):
            for on, model in made.items():
                begin = time.process_time()
                march(model, Program(np.linspace(end / 20, end, 20)))
                times[on].append(time.process_time() - begin)
        without, with_ = min(times[False]), min(times[True])
        change = 100 * (with_ / without - 1)
        print(f"{mode}: {1e3 * without:.1f} ms without, {1e3 * with_:.1f} ms with contact, {change:+.1f} %")


def hertzian() -> None:
    """Press a cylinder and a ball between hard plates, and print deviations from the theory of small contacts."""
    radial, axial = modes()["radial"], modes()["axial"]
    middle = replace(radial, held={"outer": (0,)}, reversed_by=None)
    shape = Roller(size=2.5, near=0.1)
    _, history = slices(shape, middle, RUBBER, -np.array([0.01, 0.03, 0.05, 0.1]))
    for q, force in zip(-history.displacement, -history.force, strict=True):
        print(f"cylinder, {q:g} mm: {force:.5f} N/mm, {100 * (force / johnson(q) - 1):+.2f} %", flush=True)
    equator = replace(axial, held={"outer": (1,)}, reversed_by=None)
    for near in (0.02, 0.01):
        model = prepare(Ball(near=near), equator, RUBBER)
        history = march(model, Program(-np.array([0.0005, 0.001, 0.002])))
        for q, force in zip(-history.displacement, -history.force, strict=True):
            off = 100 * (force / hertz(q) - 1)
            print(f"ball, elements of {near:g} mm, {q:g} mm: {1e3 * force:.5f} mN, {off:+.2f} %", flush=True)


def follow(name: str, shape: Shape, q: np.ndarray) -> None:
    """March a bushing radially; print force, time, penetration and volume ratios, then steps tried and memory."""
    begin = time.process_time()
    model = prepare(shape, modes()["radial"], YEOH)
    size = model.space.dofmap.index_map.size_global
    print(f"{name}: {size} unknowns, {time.process_time() - begin:.1f} s until then")
    points, begin, telling = stretch_points(model), time.process_time(), 0.0

    def tell(solver: Equilibrium) -> None:
        nonlocal telling
        now = time.process_time()
        contact = model.surfaces.contact
        deep = 0.0 if contact is None else 100 * contact.penetration
        volumes = stretches_at(points, model.state.x.array).reshape(-1, 3).prod(axis=1)
        print(
            f"{solver.q:.3f} mm  {solver.force:.2f} N  {now - begin - telling:.1f} s  depth {deep:.3f} %  "
            f"volume ratios {volumes.min():.2f} to {volumes.max():.2f}",
            flush=True,
        )
        telling += time.process_time() - now

    try:
        history = march(model, Program(q), observer=tell)
    except NotConverged as stopped:
        print(stopped)
        history = stopped.history
    rejected = sum(not attempt.accepted for attempt in history.attempts)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{len(history.attempts)} steps tried, {rejected} cut back, {memory:.0f} MB")


def solid() -> None:
    """Close the void of the kidney STEP in three dimensions, to 1.5 times its closing travel."""
    file = ROOT / "tests/verification/data/real/kidney_A.step"
    shape = shapes()["cad"].model_validate({"file": str(file)})
    follow("kidney STEP, radial x", shape, np.linspace(0.3, 6.0, 20))


def thickness() -> None:
    """Press a plain bushing between sleeves longer than its bonds radially to 80 % of its rubber's thickness."""
    shape = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0, contact="sleeves")
    follow("plain 12/22/40, radial", shape, np.linspace(0.4, 8.0, 20))


def slot(rng: np.random.Generator) -> tuple[str, Shape, str, float]:
    """Return a spring between two plates with a slot in its outside, pressed to 1.5 times its closing travel."""
    z, half, depth = rng.uniform(4.0, 6.0), rng.uniform(0.2, 0.6), rng.uniform(13.5, 17.5)
    outline: list[dict[str, Any]] = [
        {"from": [10.0, 0.0], "to": [20.0, 0.0], "name": "outer"},
        {"to": [20.0, z - half]},
        {"to": [depth, z - half]},
        {"to": [depth, z + half], "arc_through": [depth - half * rng.uniform(1.0, 2.5), z]},
        {"to": [20.0, z + half]},
        {"to": [20.0, 10.0]},
        {"to": [10.0, 10.0], "name": "inner"},
        {"to": [10.0, 0.0]},
    ]
    return "slot", shapes()["section"](outline=outline), "axial", -3.0 * half


def thick(rng: np.random.Generator) -> tuple[str, Shape, str, float]:
    """Return a plain bushing between longer sleeves, pressed to between 60 and 80 % of its thickness."""
    inner, wall = rng.uniform(10.0, 14.0), rng.uniform(6.0, 12.0)
    shape = shapes()["plain"](
        inner_radius=inner, outer_radius=inner + wall, length=rng.uniform(25.0, 50.0), contact="sleeves"
    )
    return "plain", shape, "radial", wall * rng.uniform(0.6, 0.8)


def stop(rng: np.random.Generator) -> tuple[str, Shape, str, float]:
    """Return a slice with a bump stop in its void, pressed beyond first contact."""
    # Elements of another size could leave triangles among the quadrilaterals; this size leaves none.
    return "bump stop", KidneySlice(bump=True, size=2.2), "radial", rng.uniform(1.0, 1.6)


FAMILIES: tuple[Callable[[np.random.Generator], tuple[str, Shape, str, float]], ...] = (
    slot,
    slot,
    thick,
    stop,
)


def march_random(seed: int) -> tuple[float, float]:
    """March one random bushing in ten steps, print a line, and return its deepest penetration (%) and the time (s)."""
    rng = np.random.default_rng(seed)
    name, shape, mode, end = FAMILIES[seed % len(FAMILIES)](rng)
    law = Rubber(
        YEOH.law, {"C10": rng.uniform(0.3, 0.8), "C20": -0.05, "C30": rng.uniform(0.005, 0.02)}, 2000.0
    )
    begin = time.process_time()
    model = prepare(shape, modes()[mode], law)
    program = Program(np.linspace(end / 10, end, 10))
    try:
        history, why = march(model, program, keep_states=True), ""
    except NotConverged as stopped:
        history, why = stopped.history, stopped.reason
    seconds = time.process_time() - begin
    contact, deepest, met = model.surfaces.contact, 0.0, 0
    assert contact is not None
    assert history.states is not None
    for state in history.states:
        contact.look(state)
        deepest, met = max(deepest, 100 * contact.penetration), met + contact.is_touching
    share = history.displacement[-1] / end if len(history.displacement) else 0.0
    tried, cut = len(history.attempts), sum(not attempt.accepted for attempt in history.attempts)
    print(
        f"seed {seed:3d} {name:9s} {100 * share:5.1f} % of {abs(end):5.2f} mm, {met:2d} of {len(history.states)} steps "
        f"in contact, {tried} steps tried ({cut} cut back), {seconds:6.1f} s, deepest {deepest:.3f} % {why}",
        flush=True,
    )
    return deepest, seconds


def marches(count: int, first: int = 0) -> None:
    """March random bushings, and print the worst of them."""
    rows = np.array([march_random(seed) for seed in range(first, first + count)])
    deepest, longest = rows.max(axis=0)
    print(f"{count} marches: deepest penetration {deepest:.3f} % of a facet, longest {longest:.1f} s")


ALONE = {"hertz": hertzian, "solid": solid, "thick": thickness, "speed": speed}

if __name__ == "__main__":
    what, *numbers = sys.argv[1:]
    if what in CASES:
        compare(what)
    elif what in ALONE:
        ALONE[what]()
    else:
        marches(*map(int, numbers))
