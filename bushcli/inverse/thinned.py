"""Constants of the Payne effect, identified from a table of dynamic moduli over amplitude.

E* = E_inf + E_1 s(omega, gamma), s the first harmonic of `cases.sine.ThinnedSpectrum` with moduli that sum to 1. E_inf
and E_1 are eliminated (variable projection); the other constants are searched for from several random starts, because
spectrum and clock trade against each other.

References
----------
Golub and Pereyra (2003), Separable nonlinear least squares: the variable projection method, Inverse Problems 19:R1-R26,
doi:10.1088/0266-5611/19/2/201.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from bushcli.inverse.spectrum import misfit_percent
from bushcli.recording.dynamic.table import DynamicTable
from cases.sine import ThinnedSpectrum
from forms.branches.payne import spectrum

Array = NDArray[np.float64]

# Ranges of the starts: the longest time over a period, decades, the clock's run in a period over a period at the
# geometric mean of the amplitudes, a0 over that mean, and the exponent, all as logarithms; then the slope.
RANGES = ((-2.0, 8.0), (0.5, 1.8), (-2.0, 4.0), (-3.0, 3.0), (-0.7, 1.2), (-0.3, 0.3))
# Bounds on the same: a spectrum of less than a third of a decade is one branch, one of more than ten has branches that
# no recording sees.
BOUNDS = ((-12.0, 25.0), (-1.0, 2.3), (-12.0, 14.0), (-12.0, 6.0), (-3.0, 2.3), (-1.5, 1.5))
# Twelve starts: on four measured sweeps the best of the first six was within 3 % of the best of forty.
STARTS, SEED, MOST = 12, 0, 100


@dataclass(frozen=True)
class ThinnedFit:
    """Constants that were identified from a table.

    Attributes
    ----------
    temperature : float
        Mean of the rows, degrees C; nan where the table has none.
    equilibrium, modulus : float
        E_inf and E_1, MPa.
    constants : mapping
        Of the effect `payne`, by name.
    shear : float
        Shear strain per unit of the coupon's strain.
    storage_percent, loss_percent : float
        Misfit, rms relative, in %.
    rows : int
        Number of rows.
    """

    temperature: float
    equilibrium: float
    modulus: float
    constants: dict[str, float]
    shear: float
    storage_percent: float
    loss_percent: float
    rows: int

    def at(self, amplitude: Array, frequency: Array) -> NDArray[np.complex128]:
        """Return E* (n,), MPa.

        Parameters
        ----------
        amplitude : shape (n,)
            Strain of the coupon, a ratio.
        frequency : shape (n,)
            Hz.
        """
        return self.equilibrium + self.modulus * _harmonics(self.constants, self.shear * amplitude, frequency)


def _harmonics(constants: Mapping[str, float], gamma: Array, frequency: Array) -> NDArray[np.complex128]:
    """Return s (n,) of a spectrum whose moduli sum to 1."""
    moduli, times = _unit(constants)
    clock = (constants[name] for name in ("path", "offset", "exponent"))
    thinned = ThinnedSpectrum(moduli / moduli.sum(), times, *clock)
    return thinned.harmonics(gamma, frequency)[0]


def _unit(constants: Mapping[str, float]) -> tuple[Array, Array]:
    """Moduli at g = 1, and times."""
    return spectrum(1.0, *(constants[name] for name in ("tau", "decades", "slope")))


def fit_thinned(table: DynamicTable, shear: float) -> ThinnedFit:
    """Return the constants that fit the table of a coupon best: of one temperature, with amplitudes.

    `shear` is the shear strain sqrt(2 dev eps : dev eps) per unit of the coupon's strain: sqrt(3) in tension.
    """
    gamma, frequency = shear * table.amplitude, table.frequency
    middle, pace = float(np.exp(np.log(gamma).mean())), float(np.exp(np.log(frequency).mean()))

    def constants(p: Array) -> dict[str, float]:
        tau, decades, run, offset, exponent = map(float, np.exp(p[:5]))
        # In a period the clock runs 4 a c (a0 + a)^m on.
        path = run / pace / (4.0 * middle) / (middle * (1.0 + offset)) ** exponent
        of_spectrum = {"tau": tau / pace, "decades": decades, "slope": float(p[5])}
        return of_spectrum | {"path": path, "offset": offset * middle, "exponent": exponent}

    def solved(p: Array) -> tuple[Array, Array]:
        s = _harmonics(constants(p), gamma, frequency)
        at_rest = np.concatenate([1.0 / table.storage, np.zeros(len(s))])
        design = np.column_stack([at_rest, np.concatenate([s.real / table.storage, s.imag / table.loss])])
        values, _ = nnls(design, np.ones(len(design)))
        return values, design @ values - 1.0

    # Logarithms of the constants with the least misfit of several searches.
    random, (low, high) = np.random.default_rng(SEED), np.array(BOUNDS).T
    starts = [random.uniform(*np.array(RANGES).T) for _ in range(STARTS)]
    ends = [least_squares(lambda p: solved(p)[1], p, bounds=(low, high), max_nfev=MOST) for p in starts]
    best = np.asarray(min(ends, key=lambda end: float(end.cost)).x)
    values, residual = solved(best)
    equilibrium, modulus = map(float, values)
    identified = constants(best)
    g = {"g": float(modulus / equilibrium / _unit(identified)[0].sum()) if equilibrium else np.inf}
    temperature, misfit = float(np.mean(table.temperature)), misfit_percent(residual)
    return ThinnedFit(temperature, equilibrium, modulus, g | identified, shear, *misfit, len(table))
