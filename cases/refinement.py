"""Solves the tangent's equations for several loads with a factorisation of an earlier or symmetrised tangent.

After a short step the factorisation at hand is nearly that of the new tangent; and of a tangent that is not symmetric
only the symmetric part is factorised. GMRES, preconditioned by it, then finds
the solutions for all loads in a few iterations. Each costs one back-substitution for all of them and their products
with the tangent, applied at the quadrature points: in three dimensions a seventh of assembling and factorising it. The
loads share their directions (a block method), for which the products are at hand.

References
----------
See `cases.rates`, which does the same for a single load and older factorisations. Stathopoulos and Wu (2002), A block
orthogonalization procedure with constant synchronization requirements, SIAM J. Sci. Comput. 23:2165-2182,
doi:10.1137/S1064827500370883 (`_orthonormal`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cases.ranks import sum_over_ranks
from cases.rates import LOOSER, SMALLEST, ConvergedState
from cases.rigid import complete_forces, solve_under_forces

Array = NDArray[np.float64]

# Largest number of iterations; with more, a fresh factorisation costs no more.
MOST_CORRECTIONS = 4
# Directions whose images are as dependent as this, by the eigenvalues of their products, are left out: rounding changes
# the eigenvalues by 1e-16 of the largest, so that smaller ones would be wrong by more than 1e-6 of themselves.
DEPENDENT = 1e-10


def solve_by_refinement(
    state: ConvergedState, loads: Array, guess: Array, most: int = MOST_CORRECTIONS
) -> Array | None:
    """Solve for the response to each load, down to the tolerance of `cases.rates`; None where that takes too long.

    Parameters
    ----------
    state : ConvergedState
        The solution, with the moduli there and a factorisation of some earlier tangent.
    loads : shape (k, n)
        Loads on the free unknowns, complete on the rank that owns them; zero in ghosts and constrained unknowns.
    guess : shape (k, n)
        All local unknowns; the constrained ones have their prescribed values and keep them.
    most : int
        Largest number of iterations.

    Returns
    -------
    ndarray, shape (k, n), or None
    """
    solutions, tolerance = guess.copy(), max(LOOSER * state.tolerance, SMALLEST)
    residuals = solve_under_forces(state.model, state.ksp, loads - _pulls(state, solutions))
    searched: list[tuple[Array, Array]] = []
    previous_errors: Array = np.ones(len(loads))
    unconverged: NDArray[np.bool_] = np.ones(len(loads), dtype=bool)
    while True:
        errors = _shares(state, residuals, solutions + residuals)
        error = float(np.max(errors, initial=0.0))
        if not np.isfinite(error):
            return None
        # Adding the remainder reduces the error again, by as much as the last iteration did where it was meant to.
        rate = min(1.0, float(np.max(errors[unconverged] / previous_errors[unconverged], initial=0.0)))
        if error * rate <= tolerance:
            return solutions + residuals
        # At that rate the iterations that are left must suffice.
        if len(searched) == most or (searched and error * rate ** (1 + most - len(searched)) > tolerance):
            return None
        previous_errors, unconverged = errors, errors * rate > tolerance
        directions = residuals[unconverged]
        images = solve_under_forces(state.model, state.ksp, _pulls(state, directions))
        for earlier, its_images in searched:
            shares = _products(state, images, its_images)
            images -= shares @ its_images
            directions -= shares @ earlier
        turn = _orthonormal(_products(state, images, images))
        directions, images = turn @ directions, turn @ images
        searched.append((directions, images))
        shares = _products(state, residuals, images)
        solutions += shares @ directions
        residuals = residuals - shares @ images


def _pulls(state: ConvergedState, directions: Array) -> Array:
    """The tangent applied to each direction, complete and zero where `loads` are."""
    return complete_forces(state.model, state.model.system.pulls(directions))


def _orthonormal(products: Array) -> Array:
    """Combinations of vectors that are orthonormal, shape (m <= k, k), given the vectors' products with each other."""
    size = np.sqrt(np.diag(products))
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    values, vectors = np.linalg.eigh(products * np.outer(scale, scale))
    significant = values > DEPENDENT * max(float(values[-1]), 0.0)
    return np.asarray((vectors[:, significant] / np.sqrt(values[significant])).T * scale)


def _products(state: ConvergedState, left: Array, right: Array) -> Array:
    owned = slice(0, state.model.system.owned)
    return np.asarray(sum_over_ranks(state.model.comm, left[:, owned] @ right[:, owned].T))


def _shares(state: ConvergedState, parts: Array, wholes: Array) -> Array:
    """Norm of each row over that of another; 0 where that is zero."""
    owned = slice(0, state.model.system.owned)
    squares = np.array([np.einsum("kn,kn->k", rows[:, owned], rows[:, owned]) for rows in (parts, wholes)])
    part, whole = np.sqrt(sum_over_ranks(state.model.comm, squares))
    return np.asarray(np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0))
