"""Intervals of `bushcli inverse` for drawn recordings: how many hold the true parameters.

``setup/enter python benchmarks/coverage.py``. A force k1 q + k3 q^3 + k5 q^5 is recorded along cycles of the
displacement, with errors of a first-order autoregression, and k1, k3 and k5 are fitted by least squares. The results
are in docs/identification.md.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from bushcli.curve.misfit import correlation_time  # noqa: E402
from bushcli.inverse.certainty import uncertainty  # noqa: E402

Array = NDArray[np.float64]

DRAWS = 1500


def correlated_errors(rng: np.random.Generator, n: int, rho: float) -> Array:
    """Return n errors of variance 1 whose neighbours have the correlation rho."""
    error = rng.standard_normal(n)
    error[1:] *= np.sqrt(1.0 - rho**2)
    for i in range(1, n):
        error[i] += rho * error[i - 1]
    return error


def coverages(n: int, rho: float, rng: np.random.Generator) -> tuple[float, float]:
    """Return the share of intervals that hold the truth: as computed, and with the residuals' correlation time."""
    turns = 1 if n < 100 else 4
    q = np.interp(np.linspace(0.0, turns, n) % 1.0, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])
    rows = np.column_stack([q, q**3, q**5])
    inverse = np.linalg.inv(rows.T @ rows)
    new, old = [], []
    for _ in range(DRAWS):
        force = correlated_errors(rng, n, rho)
        x = inverse @ rows.T @ force
        channel = SimpleNamespace(scale=np.ones(n), recording=SimpleNamespace(force=force))
        problem = SimpleNamespace(channels=[channel], forces=lambda x: [(rows @ x, rows)])
        estimate = uncertainty(problem, x)  # type: ignore[arg-type]
        new.append(np.abs(x) < estimate.quantile * np.sqrt(np.diag(estimate.covariance)))
        rest = force - rows @ x
        before = correlation_time(rest - rest.mean()) * float(rest @ rest) / (n - 3) * np.diag(inverse)
        old.append(np.abs(x) < 1.96 * np.sqrt(before))
    return float(np.mean(new)), float(np.mean(old))


def main() -> None:
    """Print a table: samples, correlation of neighbours, share of intervals that hold the truth, and as it was."""
    rng = np.random.default_rng(20261126)
    for n in (31, 61, 200, 400, 2000):
        for rho in (0.0, 0.5, 0.8, 0.9, 0.95):
            new, old = coverages(n, rho, rng)
            print(f"| {n} | {rho:g} | {100 * new:.1f} % | {100 * old:.1f} % |", flush=True)


if __name__ == "__main__":
    main()
