"""Designs of a study: a grid, a list, or a sample of the distributions.

References
----------
McKay, Beckman and Conover (1979), Technometrics 21:239-245, doi:10.2307/1268522 (Latin hypercube).
Sobol (1967), USSR Comput. Math. Math. Phys. 7:86-112, doi:10.1016/0041-5553(67)90144-9 (sequence).
Saltelli et al. (2010), Comput. Phys. Commun. 181:259-270, doi:10.1016/j.cpc.2009.09.018 (design for Sobol indices).
"""

from __future__ import annotations

import csv
import io
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import InputError, Problem
from bushcli.runtime.bounded import TooLarge, read_bounded
from bushcli.runtime.extras import remedy
from bushcli.study.variable import Value, Variable, of_values, value_fault, value_of

Array = NDArray[np.float64]
Sampling = Literal["grid", "list", "lhs", "sobol", "random", "saltelli", "corners"]
SAMPLINGS = get_args(Sampling)
# Designs of a sample unless the user gives a number: the mean is then known to a tenth of the standard deviation.
DESIGNS = 100
# Base of a Saltelli design, which has base (keys + 2) designs.
BASE = 64
MOST_DESIGNS = 10_000_000
# Largest size of a list of designs, bytes: half a million designs of five keys, which are read in 3 s.
LARGEST_LIST = 16_000_000


