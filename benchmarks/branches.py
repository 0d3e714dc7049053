"""What Maxwell branches leave of other relaxation: the error of form of tables of dynamic stiffness.

One, two and three branches are fitted to 200 tables of fractional Kelvin-Voigt, Cole-Cole and Havriliak-Negami elements
over two to three decades of frequency. Printed are the misfits (rms, relative), as shares of what a law without
relaxation leaves: median, and standard deviation of the logarithm; and the participation ratio of its features.

Usage: ``setup/enter python -m benchmarks.branches``.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bushcli.likelihood.features import TABLE_DEGREE

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def element(rng: np.random.Generator, kind: int, omega: Array) -> Complex:
    """Return K* of an element over its stiffness at rest."""
    beta, g = rng.uniform(0.15, 0.6), rng.uniform(0.2, 2.0)
    turned = 1j * omega * 10 ** rng.uniform(-4.0, -1.0)
    if kind == 0:
        return np.asarray(1 + 0.25 * g * (1j * omega / 30.0) ** beta)
    if kind == 1:
        return np.asarray(1 + g * turned**beta / (1 + turned**beta))
    return np.asarray(1 + g * (1 - 1 / (1 + turned**beta) ** rng.uniform(0.4, 1.0)))


def misfit_and_participation(
    rng: np.random.Generator, K: Complex, omega: Array, count: int
) -> tuple[float, float]:
    """Return the misfit of branches, the best of three searches, and the share of its features that take part."""

    def misfit(p: Array) -> Array:
        g, turned = np.exp(p[:count]), 1j * omega[:, None] * np.exp(p[count:-1])
        off = (np.exp(p[-1]) * (1 + (g * turned / (1 + turned)).sum(axis=1)) - K) / np.abs(K)
        return np.concatenate([off.real, off.imag])

    times = np.log(1 / np.geomspace(omega.max(), omega.min(), count + 2)[1:-1])
    ends = []
    for _ in range(3):
        at = [np.log(0.1) + 0.5 * rng.standard_normal(count), times + 0.3 * rng.standard_normal(count)]
        ends.append(least_squares(misfit, np.concatenate([*at, [np.log(np.abs(K).min())]])))
    best = min(ends, key=lambda fit: float(fit.cost))
    basis, _ = np.linalg.qr(
        np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, len(omega)), TABLE_DEGREE)
    )
    z = (best.fun.reshape(2, -1) @ basis).ravel()
    return float(np.sqrt(2.0 * best.cost / len(omega))), float(np.sum(z**2) ** 2 / np.sum(z**4) / len(z))


def main() -> None:
    """Draw, fit, print."""
    rng, rows = np.random.default_rng(1), []
    for i in range(200):
        omega = 2 * np.pi * np.geomspace(10 ** rng.uniform(-1.0, 0.5), 10 ** rng.uniform(1.7, 2.6), 16)
        K = element(rng, i % 3, omega)
        factor = np.sum(K.real / np.abs(K) ** 2) / np.sum(1 / np.abs(K) ** 2)
        plain = float(np.sqrt(np.mean(np.abs(factor / K - 1) ** 2)))
        rows.append(
            [misfit_and_participation(rng, K, omega, count) / np.array([plain, 1.0]) for count in (1, 2, 3)]
        )
    for count, (shares, parts) in enumerate(np.array(rows).transpose(1, 2, 0), start=1):
        spread = np.std(np.log(shares))
        sys.stdout.write(f"{count} branches leave {np.median(shares):.3f} (spread {spread:.2f}), ")
        sys.stdout.write(f"in {np.median(parts):.2f} of the features\n")


if __name__ == "__main__":
    main()
