"""Harmonics of a spectrum of Maxwell branches on a clock of time and path, in a steady sine.

In one dimension the branches obey dh_k = d gamma - h_k dz / tau_k on the clock dz = dt + c (a0 + a)^m |d gamma|, and a
is the amplitude of the sine. Between two reversals the clock is known, the equations are linear, and h changes its sign
from one reversal to the next: half a cycle is integrated exactly for a strain that is linear within its steps.
The clock stands still at the reversals and runs fastest in between. With its mean speed in its place, which would have
a closed form, the loss would be up to 30 % higher.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Steps of half a cycle: the first harmonic is then right to 1e-4 (`tests/unit/test_amplitude.py`).
STEPS = 96
if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# Amplitudes per decade of the table that is interpolated, and the smallest, where the law is linear.
PER_DECADE, SMALLEST = 8, 1e-6


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
    """

    moduli: Array
    times: Array
    path: float
    offset: float
    exponent: float

    def branches(self) -> list[tuple[float, float]]:
        """Return modulus and relaxation time (s) of each branch in a motion without amplitude."""
        return list(zip(map(float, self.moduli), map(float, self.times), strict=True))

    def speed(self, amplitude: Array) -> Array:
        """Return how far the clock runs per unit of shear strain, s."""
        return np.asarray(self.path * (self.offset + amplitude) ** self.exponent)

    def harmonics(self, amplitude: Array, frequency: float) -> tuple[Complex, Complex]:
        """Return the first and the third harmonic of the stress over the strain's, shape (n,), in units of mu.

        Parameters
        ----------
        amplitude : shape (n,)
            Of the shear strain.
        frequency : float
            Hz.
        """
        turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, STEPS + 1)
        sine, width = np.sin(turn), turn[1] - turn[0]
        rise = np.diff(sine)
        path = (amplitude * self.speed(amplitude))[:, None] * rise
        clock = width / (2.0 * np.pi * frequency) + path
        ratio = clock[:, :, None] / self.times
        kept, gained = np.exp(-ratio), -np.expm1(-ratio) / ratio
        h = np.zeros((len(amplitude), STEPS + 1, len(self.times)))
        left = np.ones_like(h)
        for i in range(STEPS):
            h[:, i + 1] = h[:, i] * kept[:, i] + gained[:, i] * rise[i]
            left[:, i + 1] = left[:, i] * kept[:, i]
        h -= (h[:, -1] / (1.0 + left[:, -1]))[:, None] * left
        stress = h @ self.moduli
        weights = np.full(STEPS + 1, width)
        weights[[0, -1]] *= 0.5
        first, third = (
            (2.0 / np.pi)
            * (stress @ (weights * np.sin(n * turn)) + 1j * (stress @ (weights * np.cos(n * turn))))
            for n in (1, 3)
        )
        return np.asarray(first), np.asarray(third)

    def response(self, frequency: float, largest: float) -> TabulatedHarmonics:
        """Return the harmonics as a function of the amplitude, up to the largest.

        Parameters
        ----------
        frequency : float
            Hz.
        largest : float
            Shear strain, a ratio.
        """
        decades = np.log10(max(largest, 10.0 * SMALLEST) / SMALLEST)
        nodes = np.linspace(0.0, decades, int(np.ceil(PER_DECADE * decades)) + 1)
        found = self.harmonics(SMALLEST * 10.0**nodes, frequency)
        from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed

        return TabulatedHarmonics(CubicSpline(nodes, np.array(found), axis=1), float(decades))


@dataclass(frozen=True)
class TabulatedHarmonics:
    """Harmonics over the logarithm of the amplitude, decades above `SMALLEST`."""

    spline: CubicSpline
    decades: float

    def __call__(self, amplitude: Array) -> tuple[Complex, Complex]:
        """Return the first and the third harmonic, shape (n,)."""
        place = np.log10(np.maximum(amplitude, SMALLEST) / SMALLEST)
        first, third = self.spline(np.minimum(place, self.decades))
        return first, third