@dataclass(frozen=True)
class Plan:
    """The designs of a study.

    Attributes
    ----------
    variables : tuple of Variable
        The keys that are varied.
    sampling : str
        How the designs were chosen.
    rows : sequence of tuple
        The values of each design, in the order of the variables.
    seed : int
        Seed of the random numbers.
    file : str
        List that the designs are from; empty where there is none.
    lines : tuple of int
        Line of each design in that list, from 1.
    """

    variables: tuple[Variable, ...]
    sampling: Sampling
    rows: Sequence[tuple[Value, ...]]
    seed: int = 0
    file: str = ""
    lines: tuple[int, ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that are varied."""
        return tuple(variable.key for variable in self.variables)

    @property
    def is_independent(self) -> NDArray[np.bool_]:
        """Whether each design was drawn independently, (n,): the others of a Saltelli design mix two drawn ones."""
        numbers = np.arange(len(self.rows))
        if self.sampling != "saltelli":
            return np.ones(len(numbers), dtype=bool)
        within = numbers % (len(self.variables) + 2)
        return (within == 0) | (within == len(self.variables) + 1)

    @property
    def of_probability(self) -> bool:
        """Whether shares of the designs estimate probabilities: on a grid or at corners they do not."""
        return self.sampling in ("lhs", "sobol", "random", "saltelli")

    def problem_of_design(self, problem: Problem, number: int) -> Problem:
        """Return a problem of a design with the place of its values, which were passed on like those of --set.

        The case is valid without them, so that in a list each problem comes from the line of the design.

        Parameters
        ----------
        problem : Problem
        number : int
            Number of the design, from 0.
        """
        if self.lines:
            return replace(problem, where=f"{self.file}:{self.lines[number]}")
        for variable in self.variables:
            if problem.where.startswith(f"--set {variable.key}="):
                return replace(problem, where=variable.where)
        return problem


def plan(
    variables: Sequence[Variable], sampling: Sampling | None, designs: int | None = None, seed: int = 0
) -> Plan:
    """Choose the designs.

    Parameters
    ----------
    variables : sequence of Variable
        At least one.
    sampling : str or None
        None: a grid if all variables have values, else a Latin hypercube.
    designs : int or None
        Number of designs in a sample; None = `DESIGNS`. A Sobol sequence rounds it up to a power of two, a Saltelli
        design has at most this number.
    seed : int
        Seed of the random numbers.

    Raises
    ------
    InputError
        Nothing is varied, a key is varied twice, or the sampling does not suit the variables.
    """
    keys = [variable.key for variable in variables]
    if not keys:
        what = "nothing is varied"
        expected = (
            '--vary KEY=VALUES, --list FILE, or a tolerance in the case, such as outer_radius = "22.0 +- 0.1"'
        )
        raise InputError(Problem("study", what, "", expected))
    repeated = next((key for key in keys if keys.count(key) > 1), None)
    if repeated:
        raise InputError(Problem(f"--vary {repeated}", "is varied twice"))
    chosen = sampling or ("grid" if all(variable.values for variable in variables) else "lhs")
    rows: Sequence[tuple[Value, ...]]
    if chosen == "grid":
        ranged = next((variable for variable in variables if not variable.values), None)
        if ranged is not None:
            what = "has no values for a grid"
            expected = f"e.g. {ranged.key}={ranged.low:g}:{ranged.high:g}:5, or choose another --sampling"
            raise InputError(Problem(f"--vary {ranged.key}={ranged.spec}", what, "", expected))
        if designs is not None:
            what = "has no meaning for a grid: its values determine the number of designs"
            raise InputError(Problem("--designs", what))
        count = math.prod(len(variable.values) for variable in variables)
        if count > MOST_DESIGNS:
            what = f"makes a grid of {count} designs"
            raise InputError(Problem("--vary", what, "", f"at most {MOST_DESIGNS}"))
        rows = list(itertools.product(*(variable.values for variable in variables)))
    elif chosen == "corners":
        texts = next((variable for variable in variables if not variable.is_numeric), None)
        if texts is not None or len(variables) > 16:
            many = f"{len(variables)} keys have {2 ** len(variables)} corners"
            what = f"{texts.key} has words" if texts else many
            raise InputError(Problem("--sampling corners", what, "", "at most 16 keys with numbers"))
        ends = [(variable.low, variable.high) for variable in variables]
        # The nominal design, then all combinations of both ends.
        rows = [tuple(variable.nominal for variable in variables), *itertools.product(*ends)]
    else:
        unit = _unit(chosen, len(variables), designs, seed)
        rows = list(zip(*(variable.at(unit[:, i]) for i, variable in enumerate(variables)), strict=True))
    return Plan(tuple(variables), chosen, rows, seed)


def _unit(sampling: str, keys: int, designs: int | None, seed: int) -> Array:
    """Return points of the unit cube, (n, keys)."""
    from scipy.stats import qmc

    count = designs or DESIGNS
    if not 1 <= count <= MOST_DESIGNS:
        raise InputError(Problem("--designs", f"asks for {count} designs", "", f"1 to {MOST_DESIGNS}"))
    rng = np.random.default_rng(seed)
    if sampling == "random":
        return rng.random((count, keys))
    if sampling == "sobol":
        return np.asarray(qmc.Sobol(keys, rng=rng).random_base2(max(0, math.ceil(math.log2(count)))))
    if sampling == "saltelli":
        base = BASE if designs is None else 2 ** int(math.log2(max(1.0, designs / (keys + 2))))
        return saltelli(keys, base, seed)
    return np.asarray(qmc.LatinHypercube(keys, rng=rng).random(count))


def problem(keys: int) -> dict[str, Any]:
    """Return a SALib problem on the unit cube with the given number of keys."""
    return {"num_vars": keys, "names": [f"x{i}" for i in range(keys)], "bounds": [[0.0, 1.0]] * keys}


def saltelli(keys: int, base: int, seed: int) -> Array:
    """Return Saltelli's design in the unit cube for first-order and total Sobol indices, (base (keys + 2), keys).

    Raises
    ------
    InputError
        SALib is not installed.
    """
    try:
        from SALib.sample import sobol
    except ImportError:
        what = "needs SALib, which is not installed"
        raise InputError(Problem("--sampling saltelli", what, "", remedy("study"))) from None
    return np.asarray(sobol.sample(problem(keys), base, calc_second_order=False, scramble=True, seed=seed))


def from_list(file: Path, overridden: Sequence[Variable] = ()) -> Plan:
    """Read the designs from a table.

    Parameters
    ----------
    file : Path
        CSV: keys in the first line, the values of one design in every other.
    overridden : sequence of Variable
        Variables given beside the list; any is an error.

    Raises
    ------
    InputError
        The file cannot be read, a line has the wrong number of values, or variables are given beside the list.
    """
    if overridden:
        raise InputError(Problem(f"--vary {overridden[0].key}", "cannot be combined with --list"))
    try:
        text = read_bounded(file, LARGEST_LIST).decode("utf-8-sig")
        table = csv.reader(io.StringIO(text, newline=""))
        # Each with its number, from 1.
        lines = [(table.line_num, line) for line in table if any(cell.strip() for cell in line)]
    except TooLarge as error:
        expected = f"CSV of at most {LARGEST_LIST / 1e6:g} MB with the keys in its first line"
        raise InputError(Problem(str(file), str(error), "", expected)) from None
    except (OSError, ValueError, csv.Error) as error:
        what = f"cannot be read: {getattr(error, 'strerror', None) or error}"
        raise InputError(Problem(str(file), what, "", "CSV with the keys in its first line")) from None
    if len(lines) < 2:
        expected = "keys in the first line, one design per line"
        raise InputError(Problem(str(file), "has no designs", "", expected))
    (head, cells), *rest = lines
    keys = [cell.strip() for cell in cells]
    if len(set(keys)) < len(keys) or not all(keys):
        what = "names a column twice or not at all"
        raise InputError(Problem(f"{file}:{head}", what, "", "one key per column"))
    for number, line in rest:
        if len(line) != len(keys):
            what = f"has {len(line)} values for {len(keys)} keys"
            raise InputError(Problem(f"{file}:{number}", what))
    numbers = tuple(number for number, _ in rest)
    columns = []
    for i, key in enumerate(keys):
        for number, line in rest:
            if not line[i].strip():
                raise InputError(Problem(f"{file}:{number}", f"has no value for {key}"))
        values = tuple(value_of(line[i]) for _, line in rest)
        if (fault := value_fault(values)) is not None:
            place = f"{file}:{numbers[fault.number]}"
            raise InputError(Problem(place, f"{key} = {fault.what}", "", fault.expected))
        columns.append(of_values(key, str(file), values))
    rows = list(zip(*(column.values for column in columns), strict=True))
    return Plan(tuple(columns), "list", rows, file=str(file), lines=numbers)
