"""Elastic sleeves that are drawn in before the test.

Swaging bends a sleeve for good: it is free of stress in the shape that it was drawn into, and strained by its further
displacement alone. Two approximations: its stiffness is that of the section before, and its turn is small, as that of a
sleeve that the rig holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cases.contact.surface import facets_of, on_region
from cases.feature import Installed
from cases.parameters import Parameters
from cases.ranks import sum_over_ranks
from geometry.dolfinx_api import collapse
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]


class DrawnIn:
    """The displacement at which an elastic sleeve is free of stress, by the features that draw in its boundary.

    Parameters
    ----------
    mesh : NamedMesh
    region : str
        The sleeve.
    features : sequence of Installed
    parameters : Parameters
    state
        Unknowns of the model, displacement first.
    kinematics : str
        Name of the setting.
    """

    def __init__(
        self,
        mesh: NamedMesh,
        region: str,
        features: Sequence[Installed],
        parameters: Parameters,
        state: Any,
        kinematics: str,
    ) -> None:
        self._parameters = parameters
        self._rates: dict[str, Array] = {}
        displacement = state.function_space.sub(0)
        for installed in features:
            if not installed.reductions:
                continue
            held = on_region(mesh, facets_of(mesh, [installed.feature.reduced]), region)
            if not sum_over_ranks(mesh.mesh.comm, len(held)):
                continue
            for name, draw_in in installed.reductions.items():
                rate = np.zeros(len(state.x.array))
                for component in range(displacement.num_sub_spaces):
                    subspace, dofs = collapse(displacement.sub(component))
                    x = subspace.tabulate_dof_coordinates()[:, : mesh.dimension].T
                    rate[dofs] = draw_in(x, kinematics)[component]
                self._rates[name] = rate

    def beyond(self, x: Array) -> Array:
        """Return what of a displacement, given by the unknowns (n,), strains the sleeve at the present parameters."""
        share = float(self._parameters.stage.value)
        for name, rate in self._rates.items():
            x = x - share * float(self._parameters.constants[name].value) * rate
        return x

    def rate(self, name: str) -> Array | None:
        """Return the derivative of the stress-free displacement by a parameter, as unknowns (n,); None for zero."""
        rate = self._rates.get(name)
        return None if rate is None else float(self._parameters.stage.value) * rate
