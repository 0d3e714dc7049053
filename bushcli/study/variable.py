"""Variables of a study: keys of the case with values or with a distribution."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case.tolerance import Toleranced, toleranced_number
from bushcli.errors import InputError, Problem

Array = NDArray[np.float64]
Value = float | int | str

# A tolerance stands for a normal distribution that is cut off at its limits, this number of standard deviations from
# the middle: a process that is just capable (process capability Cp = 1), with inspection.
SIGMAS = 3.0
# Other unbounded distributions are cut off at this probability on either side.
TAIL = 1e-6
EXAMPLES = '"20:24:5" (grid), "20,22,24", "20:24", "22 +- 0.1", "normal(22, 0.05)", "uniform(20, 24)"'
_CALL = re.compile(r"\s*([a-z]+)\s*\(([^()]*)\)\s*\Z")
_INTEGER = re.compile(r"[+-]?\d+\Z")
MOST_VALUES = 100_000


@dataclass(frozen=True)
class Variable:
    """A key that is varied.

    Attributes
    ----------
    key : str
        As for ``--set``, or "hardness" (Shore A).
    spec : str
        As the user wrote it.
    values : tuple
        The values of a grid; empty where there is a distribution.
    ppf : callable or None
        Probability (n,) -> value (n,) of the distribution; None where there are values.
    low, high : float
        Ends of the distribution, or smallest and largest of the numeric values; in the unit of the key.
    nominal : Value
        The value in the middle: that of a tolerance, the median, or the middle one of the values.
    origin : str
        File that has the specification; empty for ``--vary``.
    """

    key: str
    spec: str
    values: tuple[Value, ...] = ()
    ppf: Callable[[Array], Array] | None = None
    low: float = math.nan
    high: float = math.nan
    nominal: Value = math.nan
    origin: str = ""

    @property
    def where(self) -> str:
        """The place of the specification, as a message names it."""
        return self.origin or f"--vary {self.key}={self.spec}"

    @property
    def is_numeric(self) -> bool:
        """Whether all values are numbers."""
        return self.ppf is not None or not any(isinstance(value, str) for value in self.values)

    def at(self, unit: Array) -> list[Value]:
        """Return the values at probabilities (n,); the values of a list are equally probable."""
        if self.ppf is not None:
            return [float(value) for value in self.ppf(np.clip(unit, TAIL, 1.0 - TAIL))]
        count = len(self.values)
        return [self.values[min(int(u * count), count - 1)] for u in unit]


def variable(text: str) -> Variable:
    """Return the variable that ``KEY=SPEC`` defines.

    Raises
    ------
    InputError
        There is no key, or the specification is not known.
    """
    key, equals, spec = text.partition("=")
    key, spec = key.strip(), spec.strip()
    if not equals or not key or not spec:
        raise _error(text, "is not KEY=VALUES", f"e.g. geometry.outer_radius={EXAMPLES}")
    if (toleranced_value := toleranced_number(spec)) is not None:
        return of_tolerance(key, toleranced_value)
    parsed = _distribution(key, spec, text) or _range(key, spec, text)
    if parsed is not None:
        return parsed
    parts, depth = [""], 0
    for character in spec:  # a comma within the brackets of a point or a path does not separate values
        depth += (character in "[{") - (character in "]}")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    values = tuple(map(value_of, parts))
    fault = value_fault(values)
    if fault is not None:
        raise _error(text, f"value {fault.number + 1} = {fault.what}", fault.expected)
    return of_values(key, spec, values)


@dataclass(frozen=True)
class ValueFault:
    """A value that does not suit the others, or no study: its number from 0, what is wrong, what would be valid."""

    number: int
    what: str
    expected: str


def value_fault(values: Sequence[Value]) -> ValueFault | None:
    """Return the first value that cannot be used, or None: numbers must be finite, and not mixed with words."""
    words = isinstance(values[0], str)
    for number, value in enumerate(values):
        if isinstance(value, str) != words:
            kinds = ("a number", "a word") if words else ("a word", "a number")
            what = f"{value} is {kinds[0]}, but the first value, {values[0]}, is {kinds[1]}"
            return ValueFault(number, what, "only numbers, or only words")
        if not isinstance(value, str) and not math.isfinite(value):
            what = f"{value} is not finite: the influence of a key is computed from finite values"
            remedy = "a large number in place of inf, or --set KEY=inf for all designs"
            return ValueFault(number, what, remedy)
    return None


def of_values(key: str, spec: str, values: tuple[Value, ...]) -> Variable:
    """Return a variable with given values."""
    numbers = [float(value) for value in values if not isinstance(value, str)]
    middle = sorted(values)[len(values) // 2] if len(numbers) == len(values) else values[0]
    low, high = min(numbers, default=math.nan), max(numbers, default=math.nan)
    return Variable(key, spec, values, low=low, high=high, nominal=middle)


def of_tolerance(key: str, tolerance: Toleranced, origin: str = "") -> Variable:
    """Return the variable of a number with a tolerance: a normal distribution, cut off at the limits.

    Parameters
    ----------
    key : str
        As in `Variable`.
    tolerance : Toleranced
        Nominal value and limits.
    origin : str
        File that has the tolerance; empty for ``--vary``.
    """
    from scipy.special import ndtr

    sigma, tail = tolerance.deviation / SIGMAS, float(ndtr(-SIGMAS))
    return Variable(
        key,
        f"{tolerance.nominal:g} +- {tolerance.deviation:g}",
        ppf=lambda u: tolerance.nominal + sigma * _normal(tail + (1.0 - 2.0 * tail) * u),
        low=tolerance.low,
        high=tolerance.high,
        nominal=tolerance.nominal,
        origin=origin,
    )


def _normal(unit: Array) -> Array:
    from scipy.special import ndtri

    return np.asarray(ndtri(unit))


def _error(text: str, what: str, expected: str) -> InputError:
    return InputError(Problem(f"--vary {text}", what, "", expected))


def _range(key: str, spec: str, text: str) -> Variable | None:
    """Return the variable of "low:high" (uniform) or "low:high:count" (grid); None for anything else."""
    parts = spec.split(":")
    if len(parts) not in (2, 3):
        return None
    try:
        low, high = float(parts[0]), float(parts[1])
        count = int(parts[2]) if len(parts) == 3 else 0
    except ValueError:
        raise _error(text, "is not a range", EXAMPLES) from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise _error(text, "must rise from its first number to its second", EXAMPLES)
    if len(parts) == 2:
        uniform = _distribution(key, f"uniform({low!r}, {high!r})", text)
        assert uniform is not None
        return replace(uniform, spec=spec)
    if not 2 <= count <= MOST_VALUES:
        raise _error(text, f"has {count} as its number of values", f"LOW:HIGH:NUMBER, 2 to {MOST_VALUES}")
    # Twelve digits: 20.1 must not come out as 20.099999999999998.
    return of_values(key, spec, tuple(float(f"{v:.12g}") for v in np.linspace(low, high, count)))


def _distribution(key: str, spec: str, text: str) -> Variable | None:
    """Return the variable of a specification such as "normal(22, 0.05)"; None for anything else."""
    match = _CALL.match(spec)
    if match is None:
        return None
    name = match[1]
    if name not in _DISTRIBUTIONS:
        raise _error(text, f"{name} is not a distribution", ", ".join(_DISTRIBUTIONS))
    arguments, is_valid, ppf = _DISTRIBUTIONS[name]
    try:
        numbers = [float(part) for part in match[2].split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != len(arguments) or not all(map(math.isfinite, numbers)):
        raise _error(text, f"{name} takes other arguments", f"{name}({', '.join(arguments)})")
    if not is_valid(*numbers):
        what = f"{name} has arguments that do not define a distribution"
        raise _error(text, what, f"{name}({', '.join(arguments)})")
    nominal, *tails = map(float, ppf(np.array([0.5, TAIL, 1.0 - TAIL]), *numbers))
    low, high = (numbers[0], numbers[-1]) if name in _BOUNDED else tails
    return Variable(key, spec, ppf=lambda u: ppf(u, *numbers), low=low, high=high, nominal=nominal)


# Name -> arguments, whether they are valid, and the quantile function of probability and arguments.
_DISTRIBUTIONS: dict[str, tuple[tuple[str, ...], Callable[..., bool], Callable[..., Array]]] = {
    "uniform": (("LOW", "HIGH"), lambda low, high: low < high, lambda u, low, high: low + (high - low) * u),
    "normal": (
        ("MEAN", "STANDARD_DEVIATION"),
        lambda mean, std: std > 0.0,
        lambda u, mean, std: mean + std * _normal(u),
    ),
    "lognormal": (
        ("MEDIAN", "STANDARD_DEVIATION_OF_LOG"),
        lambda median, spread: median > 0.0 and spread > 0.0,
        lambda u, median, spread: median * np.exp(spread * _normal(u)),
    ),
    "triangular": (
        ("LOW", "MODE", "HIGH"),
        lambda low, mode, high: low <= mode <= high and low < high,
        lambda u, low, mode, high: np.where(
            u < (mode - low) / (high - low),
            low + np.sqrt(u * (high - low) * (mode - low)),
            high - np.sqrt((1.0 - u) * (high - low) * (high - mode)),
        ),
    ),
}
_BOUNDED = ("uniform", "triangular")


def value_of(text: str) -> Value:
    """Return a number where the text is one, else the text."""
    text = text.strip()
    if _INTEGER.match(text):
        return int(text)
    try:
        return float(text)
    except ValueError:
        return text
