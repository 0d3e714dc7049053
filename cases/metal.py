"""The material of an elastic sleeve at its points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cases.kernels import kernel
from forms import answers
from forms.setting import KinematicDescription

Array = NDArray[np.float64]


class MetalAtPoints:
    """An elastic sleeve: small strain, any rotation.

    Attributes
    ----------
    strain : shape (points, variables)
        Strain variables at which answers are computed.
    """

    def __init__(self, setting: KinematicDescription, points: int) -> None:
        self._answer, self._points = kernel(answers.metal_answer(setting)), points
        self.variables = len(setting.names) + 1
        self.strain = np.zeros((points, self.variables))
        self._moduli = np.zeros(2)
        self._row = np.zeros((points, self._answer.size))
        self._call = self._answer.bind(
            self._row, {"strain": self.strain, "parameters": self._moduli}, clear=True
        )

    def take(self, moduli: Array) -> None:
        """Use these shear and bulk moduli (MPa) from now on."""
        self._moduli[:] = moduli

    def answer(self, moduli: bool) -> Array:
        """Return energy, stresses and moduli at `strain`; the next call overwrites the array."""
        self._call()
        return self._row

    def change_of_stress(self, moduli: Array) -> Array:
        """Return the change of the stresses at `strain` with a change of the moduli, in which they are linear."""
        row = self._answer(self._points, {"strain": self.strain, "parameters": moduli})
        return row[:, 1 : 1 + self.variables]
