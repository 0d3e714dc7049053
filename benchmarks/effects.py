"""Cost of the effects: what each adds to the simulation of a long recording, and which of them look alike.

`python -m benchmarks effects`: an axial recording of eight cycles and 400 points, one effect at a time.
`python -m benchmarks memory`: processor time of five derivatives where the rubber has memory.
`python -m benchmarks alike`: cosine between the changes by two effects that a Yeoh law cannot imitate, axial and
radial.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from statistics import median

import numpy as np

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import Effect, effects, effects_on
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law
from geometry.shape import Refinement, shapes

BUSHING = {"inner_radius": 9.0, "outer_radius": 18.0, "length": 34.0}
YEOH = {"C10": 0.5, "C20": -0.04, "C30": 0.007}
POINTS = 400
REACH = {"axial": 6.0, "radial": 2.0}


def recording(mode: str) -> tuple[np.ndarray, np.ndarray]:
    """Time (s) and displacement (mm) of eight cycles of growing amplitude, one of them negative, 400 points."""
    a = REACH[mode]
    peaks = [a / 3, a / 3, 2 * a / 3, 2 * a / 3, a, a, -a, a]
    corners = np.concatenate([[0.0], np.column_stack([peaks, np.zeros(8)]).ravel()])
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners)))]) / (0.1 * a)
    t = np.linspace(0.0, times[-1], POINTS)
    return t, np.interp(t, times, corners)


def simulation_of(mode: str, active: list[ActiveEffect]) -> Simulation:
    """The simulation of such a recording, as in a fit."""
    t, q = recording(mode)
    rubber = Rubber(law("yeoh"), YEOH, 2000.0)
    return Simulation(shapes()["plain"](**BUSHING), modes()[mode], rubber, Refinement(), active, t, q, 1e-4)


def other(run: int) -> dict[str, float]:
    """C10 of a run, MPa, which differs in its last digits: a body keeps its last curves and would return them."""
    return {"C10": YEOH["C10"] * (1.0 + 1e-6 * (run + 1))}


def cost(runs: int) -> Iterator[str]:
    """Times of one solution, plain and with five derivatives, by effect."""
    yield "| effect | channel | set-up, s | solving, s | with 5 derivatives, s | steps | error of the steps, % |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for effect in effects_on("static").values():
        mode = "axial" if effect.acts_on("axial") else "radial"
        active = [ActiveEffect(effect).with_start_values()]
        simulation_of(mode, active)  # kernels
        begin = time.perf_counter()
        simulation = simulation_of(mode, active)
        built = time.perf_counter() - begin
        own = [f"{effect.name}.{p.name}" for p in active[0].parameters if not p.of_mesh]
        names = (*YEOH, *own, "compliance")[:5]
        simulation.solve({}, names)  # kernels
        plain = [_wall_time(lambda s=simulation, i=i: s.solve(other(i))) for i in range(runs)]
        slopes = [_wall_time(lambda s=simulation, n=names, i=i: s.solve(other(i), n)) for i in range(runs)]
        error = 100.0 * simulation.refine({})
        steps = len(simulation.steps.time) if simulation.path_dependent else 2 * 16
        yield (
            f"| {effect.name} | {mode} | {built:.2f} | {median(plain):.2f} | {median(slopes):.2f} "
            f"| {steps} | {error:.2g} |"
        )


def memory(runs: int) -> Iterator[str]:
    """Processor time of a march with memory, alternately alone and with five derivatives, in one process."""
    yield "| effect | channel | march, s | with 5 derivatives, s | ratio | smallest and largest |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for mode in REACH:
        for name in ("viscoelasticity", "friction", "mullins"):
            effect = effects()[name]
            active = [ActiveEffect(effect).with_start_values()]
            simulation = simulation_of(mode, active)
            names = (*YEOH, *(f"{name}.{p.name}" for p in active[0].parameters if not p.of_mesh))[:5]
            simulation.solve({})
            simulation.solve({}, names)
            pairs = [
                (
                    _processor_time(lambda s=simulation, i=i: s.solve(other(i))),
                    _processor_time(lambda s=simulation, n=names, i=i: s.solve(other(i), n)),
                )
                for i in range(runs)
            ]
            ratios = [whole / plain for plain, whole in pairs]
            plain, whole = (median(pair[i] for pair in pairs) for i in range(2))
            yield (
                f"| {name} | {mode} | {plain:.3f} | {whole:.3f} | {median(ratios):.2f} "
                f"| {min(ratios):.2f} to {max(ratios):.2f} |"
            )


def alike(runs: int) -> Iterator[str]:
    """Pairs of effects that look alike beside the law's parameters."""
    del runs
    directions: dict[str, np.ndarray] = {}
    basis = []
    for mode in REACH:
        simulation = simulation_of(mode, [])
        answer = simulation.solve({}, tuple(YEOH))
        basis.append(answer.slope / np.ptp(answer.force))
    laws_part, _ = np.linalg.qr(np.concatenate(basis))
    for effect in effects_on("static").values():
        parts = [_change(effect, mode) for mode in REACH]
        column = np.concatenate(parts)
        own = column - laws_part @ (laws_part.T @ column)
        if np.linalg.norm(own) > 1e-3 * max(np.linalg.norm(column), 1e-300):
            directions[effect.name] = own / np.linalg.norm(own)
        else:
            yield f"{effect.name}: nothing of it is left beside the law's parameters"
    pairs = [
        (abs(float(a @ b)), first, second)
        for i, (first, a) in enumerate(directions.items())
        for second, b in list(directions.items())[i + 1 :]
    ]
    yield "| pair | cosine |"
    yield "| --- | --- |"
    for cosine, first, second in sorted(pairs, reverse=True)[:15]:
        yield f"| {first}, {second} | {cosine:.2f} |"


def _change(effect: Effect, mode: str) -> np.ndarray:
    """Change of the curve by a typical amplitude, relative to its range; zero where the effect does not act."""
    active = ActiveEffect(effect).with_start_values()
    on, off = (
        simulation_of(mode, [variant] if effect.acts_on(mode) else []).solve({}).force
        for variant in (active, active.off())
    )
    return (on - off) / np.ptp(off)


def _wall_time(work: object) -> float:
    begin = time.perf_counter()
    work()  # type: ignore[operator]
    return time.perf_counter() - begin


def _processor_time(work: object) -> float:
    begin = time.process_time()
    work()  # type: ignore[operator]
    return time.process_time() - begin
