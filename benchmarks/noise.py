"""How well the diagnosis knows the noise of a recording: estimates over truths.

``setup/enter python benchmarks/noise.py``: programs of the development deck, no simulation, half a minute. A cubic
curve takes the place of the bushing's; the noise is drawn, from 0.1 to 1 % of the range, with a correlation from 0 to
0.8 between neighbouring samples. Results: the docstring of `bushcli.likelihood.level`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.decks.drawing import channel  # noqa: E402
from benchmarks.decks.manifest import read  # noqa: E402
from benchmarks.decks.sensing import correlated_noise  # noqa: E402
from bushcli.likelihood.features import features  # noqa: E402
from bushcli.likelihood.level import refine_noise  # noqa: E402
from bushcli.likelihood.noise import NoiseModel, noise_model  # noqa: E402
from bushcli.recording import Recording  # noqa: E402

Array = NDArray[np.float64]

# Noise for each channel of the deck.
DRAWS = 4
# Standard deviation of an independent sample by the recording alone, with features of noise only, and with features
# that contain missing physics too.
STAGES = ("recording", "and features", "physics missing")


def unit(noise: NoiseModel) -> float:
    """Standard deviation of an independent sample."""
    return noise.sigma * float(np.sqrt(noise.correlation_time))


def draw_errors(rng: np.random.Generator) -> Iterator[tuple[str, float, list[tuple[float, float]]]]:
    """Yield program, correlation, and by stage the logarithm of estimate over truth and the degrees of freedom."""
    for entry in read("dev").values():
        for program in entry.programs:
            for _ in range(DRAWS):
                made = channel(program, entry.specimen)
                t, q = np.asarray(made.time), np.asarray(made.displacement)
                x = q / np.abs(q).max()
                force = x + 0.3 * x**3
                span, correlation = float(np.ptp(force)), float(rng.uniform(0.0, 0.8))
                size = 10.0 ** rng.uniform(-1.0, 0.0) / 100.0 * span
                noise = size * correlated_noise(rng.standard_normal(len(x)), correlation)
                rate = np.gradient(q, t)
                missing = np.tanh(3.0 * rate / np.abs(rate).max()) + x**2
                missing *= 0.05 * span * 10.0 ** rng.uniform(-1.5, 0.0)
                recording = Recording(program.mode, q, force + noise, time=t)
                used = np.ones(len(x), dtype=bool)
                first = noise_model(recording, used)
                projection = features(recording, first, used, 0.005)
                models = (
                    first,
                    refine_noise(first, projection, projection.of(-noise)),
                    refine_noise(first, projection, projection.of(missing - noise)),
                )
                truth = size * float(np.sqrt((1.0 + correlation) / (1.0 - correlation)))
                yield (
                    entry.program,
                    correlation,
                    [(float(np.log(unit(n) / truth)), n.freedom) for n in models],
                )


def print_errors(name: str, rows: list[list[tuple[float, float]]]) -> None:
    """Print the errors of some channels by stage."""
    print(f"\n{name}, {len(rows)} channels")
    for stage, values in zip(STAGES, np.array(rows).transpose(1, 0, 2), strict=True):
        error, freedom = values.T
        stated = error * np.sqrt(2.0 * np.minimum(freedom, 1e9))
        low, high = np.percentile(error, [5, 95])
        print(
            f"  {stage:16s} median {np.median(error):+.2f}, rms {np.sqrt(np.mean(error**2)):.2f}, "
            f"5 to 95 % {low:+.2f} to {high:+.2f}; in units of the uncertainty stated {np.sqrt(np.mean(stated**2)):.2f}"
        )


def main() -> None:
    """Print the errors by program, and by correlation."""
    draws = list(draw_errors(np.random.default_rng(0)))
    for program in ("rich", "loop", "ramp"):
        print_errors(program, [errors for kind, _, errors in draws if kind == program])
    for low, high in ((0.0, 0.3), (0.3, 0.6), (0.6, 0.8)):
        print_errors(
            f"rich, correlation {low} to {high}",
            [errors for kind, r, errors in draws if kind == "rich" and low <= r < high],
        )


if __name__ == "__main__":
    main()
