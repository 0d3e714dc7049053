"""Finds an equilibrium with contact when the initial guess penetrates a surface: first with a softer contact.

Behind a surface each iteration of Newton's method changes what is in contact, and the stiffer the contact, the more.
Where it fails, the step is repeated with a share of the contact's stiffness, and from the state that is found with more
of it, up to the actual one: only the last state is accepted as an equilibrium.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.newton import Outcome

Array = NDArray[np.float64]

# Shares of the stiffness. The kidney STEP's void closes from 3.9 to 4.2 mm, and from there to 4.5 mm, in 4 or 5
# iterations with each share, 13 with the first; with all of it at once, 25 iterations were not enough.
SOFTER = (0.03, 0.2)
# Out-of-balance force of these states over the norm of the reactions: they are only guesses for the next ones.
COARSE = 1e-2


def solve_with_softer_contact(solver: Equilibrium, q: float, guess: Array, corrections: int) -> Outcome:
    """Bring a model with contact into equilibrium, the contact becoming stiffer.

    Parameters
    ----------
    solver : Equilibrium
        Solver of the model.
    q : float
        Generalised displacement, mm or rad.
    guess : Array
        Unknowns to start from (`Equilibrium.unknowns`), shape (n,).
    corrections : int
        Number of corrections of the state that have gone before.
    """
    for share in SOFTER:
        with solver.coarse(COARSE), solver.model.surfaces.soften(share):
            outcome = solver.newton(q, guess, corrections)
        if not outcome.found:
            return outcome
        guess, corrections = solver.unknowns(), outcome.iterations
    return solver.newton(q, guess, corrections)
