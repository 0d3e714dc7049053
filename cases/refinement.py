"""Solutions of the tangent's equations for several loads, with a factorisation that is one or two short steps old.

After a short step the factorisation at hand is nearly that of the new tangent. GMRES, preconditioned by it, then finds
the solutions for all loads in two or three iterations, each of which costs one back-substitution for all of them and a
product with the tangent for each, applied at the quadrature points: in three dimensions a fifth of assembling and
factorising it.

References
----------
See `cases.rates`, which does the same for a single load and older factorisations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cases.ranks import summed
from cases.rates import LOOSER, SMALLEST, Found
from cases.rigid import solved

Array = NDArray[np.float64]

# Largest number of iterations; with more, a fresh factorisation costs no more.
MOST = 3


def refined(at: Found, loads: Array, guess: Array) -> Array | None:
    """Solve for the response to each load, down to the tolerance of `cases.rates`; None where that takes too long.

    Parameters
    ----------
    at : Found
        The solution, with the moduli there and a factorisation of some earlier tangent.
    loads : shape (k, n)
        Loads on the free unknowns, complete on the rank that owns them; zero in ghosts and constrained unknowns.
    guess : shape (k, n)
        All local unknowns; the constrained ones have their prescribed values and keep them.

    Returns
    -------
    ndarray, shape (k, n), or None
    """
    found, close = guess.copy(), max(LOOSER * at.tolerance, SMALLEST)
    left = solved(at.model, at.ksp, loads - _forces(at, found))
    directions: list[tuple[Array, Array]] = []
    before = 1.0
    while True:
        size = _norms(at, found + left)
        error = float(np.max(_norms(at, left)[size > 0.0] / size[size > 0.0], initial=0.0))
        if not np.isfinite(error):
            return None
        # Adding the remainder reduces the error again, by as much as the last iteration did.
        if error * min(1.0, error / before) <= close:
            return found + left
        if len(directions) == MOST:
            return None
        before = error
        image, direction = solved(at.model, at.ksp, _forces(at, left)), left.copy()
        for earlier, its_image in directions:
            share = _dots(at, its_image, image)[:, None]
            image -= share * its_image
            direction -= share * earlier
        size = _norms(at, image)[:, None]
        scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
        directions.append((direction * scale, image * scale))
        direction, image = directions[-1]
        share = _dots(at, image, left)[:, None]
        found += share * direction
        left = left - share * image


def _forces(at: Found, directions: Array) -> Array:
    """The tangent applied to each direction, complete and zero where `loads` are."""
    system = at.model.system
    found, b = np.zeros_like(directions), system.create_vector()
    for direction, row in zip(directions, found, strict=True):
        system.apply_tangent(b, direction)
        b.array_w[system.owned_constrained] = 0.0
        row[: system.owned] = b.array_r
    b.destroy()
    return found


def _dots(at: Found, left: Array, right: Array) -> Array:
    owned = slice(0, at.model.system.owned)
    return np.asarray(summed(at.model.comm, np.einsum("kn,kn->k", left[:, owned], right[:, owned])))


def _norms(at: Found, rows: Array) -> Array:
    return np.asarray(np.sqrt(_dots(at, rows, rows)))
