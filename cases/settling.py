"""Snap-through: rubber that has no equilibrium nearby flows to the next one, as if it were viscous.

A concave surface that is compressed beyond Biot's limit creases suddenly: the path of equilibria turns back there, and
Newton's method finds no equilibrium ahead, however short the step. Rubber in a test rig jumps, and comes to rest at the
next minimum of its energy. The model does the same with the sleeve held: each state of the flow is balanced by a drag,
c S (x - the previous state), with S the stiffness of the undeformed body (no drag acts on the pressures). The drag is
reduced as the flow goes on, and the accepted state is in equilibrium without it.

References
----------
Kelley and Keyes (1998), Convergence analysis of pseudo-transient continuation, SIAM J. Numer. Anal. 35:508-523,
doi:10.1137/S0036142996304796.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cases.drag import Drag
from cases.equilibrium import Equilibrium
from cases.newton import Outcome

Array = NDArray[np.float64]

# Initial drag over the stiffness at rest: it exceeds the negative stiffness of a crease, which is a fraction of that.
FIRST = 1.0
# Factor by which the drag is raised if a state is not found, and divisor after two states in a row were found.
THICKER, THINNER = 4.0, 3.0
# Number of states after which a flow is given up, and largest drag that is tried. Below the least drag, a state without
# any drag is sought.
STATES, MOST_DRAG, LEAST_DRAG = 100, 1e2, 1e-2
# Largest number of Newton iterations for a state of the flow: a larger drag finds a state sooner than more iterations.
FLOW_NEWTON = 8


def settle(solver: Equilibrium, q: float, start: Array) -> Outcome:
    """Bring the model's state into the equilibrium at q to which the rubber flows from a state.

    Parameters
    ----------
    solver : Equilibrium
        Solver of the model.
    q : float
        Generalised displacement, mm or rad.
    start : Array
        `Equilibrium.unknowns` at an equilibrium nearby, shape (n,).

    Returns
    -------
    Outcome
        With the reason "DIVERGED_FLOW" where the flow did not come to rest.
    """
    drag, viscosity = Drag(solver.model, FLOW_NEWTON), FIRST
    corrections, state, easy = 0, start, True
    outcome = Outcome(0, 0, "DIVERGED_MAX_IT")
    try:
        for _ in range(STATES):
            free = viscosity < LEAST_DRAG
            if free:
                outcome = solver.solve(q, state)
            else:
                with solver.with_drag(drag, state, viscosity):
                    outcome = solver.solve(q, state)
            corrections += outcome.iterations
            if (free and outcome.found) or (viscosity > MOST_DRAG and not outcome.found):
                break
            if not outcome.found:
                viscosity *= THICKER
            elif easy:
                viscosity /= THINNER
            easy = outcome.found
            state = solver.unknowns() if outcome.found else state
        if not (free and outcome.found):
            # A state that balances only with a drag is not an equilibrium.
            outcome = replace(outcome, reason="DIVERGED_FLOW")
        return replace(outcome, iterations=corrections)
    finally:
        drag.destroy()
