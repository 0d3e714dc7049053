"""Whether `bushcli inverse` ends above what it reaches from other starts, or above a model that it contains.

``setup/enter python -m benchmarks.ten_starts RECORDINGS [NAME ...]``: RECORDINGS is a folder with ``coupons/hnbr50``
and ``component/hnbr50_shear``, which are not part of the project; NAME is one of ``MODELS``. Prints a row for each
model: the misfit of `inverse` from its own start, and the lowest that its searches reach from ten starts, whose times,
paths and gaps are drawn from their priors, and whose amplitudes from half to twice their start values.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks import practice
from bushcli.case import load_case
from bushcli.curve.misfit import rms_percent
from bushcli.effects.prior import Prior
from bushcli.inverse import Task, identify
from bushcli.inverse.channel import Channel
from bushcli.inverse.minimum_search import first_minimum
from bushcli.inverse.problem import LeastSquaresProblem

Array = NDArray[np.float64]

STARTS, SEED = 10, 1
BRANCHES = "g1 = 0.2, tau1 = 10.0", "g2 = 0.1, tau2 = 1.0", "g3 = 0.1, tau3 = 100.0"


def viscosity(count: int) -> str:
    """Return the table of an effect with some branches."""
    return f'[[effects]]\nname = "viscoelasticity"\nparameters = {{ {", ".join(BRANCHES[:count])} }}\n'


FRICTION, PAYNE = ('[[effects]]\nname = "friction"\n', '[[effects]]\nname = "payne"\n')
#: Models of each recording: those that contain each other stand one after the other.
MODELS = {
    "hnbr50 loop": {
        "viscosity, one branch": viscosity(1),
        "two branches": viscosity(2),
        "three branches": viscosity(3),
        "friction": FRICTION,
        "friction, one branch": FRICTION + viscosity(1),
        "friction, two branches": FRICTION + viscosity(2),
        "payne": PAYNE,
    },
    "hnbr50": {
        "viscosity, one branch": viscosity(1),
        "two branches": viscosity(2),
        "three branches": viscosity(3),
        "friction, one branch": FRICTION + viscosity(1),
        "payne": PAYNE,
    },
    "hnbr50 shear": {"viscosity, one branch": viscosity(1), "friction, one branch": FRICTION + viscosity(1)},
}


def drawn(task: Task, random: np.random.Generator, duration: float) -> Array:
    """Return a start (parameters,): shapes from their priors, amplitudes about their start values."""
    start, bounds = task.vectors()
    priors: dict[str, Prior | None] = {
        one.full_name(p): p.prior if p.off is None else None for one in task.effects for p in one.parameters
    }
    for i, name in enumerate(task.names):
        prior = priors.get(name)
        if prior is not None and prior.is_logarithmic:
            unit = duration if prior.of == "duration" else 1.0
            low, high = prior.low, prior.high
            if prior.shape == "log_normal":
                low, high = prior.low * np.exp(-prior.high), prior.low * np.exp(prior.high)
            start[i] = unit * np.exp(random.uniform(np.log(low), np.log(high)))
        elif name in priors:
            start[i] *= np.exp(random.uniform(-np.log(2.0), np.log(2.0)))
    return bounds.clip(start)


def rms(problem: LeastSquaresProblem, x: Array) -> list[float]:
    """Return the misfit of each channel in % of its range."""
    forces = problem.forces(x)
    assert forces is not None
    misfits = []
    for channel, (force, _) in zip(problem.channels, forces, strict=True):
        assert isinstance(channel, Channel)
        used = np.isfinite(channel.scale)
        misfits.append(rms_percent((force - channel.measured)[used], channel.measured[used]))
    return misfits


def row(folder: Path, model: str, table: str) -> str:
    """Return the row of one model of a case."""
    given = (folder / "case.toml").read_text()
    case = folder / "with.toml"
    case.write_text(given + table)
    task = Task(load_case(case), "yeoh")
    began = time.process_time()
    fit = identify(task)
    own = [curve.rms_percent for curve in fit.curves]
    seconds = time.process_time() - began
    random, ends = np.random.default_rng(SEED), []
    for _ in range(STARTS):
        problem, curves, _ = task.problem()
        duration = max(float(np.ptp(one.recording.time)) for one in curves if one.recording.time is not None)
        end = first_minimum(problem, drawn(task, random, duration), task.loss)
        if end is not None:
            ends.append((end.minimum.cost, rms(problem, end.minimum.x)))
    cost, best = min(ends)
    count = sum(one <= 1.01 * min(cost, fit.cost) for one, _ in ends)
    words = [", ".join(f"{value:.3f}" for value in values) for values in (own, best)]
    ends_at = "yes" if fit.converged else "no"
    ratio = float(np.sqrt(fit.cost / cost))
    return f"| {model} | {words[0]} | {ends_at} | {words[1]} | {ratio:.3f} | {count} | {fit.sweeps} | {seconds:.0f} |"


def main(source: Path, names: list[str]) -> None:
    """Print the tables."""
    out = sys.stdout
    for name in names or MODELS:
        out.write(
            f"\n{name}\n\n| model | rms, % | converged | best of ten | ratio | as low | evaluations | s |\n"
        )
        out.write("| --- " * 8 + "|\n")
        for model, table in MODELS[name].items():
            with tempfile.TemporaryDirectory() as folder:
                write = practice.shear if name == "hnbr50 shear" else practice.coupon
                write(source, Path(folder), name)
                out.write(row(Path(folder), model, table) + "\n")
                out.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
