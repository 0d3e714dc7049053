"""Kernels that bushings commonly need, compiled at set-up: every law, branch and kinematics.

    python -m cases.precompile

There are as many processes as processors. What depends on a mesh's elements or on an effect's own formula (a moved
stress-free body, surfaces, pictures) is compiled when it is first used.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor

from cases.kernels import kernel, loops
from cases.material import BATCH
from forms import answers, gradients
from forms.branch import branches, clocks
from forms.branch_answers import branch_functions
from forms.law import Law, laws
from forms.point import PointFunction
from forms.setting import SETTINGS


def functions() -> list[PointFunction]:
    """Return all of these kernels once, those that take longest to compile first."""
    by_key = {function.key: function for function in _functions()}
    return sorted(by_key.values(), key=_weight, reverse=True)


def parameter_sets(law: Law) -> list[tuple[str, ...]]:
    """Names of a law's parameters: without the optional ones, then with one more pair of them (a term) each time."""
    needed = [p.name for p in law.parameters if not p.optional]
    optional = [p.name for p in law.parameters if p.optional]
    return [(*needed, *optional[:count]) for count in range(0, len(optional) + 1, 2)]


def precompile(processes: int | None = None) -> tuple[int, float]:
    """Compile all kernels that are missing; return the number of kernels checked, and seconds.

    Parameters
    ----------
    processes
        Number of processes at once; that of the processors if not given.
    """
    start_time = time.perf_counter()
    loops()
    number = len(functions())
    # A process that was forked from one that has started MPI cannot be relied on.
    start = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes or os.cpu_count(), mp_context=start) as pool:
        list(pool.map(_compile, range(number)))
    return number, time.perf_counter() - start_time


def _compile(index: int) -> None:
    kernel(functions()[index])


def _laws() -> list[tuple[Law, tuple[str, ...]]]:
    """Laws with their parameters."""
    return [(law, names) for law in laws().values() for names in parameter_sets(law)]


def _functions() -> Iterator[PointFunction]:
    for law, names in _laws():
        yield answers.principal_moduli(law, tuple(sorted(names)))
    for name, setting in SETTINGS.items():
        yield from (make(name, setting) for make in (gradients.strains, gradients.strain_rates))
        yield from (make(name, setting) for make in (gradients.forces, gradients.moduli))
        for moduli in (False, True):
            yield answers.volumetric_answer(setting, moduli)
        volumetric = answers.volumetric_slopes(setting)
        yield from (volumetric, answers.work_slopes(volumetric, answers.VOLUMETRIC))
        yield from (answers.metal_answer(setting), answers.resting_answer(setting))
        for law, names in _laws():
            for moduli in (False, True):
                yield answers.law_answer(setting, law, names, moduli)
            slopes = answers.law_slopes(setting, law, names)
            yield from (slopes, answers.work_slopes(slopes, len(names)))
        for branch in (*branches().values(), *clocks().values()):
            functions = branch_functions(setting, branch)
            yield from (functions.stress, functions.end)
            for directions in (1, BATCH):
                yield functions.end_rate(directions)
            if not branch.clock:
                yield functions.moduli
                yield from (functions.stress_rate(directions) for directions in (1, BATCH))


def _weight(function: PointFunction) -> int:
    """Estimate of the time to compile, from strain variables, parameters, and second derivatives."""
    return (
        function.blocks.get("strain", 1)
        * sum(function.blocks.values())
        * (2 if "moduli" in function.key else 1)
    )


if __name__ == "__main__":
    count, seconds = precompile()
    sys.stdout.write(f"{count} kernels in {seconds:.0f} s\n")
