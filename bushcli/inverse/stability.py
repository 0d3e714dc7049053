"""How far a law is from its edge of stability in the states that the rubber reaches, and the penalty beyond."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cases.stability import moduli
from forms.law import Law

Array = NDArray[np.float64]

# The smallest eigenvalue of the tangent moduli may fall to this share of the initial shear modulus.
STABILITY_MARGIN = 0.01
# Misfit, in units of scale, for a state whose smallest modulus is one shear modulus below the margin: far more than
# any channel can gain by it.
STABILITY_WEIGHT = 1e3
# Width of the penalty's smooth onset, in shear moduli: a search that met a sharp edge without warning would end there.
STABILITY_EDGE = 0.005
# A row of the penalty above this holds the search back.
ACTIVE = 1e-3


def smallest_moduli(law: Law, parameters: Mapping[str, float], states: Array) -> Array:
    """Return the smallest tangent modulus in each state, shape (n,), in initial shear moduli; -1 where not finite.

    Parameters
    ----------
    law : Law
    parameters : mapping of str to float
        The law's parameters, each in its unit.
    states : Array
        Principal stretches, shape (n, 3).
    """
    shear = max(abs(law.shear_modulus(**parameters)), 1e-12)
    tangents = moduli(law, parameters, states)
    finite = np.isfinite(tangents).all(axis=(1, 2))
    smallest = np.full(len(states), -1.0)
    smallest[finite] = np.linalg.eigvalsh(tangents[finite])[:, 0] / shear
    return smallest


def penalty(smallest: Array) -> Array:
    """Return the rows of the misfit (n,) by the smallest moduli in each state (n,), in shear moduli."""
    beyond = (STABILITY_MARGIN - smallest) / STABILITY_EDGE
    lacking = np.where(beyond > -12.0, STABILITY_EDGE * np.logaddexp(0.0, beyond), 0.0)
    return np.asarray(STABILITY_WEIGHT / np.sqrt(max(len(smallest), 1)) * lacking)
