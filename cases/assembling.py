"""Assembly before the test: swaging, shrinkage and the like are applied in steps, with the sleeve at rest."""

from __future__ import annotations

import time

from cases.equilibrium import Equilibrium
from cases.history import Attempt, failure_at_start
from cases.model import FiniteElementModel
from cases.stepper import SMALLEST_CUT

# Steps in which a bushing is assembled, and the time that its rubber has to relax afterwards (s).
ASSEMBLY_STEPS = 4
RELAXED = 1e12


def assemble(model: FiniteElementModel, solver: Equilibrium) -> list[Attempt]:
    """Apply the parameters of the assembly in steps while the sleeve is at rest, then let the rubber relax.

    Parameters
    ----------
    model
        Starts in the unloaded state and ends in that of the assembled bushing, not yet committed (`Model.commit`).
    solver
        Solver of the model.

    Raises
    ------
    NotConverged
        A step was cut back to the smallest length and still failed.
    """
    attempts: list[Attempt] = []
    model.duration.value = RELAXED
    done, step, previous_step = 0.0, 1.0 / ASSEMBLY_STEPS, 1.0
    states = [solver.unknowns()]
    while done < 1.0:
        stage = min(1.0, done + step)
        model.stage.value = stage
        # Extrapolated linearly from the last two states.
        guess = (
            states[-1]
            if len(states) < 2
            else states[-1] + (states[-1] - states[-2]) * (stage - done) / previous_step
        )
        start = time.perf_counter()
        outcome = solver.solve(0.0, guess)
        seconds = time.perf_counter() - start
        attempts.append(Attempt(0.0, 0.0, outcome.iterations, outcome.reason, seconds))
        if attempts[-1].accepted:
            previous_step, done = stage - done, stage
            states = [states[-1], solver.unknowns()]
            continue
        step *= 0.5
        if step < SMALLEST_CUT:
            model.stage.value = 1.0
            raise failure_at_start(outcome.reason, attempts)
    return attempts
