"""Whether `bushcli inverse` ends above what it reaches from other starts, or above a model that it contains.

``setup/enter python -m benchmarks.ten_starts RECORDINGS [NAME ...]``: RECORDINGS is a folder with ``coupons/hnbr50``
and ``component/hnbr50_shear``, which are not part of the project; NAME is one of ``MODELS``. Prints a row for each
model: the misfit of `inverse` from its own start, and the lowest that its searches reach from ten starts, whose times,
paths and gaps are drawn from their priors, and whose amplitudes from half to twice their start values.

``setup/enter python -m benchmarks.ten_starts --answers CASES RESULTS [COUNT]`` does the same for the answers of a deck
that has been run: CASES/NAME/case.toml and RESULTS/NAME/result.json, in order, as many as have an effect. The misfit of
the answer is compared with the best of the eleven searches with its effects and branches, the first of which begins at
the answer's values.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

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


def draw_start(task: Task, random: np.random.Generator, duration: float) -> Array:
    """Return a start (parameters,): shapes from their priors, amplitudes about their start values."""
    start, bounds = task.vectors()
    priors: dict[str, Prior | None] = {
        effect.full_name(p): p.prior if p.off is None else None
        for effect in task.effects
        for p in effect.parameters
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


def search_ends(task: Task, own: bool = False) -> list[tuple[float, list[float]]]:
    """Return cost and misfits (%) at the ends of the searches from drawn starts, and from the task's `own`."""
    random, ends = np.random.default_rng(SEED), []
    for i in range(-own, STARTS):
        problem, curves, _ = task.problem()
        times = [curve.recording.time for curve in curves if curve.recording.time is not None]
        duration = max((float(np.ptp(time)) for time in times), default=1.0)
        start = task.vectors()[0] if i < 0 else draw_start(task, random, duration)
        end = first_minimum(problem, start, task.loss)
        if end is not None:
            ends.append((end.minimum.cost, rms(problem, end.minimum.x)))
    return ends


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
    ends = search_ends(task)
    cost, best = min(ends)
    count = sum(end_cost <= 1.01 * min(cost, fit.cost) for end_cost, _ in ends)
    words = [", ".join(f"{value:.3f}" for value in values) for values in (own, best)]
    ends_at = "yes" if fit.converged else "no"
    ratio = float(np.sqrt(fit.cost / cost))
    return f"| {model} | {words[0]} | {ends_at} | {words[1]} | {ratio:.3f} | {count} | {fit.sweeps} | {seconds:.0f} |"


def effects_of(answer: dict[str, Any]) -> str:
    """Return the effects of a result, with their values, as tables of a case file."""
    text = ""
    for effect in answer["effects"]:
        values = ", ".join(f"{name} = {entry['value']!r}" for name, entry in effect["parameters"].items())
        text += f'\n[[effects]]\nname = "{effect["name"]}"\nparameters = {{ {values} }}\n'
        if effect["channels"]:
            text += f"channels = {json.dumps(effect['channels'])}\n"
    return text


def row_of_answer(case: Path, result: Path) -> str | None:
    """Return the row of the answer to a recording of a deck; None if it has no effects."""
    answer = json.loads(result.read_text())
    if not answer.get("effects"):
        return None
    after = list(answer["misfit"]["after"].values())
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(case.parent, folder, dirs_exist_ok=True)
        file = Path(folder) / "case.toml"
        file.write_text(file.read_text() + effects_of(answer))
        best = min(search_ends(Task(load_case(file), answer["law"]), own=True))[1]
    names = " and ".join(effect["name"] for effect in answer["effects"])
    ratio = float(np.sqrt(np.mean(np.square(after)) / np.mean(np.square(best))))
    worst = max(a / b for a, b in zip(after, best, strict=True))
    shown = [", ".join(f"{value:.3f}" for value in values) for values in (after, best)]
    return f"| {case.parent.name} | {names} | {shown[0]} | {shown[1]} | {ratio:.3f} | {worst:.3f} |"


def answers(cases: Path, results: Path, count: int) -> None:
    """Print the table of a deck's answers."""
    heads = ("recording", "effects", "after", "best of eleven", "ratio", "largest ratio of a channel")
    print(f"| {' | '.join(heads)} |\n" + "| --- " * len(heads) + "|", flush=True)
    for result in sorted(results.glob("*/result.json")):
        row = row_of_answer(cases / result.parent.name / "case.toml", result)
        if row is not None and count:
            print(row, flush=True)
            count -= 1


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


if __name__ == "__main__" and sys.argv[1] == "--answers":
    answers(Path(sys.argv[2]), Path(sys.argv[3]), int((sys.argv[4:] or ["1000"])[0]))
elif __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
