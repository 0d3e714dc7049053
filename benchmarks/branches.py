"""What Maxwell branches leave of other relaxation: the error of form of tables of dynamic stiffness.

One, two and three branches are fitted to 200 tables of fractional Kelvin-Voigt, Cole-Cole and Havriliak-Negami elements
over two to three decades of frequency. Printed are the misfits (rms, relative), as shares of what a law without
relaxation leaves: median, and standard deviation of the logarithm; and the participation ratio of its features. Then
what a fourth branch, or an effect of the rig, leaves of the misfit of three branches: what a relaxation by another
formula has in common with that effect. The same is done with the law of `payne` and other laws of relaxation that
amplitude thins, at three amplitudes.

Usage: ``setup/enter python -m benchmarks.branches``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares

from benchmarks.payne import laws
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


def faultless(K: Complex, omega: Array, size: float) -> Complex:
    """Return what a rig without faults measures: K*."""
    return K


# What a rig measures in place of K*, by its effect; the size is relative to the largest |K*|, or an angle in rad.
RIGS: dict[str, Callable[[Complex, Array, float], Complex]] = {
    "a lag": lambda K, omega, size: K * np.exp(-1j * size * omega / omega.max()),
    "a mass": lambda K, omega, size: K - size * np.abs(K).max() * (omega / omega.max()) ** 2,
    "a resonance": lambda K, omega, size: K / (1 - np.clip(size, -0.9, 0.9) * (omega / omega.max()) ** 2),
    "a compliance": lambda K, omega, size: 1 / (1 / K + np.clip(size, -0.9, 0.9) / np.abs(K).max()),
}


def fitted(
    rng: np.random.Generator,
    K: Complex,
    omega: Array,
    count: int,
    rig: Callable[[Complex, Array, float], Complex] = faultless,
    starts: Sequence[Array] = (),
) -> OptimizeResult:
    """Return the fit of branches on a rig, the best of three searches and of given starts; its size is last."""

    def misfit(p: Array) -> Array:
        g, turned = np.exp(p[:count]), 1j * omega[:, None] * np.exp(p[count:-2])
        simulated = rig(np.exp(p[-2]) * (1 + (g * turned / (1 + turned)).sum(axis=1)), omega, p[-1])
        off = (simulated - K) / np.abs(K)
        return np.concatenate([off.real, off.imag])

    times = np.log(1 / np.geomspace(omega.max(), omega.min(), count + 2)[1:-1])
    ends = [least_squares(misfit, start) for start in starts]
    for _ in range(3):
        at = [np.log(0.1) + 0.5 * rng.standard_normal(count), times + 0.3 * rng.standard_normal(count)]
        ends.append(least_squares(misfit, np.concatenate([*at, [np.log(np.abs(K).min()), 0.0]])))
    return min(ends, key=lambda fit: float(fit.cost))


def participation(misfit: Array) -> float:
    """Return the share of the features of a misfit that take part in it."""
    number = len(misfit) // 2
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, number), TABLE_DEGREE))
    z = (misfit.reshape(2, -1) @ basis).ravel()
    return float(np.sum(z**2) ** 2 / np.sum(z**4) / len(z))


def thinned_element(rng: np.random.Generator, kind: int, amplitude: Array, omega: Array) -> Complex:
    """Return K* of a relaxation that amplitude thins, over its stiffness at rest, by another law than `payne`.

    Half of them are thinned Cole-Cole elements, the others spectra on the mean speed of a clock.
    """
    g = rng.uniform(0.5, 2.0)
    if kind == 0:
        strain, power = 10 ** rng.uniform(-2.3, -1.7), rng.uniform(1.0, 3.0)
        turned = 1j * omega * 10 ** rng.uniform(-3.0, -0.5) / (1 + (amplitude / strain) ** power)
        beta = rng.uniform(0.2, 0.4)
        return np.asarray(1 + g * turned**beta / (1 + turned**beta))
    others = [law for law in laws() if law[0].endswith("m") and "mean speed" in law[0]]
    _, _, response, starts = others[int(rng.integers(len(others)))]
    return np.asarray(1 + g * response(np.array([rng.uniform(*ends) for ends in starts]), amplitude, omega))


def fitted_payne(
    K: Complex,
    amplitude: Array,
    omega: Array,
    starts: Sequence[Array],
    rig: Callable[[Complex, Array, float], Complex] = faultless,
) -> OptimizeResult:
    """Return the fit of the law of `payne` on a rig, the best of some starts; the size of its effect is last."""
    _, _, response, _ = next(laws())

    def misfit(p: Array) -> Array:
        # Most are logarithms.
        p = np.clip(p, -30.0, 30.0)
        with np.errstate(all="ignore"):
            relaxing = np.exp(p[0]) + np.exp(p[1]) * response(p[2:-1], amplitude, omega)
            off = (rig(relaxing, omega, p[-1]) - K) / np.abs(K)
        return np.nan_to_num(np.concatenate([off.real, off.imag]), nan=10.0, posinf=10.0, neginf=10.0)

    fits = [least_squares(misfit, start, x_scale="jac", max_nfev=150) for start in starts]
    return min(fits, key=lambda fit: float(fit.cost))


def thinned(count: int) -> None:
    """Draw, fit and print the same of relaxations that amplitude thins."""
    rng, left = np.random.default_rng(2), list[list[float]]()
    _, _, _, ends = next(laws())
    for i in range(count):
        frequency = np.geomspace(10 ** rng.uniform(-0.3, 0.5), 10 ** rng.uniform(1.9, 2.4), 8)
        omega = 2 * np.pi * np.tile(frequency, 3)
        amplitude = np.repeat(10 ** rng.uniform(-2.9, -2.5) * np.array([1.0, 5.0, 25.0]), 8)
        K = thinned_element(rng, i % 2, amplitude, omega)
        size = np.abs(K)
        # Without a loss, or hardly thinned, it is no filled rubber.
        if not np.isfinite(K).all() or (K.imag <= 0).any() or np.ptp(size[::8]) < 0.1 * size.max():
            continue
        at = [np.log(size.min()), np.log(np.ptp(size) + 0.1)]
        starts = [np.array([*at, *(rng.uniform(*end) for end in ends), 0.0]) for _ in range(3)]
        alone = fitted_payne(K, amplitude, omega, starts)
        beside = [fitted_payne(K, amplitude, omega, [alone.x, *starts], rig) for rig in RIGS.values()]
        left.append([float(np.sqrt(fit.cost / alone.cost)) for fit in beside])
    for name, share in zip(RIGS, np.transpose(left), strict=True):
        low, middle = np.quantile(share, [0.05, 0.5])
        sys.stdout.write(
            f"payne and {name} leave {middle:.2f} of what payne leaves, one in twenty {low:.2f}\n"
        )


def main() -> None:
    """Draw, fit, print."""
    rng = np.random.default_rng(1)
    shares, parts, left, is_late = list[list[float]](), list[list[float]](), list[list[float]](), list[bool]()
    for i in range(200):
        omega = 2 * np.pi * np.geomspace(10 ** rng.uniform(-1.0, 0.5), 10 ** rng.uniform(1.7, 2.6), 16)
        K = element(rng, i % 3, omega)
        factor = np.sum(K.real / np.abs(K) ** 2) / np.sum(1 / np.abs(K) ** 2)
        plain = float(np.sqrt(np.mean(np.abs(factor / K - 1) ** 2)))
        fits = [fitted(rng, K, omega, count) for count in (1, 2, 3, 4)]
        shares.append([float(np.sqrt(2.0 * fit.cost / len(omega))) / plain for fit in fits])
        parts.append([participation(fit.fun) for fit in fits])
        beside = [fitted(rng, K, omega, 3, rig, [fits[2].x]) for rig in RIGS.values()]
        left.append([float(np.sqrt(fit.cost / fits[2].cost)) for fit in (fits[3], *beside)])
        is_late.append(beside[0].x[-1] > 0.0)
    for count, (share, part) in enumerate(
        zip(np.transpose(shares), np.transpose(parts), strict=True), start=1
    ):
        sys.stdout.write(
            f"{count} branches leave {np.median(share):.3f} (spread {np.std(np.log(share)):.2f}), "
        )
        sys.stdout.write(f"in {np.median(part):.2f} of the features\n")
    for name, share in zip(("a fourth branch", *RIGS), np.transpose(left), strict=True):
        low, middle = np.quantile(share, [0.05, 0.5])
        sys.stdout.write(f"three branches and {name} leave {middle:.2f} of that, one in twenty {low:.2f}\n")
    sys.stdout.write(f"lags of the force behind the motion: {np.mean(is_late):.2f}\n")
    thinned(30)


if __name__ == "__main__":
    main()
