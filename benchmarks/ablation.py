"""What each mechanism of `bushcli inverse` is worth: 24 recordings are identified with one mechanism off at a time.

``setup/enter python benchmarks/ablation.py [RECORDINGS]`` prints the table of benchmarks/ablation.md (ten minutes of a
processor). The recordings are drawn: axial tests of plain bushings by laws of three kinds, with noise, some with poor
start values, some with an effect. RECORDINGS is a folder with ``coupons/hnbr50`` and ``practice/``, which are not part
of the project; four of its recordings replace drawn ones. Intervals are not computed except where they matter.
"""

from __future__ import annotations

import importlib
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from mpi4py import MPI

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks import practice
from bushcli.case import Case, load_case
from bushcli.curve.curve import Curve
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.errors import InputError
from bushcli.inverse import Task, identify
from bushcli.inverse.channel import StepLimit
from bushcli.inverse.contained import ContainedPart
from bushcli.inverse.local import Watched
from bushcli.inverse.problem import STOPPING
from bushcli.recording import write_curve_csv
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law
from geometry.shape import Refinement, shapes

BUSHING = {"inner_radius": 10.0, "outer_radius": 20.0, "length": 36.0}
LAWS: dict[str, dict[str, float]] = {
    "yeoh": {"C10": 0.5, "C20": -0.04, "C30": 0.007},
    "gent": {"mu": 0.9, "Jm": 12.0},
    "mooney_rivlin": {"C10": 0.3, "C01": 0.15},
}
# Values of an effect in the recording; the fit begins with the start values of the catalogue.
EFFECTS: tuple[tuple[str, dict[str, float]], ...] = (
    ("bump_stop", {"stiffness": 900.0, "gap": 2.5}),
    ("offset", {"force": 40.0, "displacement": 0.1}),
    ("rig_compliance", {"compliance": 1e-4}),
    ("free_play", {"half_width": 0.15}),
)
# Poor start values of Yeoh's law: ten times too stiff, a tenth, unstable, and on bounds.
STARTS = ((5.0, -0.5, 0.1), (0.05, -0.005, 0.001), (0.5, -0.4, 0.01), (1e-3, 100.0, -100.0))
# Drawn recordings without an effect.
PLAIN = 12


def write(folder: Path, seed: int, start: tuple[float, ...] = (), with_effect: int | None = None) -> Case:
    """Draw a recording, and write it with its case."""
    rng = np.random.default_rng([56, seed])
    name = list(LAWS)[seed % len(LAWS)]
    reach = rng.uniform(0.2, 0.7) * (BUSHING["outer_radius"] - BUSHING["inner_radius"])
    up = np.linspace(0.0, reach, int(rng.integers(16, 60)))
    q = np.concatenate([up, up[-2::-1], -up[1:], -up[-2::-1]])
    active: tuple[ActiveEffect, ...] = ()
    text = ""
    if with_effect is not None:
        called, values = EFFECTS[with_effect]
        active = (ActiveEffect(effect(called), values),)
        text = f'\n[[effects]]\nname = "{called}"\n'
    rubber = Rubber(law(name), LAWS[name], 2000.0)
    body = shapes()["plain"](**BUSHING)
    simulated = Simulation(body, modes()["axial"], rubber, Refinement(), active, None, q, None, MPI.COMM_SELF)
    force = simulated.solve(LAWS[name]).force
    force = force + rng.uniform(0.003, 0.015) * np.abs(force).max() * rng.standard_normal(len(q))
    folder.mkdir()
    write_curve_csv(folder / "axial.csv", Curve("axial", q, force))
    given = ", ".join(f"{key} = {value}" for key, value in zip(LAWS["yeoh"], start, strict=False))
    dimensions = "\n".join(f"{key} = {value}" for key, value in BUSHING.items())
    (folder / "case.toml").write_text(
        f'[geometry]\nshape = "plain"\n{dimensions}\n[material]\nlaw = "yeoh"\nbulk_modulus = 2000.0\n'
        + (f"parameters = {{ {given} }}\n" if start else "")
        + f'[[recordings]]\nmode = "axial"\nfile = "axial.csv"\n{text}'
    )
    return load_case(folder / "case.toml", [])


def recordings(folder: Path, source: Path | None) -> Iterator[tuple[str, Case]]:
    """Yield names and cases of all recordings; with an effect, the name begins with it."""
    for seed in range(PLAIN + (0 if source else 4)):
        yield f"plain {seed}", write(folder / f"p{seed}", seed)
    for number, start in enumerate(STARTS):
        yield f"poor start {number}", write(folder / f"s{number}", 3 * number, start=start)
    for number, (name, _) in enumerate(EFFECTS):
        yield f"effect {name}", write(folder / f"e{number}", 3 * number + 30, with_effect=number)
    if source is None:
        return
    for name in ("p01", "p04", "p08"):
        there = folder / name
        there.mkdir()
        practice.practice(source, there, name)
        file = there / "case.toml"
        file.write_text(file.read_text().partition('[[recordings]]\nmode = "radial"')[0])
        yield f"measured {name}", load_case(file, [])
    there = folder / "loop"
    there.mkdir()
    practice.coupon(source, there, "hnbr50 loop")
    with (there / "case.toml").open("a") as case:
        case.write(
            '[[effects]]\nname = "viscoelasticity"\nparameters = { g1 = 0.2, tau1 = 10.0, g2 = 0.1, tau2 = 1.0 }\n'
        )
    yield "effect viscoelasticity", load_case(there / "case.toml", [])


