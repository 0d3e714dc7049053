"""Surfaces in contact at a state: which they are, where they touch, and with what force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.contact.contact import Contact

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Touch:
    """Two surfaces in contact.

    Attributes
    ----------
    surfaces : tuple of str
        Names of the boundaries, in alphabetical order; the same name twice where a surface meets itself.
    force : float
        Pressure integrated over the area in contact of the modelled part, N.
    radius, height : float
        Where the force acts, in the deformed body: mean distance from the axis, and mean z, mm.
    """

    surfaces: tuple[str, str]
    force: float
    radius: float
    height: float


def touches(contact: Contact, state: Array) -> list[Touch]:
    """Return the contacts at a state, one for each pair of boundaries.

    Parameters
    ----------
    contact : Contact
        Contact of the model, whose parameters are those of the state.
    state : Array
        This rank's unknowns, shape (n,).
    """
    contact.look(state)
    if not contact.is_touching:
        return []
    pressed, bodies = contact.pressed_points, contact.bodies
    inside = pressed.found
    # Each of two soft facets holds half of the energy, and both have points: the sum is one force.
    force = contact.shear_modulus * np.linalg.norm(pressed.own_forces(), axis=1)
    place = contact.places(inside.facet, inside.point)
    radius = place[:, 0] if place.shape[1] == 2 else np.hypot(place[:, 0], place[:, 1])
    own_names, mirrored = bodies.names[inside.facet], inside.other >= bodies.first_plane
    # The force on a part and that on its mirror image are one force; the plane stands for the same surface.
    force[mirrored] *= 0.5
    names = np.sort(
        np.column_stack([own_names, np.where(mirrored, own_names, bodies.names[inside.other])]), axis=1
    )
    answer = []
    for pair in np.unique(names, axis=0):
        of_pair = np.all(names == pair, axis=1) & (force > 0.0)
        if not of_pair.any():
            continue
        share = force[of_pair] / force[of_pair].sum()
        total, mean = float(force[of_pair].sum()), float(share @ radius[of_pair])
        answer.append(Touch((str(pair[0]), str(pair[1])), total, mean, float(share @ place[of_pair, -1])))
    return answer
