"""Dynamic stiffness about one preload, at any frequencies, branches and density, without another solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cases.dynamic.reduction import ReducedPencil, Sweep
from cases.dynamic.slopes import Changes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# A model is also reduced for branches this many times as stiff, so that it serves others than the given ones, too
# (`DynamicModel.error` says how well).
STIFFER = 2.0

Branches = Sequence[tuple[float, float]]
"""For each Maxwell branch its modulus over the law's initial shear modulus, and its relaxation time (s)."""


def modulus(frequencies: Array, branches: Branches) -> Complex:
    """Return s, the complex modulus of the branches over the law's initial shear modulus, shape (f,).

    Parameters
    ----------
    frequencies : shape (f,)
        Hz.
    branches : Branches
    """
    s = np.zeros(len(frequencies), dtype=np.complex128)
    for g, tau in branches:
        i_omega_tau = 2j * np.pi * frequencies * tau
        s += g * i_omega_tau / (1.0 + i_omega_tau)
    return s


def sweep(frequencies: Array, branches: Branches) -> Sweep:
    """Return the points of a sweep over frequencies (Hz).

    Parameters
    ----------
    frequencies : shape (f,)
        Hz.
    branches : Branches
    """
    return Sweep(modulus(frequencies, branches), (2.0 * np.pi * frequencies) ** 2)


def spread(frequencies: Array, branches: Branches) -> Sweep:
    """Return the points for which a model is reduced: those of `sweep`, and the same with stiffer branches.

    Parameters
    ----------
    frequencies : shape (f,)
        Hz.
    branches : Branches
    """
    single = sweep(frequencies, branches)
    return Sweep(
        np.concatenate([single.s, STIFFER * single.s]), np.concatenate([single.squared, single.squared])
    )


@dataclass(frozen=True)
class DynamicModel:
    """A bushing that vibrates about a preload.

    Attributes
    ----------
    reduced : ReducedPencil
    motion : int
        Number of the driven sleeve's motion, among those of `reduced`.
    transfer : bool
        Whether the force is taken at the held sleeve; else where the bushing is driven.
    changes : Changes
        Derivatives of the matrices and of the static force by parameters.
    """

    reduced: ReducedPencil
    motion: int = 0
    transfer: bool = False
    changes: Changes = field(default_factory=Changes)

    def stiffness(self, frequencies: Array, branches: Branches, density: float | None = None) -> Complex:
        """Return the complex stiffness, shape (f,), N/mm or N mm/rad (MPa of a coupon).

        Parameters
        ----------
        frequencies : shape (f,)
            Hz.
        branches : Branches
        density : float or None
            Of the rubber, t/mm^3; None = the one for which the model was reduced.
        """
        return self._entry_of_motion(np.array(self.reduced.stiffness(sweep(frequencies, branches), density)))

    def slopes(
        self, frequencies: Array, branches: Branches, density: float | None = None
    ) -> tuple[Complex, Complex, Complex]:
        """Return the derivatives of `stiffness` by each g, each tau, (branches, f), and by the density, (f,).

        Parameters
        ----------
        frequencies, branches, density
            As for `stiffness`: Hz, t/mm^3.
        """
        by_s, by_density = map(
            self._entry_of_motion, self.reduced.slopes(sweep(frequencies, branches), density)
        )
        count = len(branches)
        by_g, by_tau = np.empty((2, count, len(frequencies)), dtype=np.complex128)
        for i, (g, tau) in enumerate(branches):
            i_omega_tau = 2j * np.pi * frequencies * tau
            by_g[i] = by_s * i_omega_tau / (1.0 + i_omega_tau)
            by_tau[i] = by_s * g * (i_omega_tau / tau) / (1.0 + i_omega_tau) ** 2
        return by_g, by_tau, by_density

    def slopes_by_parameters(
        self, frequencies: Array, branches: Branches, density: float | None = None
    ) -> Complex:
        """Return the derivatives of `stiffness` by the parameters of `changes`, shape (parameters, f).

        Parameters
        ----------
        frequencies, branches, density
            As for `stiffness`: Hz, t/mm^3.
        """
        points = sweep(frequencies, branches)
        slopes = [
            self._entry_of_motion(self.reduced.along(matrix, points, density))
            for matrix in self.changes.matrices
        ]
        return np.array(slopes, dtype=np.complex128).reshape(-1, len(frequencies))

    def matrix(self, frequencies: Array, branches: Branches, density: float | None = None) -> Complex:
        """Return the stiffness against all motions of the driven sleeve, (f, driven, driven), in N, mm and rad.

        Parameters
        ----------
        frequencies, branches, density
            As for `stiffness`: Hz, t/mm^3.
        """
        return self.reduced.stiffness(sweep(frequencies, branches), density)[self.transfer]

    def error(self, frequencies: Array, branches: Branches, density: float | None = None) -> float:
        """Return the bound of the largest relative error of the reduction.

        Parameters
        ----------
        frequencies, branches, density
            As for `stiffness`: Hz, t/mm^3.
        """
        return float(self.reduced.errors(sweep(frequencies, branches), density).max())

    def _entry_of_motion(self, stiffness: Complex) -> Complex:
        return np.asarray(stiffness[int(self.transfer), :, self.motion, self.motion])
