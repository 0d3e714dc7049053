"""Harmonic balance against the march along time, over amplitude and frequency: python -m benchmarks.amplitude.

A plain bushing 12/22/40 of a thinned rubber, axially, half-plane of 2 x 4 elements, no inertia. The march goes through
two periods and a half of a sine, of which the last is projected on the first and the third harmonic. `amplitude.md` has
what was measured.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from bushcli.effects.effect import effect
from cases.dynamic.amplitude import UnevenModel
from cases.dynamic.model import sweep
from cases.dynamic.pencil import Pencil
from cases.dynamic.reduction import basis_for
from cases.equilibrium import Equilibrium
from cases.feature import Installed
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry.shape import Refinement, shapes

INNER, OUTER, LENGTH = 12.0, 22.0, 40.0
PAYNE = {
    "g": 0.75,
    "tau": 3000.0,
    "decades": 5.0,
    "slope": -0.15,
    "path": 2e4,
    "offset": 0.05,
    "exponent": 1.8,
}
STRAINS, FREQUENCIES = (1e-4, 1e-3, 1e-2, 0.05, 0.2), (0.01, 0.1, 1.0, 10.0, 100.0)
PERIODS, SAMPLES = 2.5, 60


def main() -> None:
    """Print a table of both, row by row."""
    shape = shapes()["plain"].model_validate({"inner_radius": INNER, "outer_radius": OUTER, "length": LENGTH})
    rubber, mesh, mode = Rubber(law("neo_hookean"), {"C10": 0.5}), Refinement(2, 4, 8), modes()["axial"]
    feature = effect("payne").feature()
    assert feature.thinned is not None
    thinned = feature.thinned(PAYNE)
    uneven_models: list[UnevenModel] = []

    def observe(solver: Equilibrium) -> None:
        points = sweep(np.array(FREQUENCIES), thinned.branches())
        model = UnevenModel(
            basis_for(Pencil(solver.model, solver, {}), points, 0.0, 1e-5), thinned, (), 0, True
        )
        for strain in STRAINS[::2]:
            model.enrich(strain * (OUTER - INNER), FREQUENCIES[0])
        uneven_models.append(model)

    march(prepare(shape, mode, rubber, mesh), Program(np.zeros(1)), observer=observe)
    model = prepare(shape, mode, rubber, mesh, features=[Installed("payne", feature, PAYNE)])
    out = sys.stdout.write
    out(
        "| strain | Hz | K*, N/mm | third, % | along time | third, % | K* apart, % | degrees | s, balance | s, time |\n"
    )
    out("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n")
    for strain in STRAINS:
        for frequency in FREQUENCIES:
            amplitude = strain * (OUTER - INNER)
            begin = time.process_time()
            (balance,), (third,) = uneven_models[0].stiffness(np.array([amplitude]), np.array([frequency]))
            middle = time.process_time()
            moments = np.linspace(0.0, PERIODS / frequency, int(PERIODS * SAMPLES) + 1)
            turn = 2.0 * np.pi * frequency * moments
            force = march(model, Program(amplitude * np.sin(turn), moments)).force[-SAMPLES:]
            end = time.process_time()
            first, other = (2.0 / SAMPLES * np.sum(force * np.exp(-1j * n * turn[-SAMPLES:])) for n in (1, 3))
            along = 1j * first / amplitude
            out(
                f"| {strain:g} | {frequency:g} | {balance:.1f} | {100 * third:.2f} | {along:.1f} | "
                f"{100 * abs(other / first):.2f} | {100 * (abs(balance / along) - 1):+.2f} | "
                f"{np.degrees(np.angle(balance / along)):+.3f} | {middle - begin:.4f} | {end - middle:.1f} |\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