def patches() -> dict[str, list[Any]]:
    """Return what takes each mechanism out, by name."""
    searching, identifying, contained, starting = (
        importlib.import_module(f"bushcli.inverse.{name}")
        for name in ("minimum_search", "identify", "contained", "start_values")
    )

    def stays(problem: Any, minimum: Any, *_: Any) -> Any:
        return minimum

    def directly(problem: Any, start: Any, loss: Any = "linear", every: Any = ()) -> Any:
        return searching.search(problem, start, loss)

    plain = contained.removable_parts

    def first_of_grids(*given: Any) -> list[ContainedPart]:
        return [replace(a, grid={name: values[:1] for name, values in a.grid.items()}) for a in plain(*given)]

    def only(problem: Any, start: Any) -> Iterator[Any]:
        yield start

    steps = property(lambda self: self.given)
    return {
        "-": [],
        "search along the edge of stability": [patch.object(searching, "minimise_at_edge", stays)],
        "stability where the search goes": [patch.object(searching, "watch", lambda problem, x: False)],
        "unstable trials are not solved": [
            patch.object(Watched, "_is_surely_rejected", lambda self, x: False)
        ],
        "marches are given up": [patch.object(StepLimit, "steps", steps)],
        "end after failures in a row": [patch.object(searching, "WALL", STOPPING.evaluations)],
        "end on the floor of a valley": [patch.dict(STOPPING.__dict__, valley=(10**6, 0.0))],
        "start brought to scale": [patch.object(starting, "fit_scale", lambda problem, trial: trial)],
        "other starts where one is unstable": [patch.object(starting, "candidates", only)],
        "start from contained models": [patch.object(identifying, "from_contained", directly)],
        "grid of times, slips and gaps": [patch.object(identifying, "removable_parts", first_of_grids)],
        "split of a branch": [patch.object(contained, "_split", lambda problem, x, part: x)],
    }


HEADS = (
    "without",
    "recordings",
    "rms 10 % higher",
    "largest factor",
    "other convergence",
    "evaluations",
    "failed (with)",
    "processor time",
)
# Mechanisms that act where there is an effect only.
OF_EFFECTS = ("start from contained models", "grid of times, slips and gaps", "split of a branch")


def search_outcome(case: Case) -> tuple[float, bool, int, int, float]:
    """Return rms misfit in units of the noise, whether it converged, evaluations, failed ones, processor seconds."""
    begin = time.process_time()
    try:
        fit = identify(Task(case, "yeoh"))
    except InputError as error:
        print(f"    {type(error).__name__}: {error}", file=sys.stderr)
        return float("nan"), False, 0, 0, time.process_time() - begin
    return float(np.sqrt(fit.cost)), fit.converged, fit.sweeps, fit.failed_solves, time.process_time() - begin


def row(name: str, results: list[tuple[Any, ...]], usual: list[tuple[Any, ...]]) -> str:
    """Return a row of the table: what changes without a mechanism."""
    ratios = np.array([new[0] / old[0] for new, old in zip(results, usual, strict=True)])
    worse = int(np.sum(~(ratios <= 1.1)))
    largest = "none at all" if np.isnan(ratios).any() else f"{ratios.max():.2f}"
    flipped = sum(new[1] != old[1] for new, old in zip(results, usual, strict=True))
    evaluations, failed, seconds = (
        [sum(result[i] for result in rows) for rows in (results, usual)] for i in (2, 3, 4)
    )
    return (
        f"| {name} | {len(results)} | {worse} | {largest} | {flipped} | {evaluations[0] / evaluations[1]:.2f} "
        f"| {failed[0]} ({failed[1]}) | {seconds[0] / seconds[1]:.2f} |"
    )


def main(source: Path | None) -> None:
    """Print the table."""
    searches: Any = importlib.import_module("bushcli.inverse.identify")._Searches
    searches._profile_best = lambda self, best, skipped: (best, [], False)
    with tempfile.TemporaryDirectory() as folder:
        cases = list(recordings(Path(folder), source))
        for _, case in cases:
            search_outcome(case)  # forms are compiled once
        print(f"{len(cases)} recordings\n")
        print("| " + " | ".join(HEADS) + " |")
        print("|" + " --- |" * 8)
        usual: dict[str, tuple[Any, ...]] = {}
        for name, changes in patches().items():
            chosen = [c for c in cases if name not in OF_EFFECTS or c[0].startswith("effect")]
            with ExitStack() as stack:
                for change in changes:
                    stack.enter_context(change)
                results = {label: search_outcome(case) for label, case in chosen}
            usual = usual or results
            for label, result in results.items():
                print(f"{name} | {label}: {result}", file=sys.stderr)
            print(row(name, list(results.values()), [usual[label] for label in results]), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
