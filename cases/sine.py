"""Harmonics of a spectrum of Maxwell branches on a clock of time and path, in a steady sine.

In one dimension the branches obey dh_k = d gamma - h_k dz / tau_k on the clock dz = dt + (a0 + a)^m (b dt
+ c |d gamma|), and a is the amplitude of the sine. Between two reversals the clock is known, the equations are linear,
and h changes its sign from one reversal to the next: half a cycle is integrated exactly for a strain that is linear
within its steps.
The clock stands still at the reversals and runs fastest in between. With its mean speed in its place, which would have
a closed form, the loss would be up to 30 % higher.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Steps of half a cycle: the first harmonic is then right to 1e-4 (`tests/unit/test_amplitude.py`).
STEPS = 96
# Amplitudes per decade of the table that is interpolated, and the smallest, where the law is linear.
PER_DECADE, SMALLEST = 8, 1e-6
# A branch's harmonics depend on two numbers alone, radians and path over its time; each is tabulated over so many
# decades about 1, beyond which the branch is elastic, or has no stress, to 1e-7.
DECADES = 7
# Further amplitudes of a table: interpolation is wrong beside its end.
BEYOND = 6


@dataclass(frozen=True)
class ThinnedSpectrum:
    """Constants of the spectrum and its clock.

    Attributes
    ----------
    moduli : shape (k,)
        Over the law's initial shear modulus.
    times : shape (k,)
        Relaxation times at rest, s.
    path : float
        c, s.
    offset, exponent : float
        a0 and m.
    pace : float
        b, 1.
    """

    moduli: Array
    times: Array
    path: float
    offset: float
    exponent: float
    pace: float = 0.0

    def branches(self) -> list[tuple[float, float]]:
        """Return modulus and relaxation time (s) of each branch in a motion without amplitude."""
        return list(zip(map(float, self.moduli), map(float, self.times), strict=True))

    def thinning(self, amplitude: Array) -> Array:
        """Return what path and pace are multiplied by at an amplitude, shape (n,)."""
        return np.asarray((self.offset + amplitude) ** self.exponent)

    def harmonics(
        self, amplitude: Array, frequency: Array | float, third: bool = True
    ) -> tuple[Complex, ...]:
        """Return the first and the third harmonic of the stress over the strain's, shape (..., n), in units of mu.

        Parameters
        ----------
        amplitude : shape (n,)
            Of the shear strain.
        frequency : float, or shape (n,) or (..., 1)
            Hz.
        third : bool
            Whether the third harmonic is asked for; else the first one is alone.
        """
        thinning = self.thinning(amplitude)
        numbers = (
            ((1.0 + self.pace * thinning) / (2.0 * np.pi * np.asarray(frequency)))[..., None] / self.times,
            (amplitude * self.path * thinning)[:, None] / self.times,
        )
        limits = 10.0**-DECADES, 10.0**DECADES
        places = [PER_DECADE * (np.log10(np.clip(values, *limits)) + DECADES) for values in numbers]
        return tuple(
            interpolate(coefficients, *np.broadcast_arrays(*places)) @ self.moduli
            for coefficients in _branch()[: 1 + third]
        )

    def responses(self, frequency: Array, largest: float, third: bool = False) -> list[TabulatedHarmonics]:
        """Return the harmonics at each frequency as a function of the amplitude, up to the largest.

        Parameters
        ----------
        frequency : shape (m,)
            Hz.
        largest : float
            Shear strain, a ratio.
        third : bool
            Whether the third harmonic is asked for, too.
        """
        from scipy.ndimage import spline_filter1d  # 0.1 s: only where it is needed

        last = int(np.ceil(PER_DECADE * np.log10(max(largest, 10.0 * SMALLEST) / SMALLEST)))
        nodes = SMALLEST * 10.0 ** (np.arange(last + BEYOND) / PER_DECADE)
        harmonics = np.stack(self.harmonics(nodes, frequency[:, None], third), axis=1)
        return [
            TabulatedHarmonics(coefficients, last)
            for coefficients in spline_filter1d(harmonics, output=np.complex128, mode="mirror")
        ]


@dataclass(frozen=True)
class TabulatedHarmonics:
    """Harmonics over the logarithm of the amplitude.

    Attributes
    ----------
    coefficients : shape (1 or 2, k)
        Of splines of the first and, where it was asked for, the third harmonic, `PER_DECADE` per decade of the
        amplitude above `SMALLEST`.
    last : int
        Place of the largest amplitude.
    beside : complex
        Modulus of branches beside the spectrum, over mu.
    """

    coefficients: Complex
    last: int
    beside: complex = 0.0

    def first(self, amplitude: Array) -> Complex:
        """Return the first harmonic, shape (n,)."""
        return interpolate(self.coefficients[0], self._places(amplitude)) + self.beside

    def third(self, amplitude: Array) -> Complex:
        """Return the third harmonic, shape (n,)."""
        return interpolate(self.coefficients[1], self._places(amplitude))

    def loads(self, amplitude: Array, weights: Complex) -> Complex:
        """Return the product of weights (n,) with the first harmonic at amplitudes (n,), as loads (k + 1,).

        They are those of the coefficients (k,) and of what is beside, for `loaded` of any table up to the same
        amplitude.
        """
        places = self._places(amplitude)
        node = np.floor(places).astype(int)
        x = places - node
        # The cubic B-spline at the four nodes about each place; beyond the first node the table is mirrored.
        taps = np.array([(1 - x) ** 3, 4 - 6 * x**2 + 3 * x**3, 1 + 3 * x + 3 * x**2 - 3 * x**3, x**3]) / 6.0
        nodes = np.abs(node + np.arange(-1, 3)[:, None]).ravel()
        count = self.coefficients.shape[1]
        real, imaginary = (
            np.bincount(nodes, (taps * w).ravel(), count) for w in (weights.real, weights.imag)
        )
        return np.append(real + 1j * imaginary, weights.sum())

    def loaded(self, loads: Complex) -> complex:
        """Return the product with loads of `loads`."""
        return complex(self.coefficients[0] @ loads[:-1] + self.beside * loads[-1])

    def _places(self, amplitude: Array) -> Array:
        return np.minimum(PER_DECADE * np.log10(np.maximum(amplitude, SMALLEST) / SMALLEST), self.last)


def interpolate(coefficients: Complex, *places: Array) -> Complex:
    """Return the values (...) of a cubic spline at places (...) along each axis, in steps of its table."""
    from scipy.ndimage import map_coordinates

    values = map_coordinates(coefficients, places, output=np.complex128, prefilter=False, mode="mirror")
    return np.asarray(values)


@cache
def _branch() -> tuple[Complex, Complex]:
    """Spline coefficients of the harmonics of one branch, by radians over omega tau and by path over tau."""
    from scipy.ndimage import spline_filter

    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, STEPS + 1)
    sine, width = np.sin(turn), turn[1] - turn[0]
    rise = np.diff(sine)
    number = 10.0 ** np.linspace(-DECADES, DECADES, 2 * DECADES * PER_DECADE + 1)
    ratio = width * number[:, None] + rise[:, None, None] * number
    decay, gained = np.exp(-ratio), -np.expm1(-ratio) / ratio
    h = np.zeros((STEPS + 1, *ratio.shape[1:]))
    left = np.ones_like(h)
    for i in range(STEPS):
        h[i + 1] = h[i] * decay[i] + gained[i] * rise[i]
        left[i + 1] = left[i] * decay[i]
    h -= h[-1] / (1.0 + left[-1]) * left
    weights = np.full(STEPS + 1, 2.0 / np.pi * width)
    weights[[0, -1]] *= 0.5
    first, third = (np.tensordot(weights * (np.sin(n * turn) + 1j * np.cos(n * turn)), h, 1) for n in (1, 3))
    return tuple(spline_filter(harmonic, output=np.complex128, mode="mirror") for harmonic in (first, third))
