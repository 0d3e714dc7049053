"""Answers of each design: stiffnesses and forces on its curves, and any number in its result."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.case.as_json import in_degrees
from bushcli.curve.curve import Curve
from bushcli.errors import InputError, Problem, nearest
from bushcli.simulate.response import Response, Simulated
from bushcli.study.target import place_of, unit_of
from cases.mode import modes

Array = NDArray[np.float64]

#: Kinds of answers of a channel that need no travel, and that can be asked for at a travel (mm or degrees).
ALONE, AT = ("initial", "secant"), ("force", "secant", "tangent")
_AT = re.compile(r"(.+)\.(\w+)@(.*)\Z")
#: Share of its range by which a curve may miss a travel: rounding, as of degrees.
ROUNDING = 1e-9
_INDEX = re.compile(r"-?\d+")
#: Keys of the result of `bushcli direct` under which answers can be asked for.
RESULT_KEYS = (
    *("case", "command", "complete", "data_faults", "load_cases"),
    *("material", "problems", "timings_s", "verdict", "versions"),
)
EXAMPLES = "axial.initial, axial.secant, axial.force@3, axial.secant@500N, load_cases[0].stiffness.secant"


@dataclass(frozen=True)
class Asked:
    """One number of a design.

    Attributes
    ----------
    name : str
        Name of its column.
    channel : str
        Channel of its curve; empty where it is a key of the result.
    kind : str
        "initial", "secant", "force" or "tangent", or the key of the result.
    travel : float or None
        Place on the curve, mm or degrees (stretch - 1 of a coupon); None for the whole curve.
    unit : str
        For example "N/mm"; empty where it is not known.
    at_load : bool
        The place is given by the force there, N or N mm, in `travel`.
    """

    name: str
    channel: str
    kind: str
    travel: float | None = None
    unit: str = ""
    at_load: bool = False

    @property
    def of_result(self) -> bool:
        """Whether it is a key of the result."""
        return not self.channel

    def on_curve(self, channel: Simulated) -> float:
        """Return the number on a simulated curve, in its unit."""
        curve = channel.curve
        turn = math.radians(1.0) if modes()[channel.mode].rotational else 1.0
        if self.travel is None:
            value = curve.initial_stiffness() if self.kind == "initial" else curve.secant_stiffness()
            return _finite(self.name, value * turn)
        at = travel_at(curve, self.travel, self.name) if self.at_load else self.travel * turn
        if self.kind == "travel":
            return at / turn
        q, force = monotonic_stretch(curve, at, self.name)
        from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed

        spline = CubicSpline(q, force)
        if self.kind == "tangent":
            return _finite(self.name, float(spline(at, 1)) * turn)
        value = float(spline(at))
        return _finite(self.name, value if self.kind == "force" else (value - float(spline(0.0))) / at * turn)


class NoAnswer(ValueError):
    """A design has no such number; the message says why."""


def default_answers(case: Case) -> tuple[Asked, ...]:
    """Return initial and secant stiffness of every channel."""
    channels = [name for name, mode in case.channels if mode in modes()]
    return tuple(answer(case, f"{name}.{kind}") for name in channels for kind in ALONE)


def answer(case: Case, text: str) -> Asked:
    """Return the answer that ``[NAME=]SPEC`` defines.

    Parameters
    ----------
    case : Case
        The case whose channels it may name.
    text : str
        ``CHANNEL.initial``, ``CHANNEL.secant[@TRAVEL]``, ``CHANNEL.tangent@TRAVEL``, ``CHANNEL.force@TRAVEL``, these
        with ``@LOADN`` (``@LOADNmm``) in place of the travel, ``CHANNEL.travel@LOADN``, or a key of the result of
        `bushcli direct`.

    Raises
    ------
    InputError
        The text has none of these forms.
    """
    name, equals, spec = text.rpartition("=")
    name, spec = (name.strip() if equals else spec.strip()), spec.strip()
    if not name or not spec:
        raise InputError(Problem(f"--answer {text}", "names no answer", "", EXAMPLES))
    # Other channels have no force over one displacement: they are asked for by keys of the result.
    channels = {name: mode for name, mode in case.channels if mode in modes()}
    at = _AT.match(spec)
    channel, _, kind = (at[1], "", at[2]) if at else spec.rpartition(".")
    if at is None and (channel not in channels or kind not in ALONE):
        if channel in channels or (kind in (*ALONE, *AT) and not set(".[") & set(channel)):
            close = nearest(channel, channels) if channel not in channels else ""
            what = "is not an answer" if channel in channels else f"there is no channel {channel}"
            raise InputError(Problem(f"--answer {text}", what, close, EXAMPLES))
        root = re.split(r"[.\[]", spec, maxsplit=1)[0]
        if root not in RESULT_KEYS:
            what = f"the result of `bushcli direct` has no {root}"
            expected = f"{', '.join(RESULT_KEYS)}; e.g. {EXAMPLES}"
            raise InputError(Problem(f"--answer {text}", what, nearest(root, RESULT_KEYS), expected))
        return Asked(name, "", spec)
    if channel not in channels:
        what = f"there is no channel {channel}"
        raise InputError(Problem(f"--answer {text}", what, nearest(channel, channels), ", ".join(channels)))
    travel, at_load = place_of(f"--answer {text}", channels[channel], at[3]) if at else (None, False)
    place = "load" if at_load else "travel"
    kinds = (*(choice for choice in AT if choice != "force"), "travel") if at_load else AT
    if at and kind not in kinds:
        what = f"{kind} cannot be evaluated at a {place}"
        expected = ", ".join(f"{choice}@{at[3]}" for choice in kinds)
        raise InputError(Problem(f"--answer {text}", what, "", expected))
    if travel == 0.0 and kind == "secant":
        what = f"has no secant: the {place} is zero"
        raise InputError(Problem(f"--answer {text}", what, "", f"{channel}.initial"))
    return Asked(name, channel, kind, travel, unit_of(channels[channel], kind), at_load)


def check_within_travel(case: Case, asked: Asked) -> None:
    """Raise `InputError` where an answer is asked for at a travel beyond the end of its load case.

    Travels of recordings, files and prescribed forces are not known before they are read or simulated.

    Parameters
    ----------
    case : Case
    asked : Asked
    """
    load = next((load for load in case.load_cases if load.label == asked.channel), None)
    if load is None or load.by_force or not load.path or asked.travel is None or asked.at_load:
        return
    low, high = (in_degrees(end, modes()[load.mode].rotational) for end in (min(load.path), max(load.path)))
    slack = ROUNDING * (high - low)
    if not low - slack <= asked.travel <= high + slack:
        place = f"{low:.6g} to {high:.6g}{quantity_unit(load.mode)}"
        what = f"is beyond the travel of the load case, {place}"
        load_unit = "Nmm" if modes()[load.mode].rotational else "N"
        expected = f"a travel within it, or a load with its unit: @{asked.travel:g}{load_unit}"
        raise InputError(Problem(f"--answer {asked.name}", what, "", expected))


def answer_columns(
    answers: Sequence[Asked], response: Response, document: Mapping[str, Any] | None
) -> dict[str, float]:
    """Return the numbers by name; raise `NoAnswer` where a curve or the result has none."""
    channels = {channel.name: channel for channel in response.channels}
    missing = next((answer for answer in answers if answer.channel and answer.channel not in channels), None)
    if missing is not None:
        has = ", ".join(channels)
        raise NoAnswer(f"{missing.name}: this design has no channel {missing.channel} ({has})")
    return {
        answer.name: number_at(answer.kind, document or {})
        if answer.of_result
        else answer.on_curve(channels[answer.channel])
        for answer in answers
    }


def monotonic_stretch(curve: Curve, travel: float, name: str) -> tuple[Array, Array]:
    """Return the first stretch in one direction that contains a travel: displacements in rising order, and forces.

    Raises
    ------
    NoAnswer
        The curve does not reach the travel.
    """
    q, force = curve.displacement, curve.force
    turns = np.flatnonzero(np.diff(np.sign(np.diff(q)))) + 1
    edges = [0, *map(int, turns), len(q) - 1]
    slack = ROUNDING * float(np.ptp(q))
    for start, stop in pairwise(edges):
        leg = q[start : stop + 1]
        if stop - start >= 1 and leg.min() - slack <= travel <= leg.max() + slack:
            order = np.argsort(leg)
            return leg[order], force[start : stop + 1][order]
    turn = math.degrees(1.0) if modes()[curve.mode].rotational else 1.0
    low, high = float(q.min()) * turn, float(q.max()) * turn
    unit, load = quantity_unit(curve.mode), "Nmm" if modes()[curve.mode].rotational else "N"
    # Far beyond the curve, a load was meant.
    meant = max(abs(low), abs(high)) * 3.0 < abs(travel * turn) and unit
    hint = f"; a load has its unit, @{travel * turn:.6g}{load}" if meant else ""
    raise NoAnswer(f"{name}: the curve goes from {low:.6g} to {high:.6g}{unit}{hint}")


def travel_at(curve: Curve, load: float, name: str) -> float:
    """Return the travel at which a curve first carries a load, mm or rad; raise `NoAnswer` where it never does."""
    from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed

    force = curve.force - load
    slack = 1e-6 * float(np.ptp(force))
    passed = np.flatnonzero((np.abs(force[1:]) <= slack) | (force[:-1] * force[1:] < 0.0))
    if not len(passed):
        low, high = float(curve.force.min()), float(curve.force.max())
        unit = "N mm" if modes()[curve.mode].rotational else "N"
        raise NoAnswer(f"{name}: the curve goes from {low:.6g} to {high:.6g} {unit}")
    step = slice(int(passed[0]), int(passed[0]) + 2)
    before, after = map(float, curve.displacement[step])
    if abs(force[step][1]) <= slack:
        return after
    q, forces = monotonic_stretch(curve, 0.5 * (before + after), name)
    roots = CubicSpline(q, forces - load).roots(extrapolate=False)
    return next(float(root) for root in roots if min(before, after) <= root <= max(before, after))


def quantity_unit(mode: str) -> str:
    """Return the unit of a mode's travel with a space before it; empty for a coupon."""
    kind = modes().get(mode)
    return "" if kind is None or kind.specimen == "coupon" else " deg" if kind.rotational else " mm"


def _finite(name: str, value: float) -> float:
    if not math.isfinite(value):
        raise NoAnswer(f"{name}: the curve has too few points")
    return value


def number_at(key: str, document: Mapping[str, Any]) -> float:
    """Return the number at a dotted key of JSON-ready data; entries of lists are addressed by number or by name.

    Parameters
    ----------
    key : str
        "load_cases[0].stiffness.secant", or "load_cases.axial.stiffness.secant"; -1 is the last entry of a list.
    document : mapping

    Raises
    ------
    NoAnswer
        There is no number at the key.
    """
    value: Any = document
    for part in re.sub(r"\[(-?\d+)\]", r".\1", key).split("."):
        if isinstance(value, Mapping) and part in value:
            value = value[part]
        elif isinstance(value, list) and _INDEX.fullmatch(part) and -len(value) <= int(part) < len(value):
            value = value[int(part)]
        elif isinstance(value, list) and (named := [e for e in value if _name(e) == part]):
            value = named[0]
        else:
            keys: list[str] = list(map(str, value)) if isinstance(value, Mapping) else []
            if isinstance(value, list):
                keys = [*filter(None, map(_name, value))] or [f"a list: 0 to {len(value) - 1}"]
            raise NoAnswer(f"{key}: the result has no {part} there ({', '.join(keys) or 'no keys'})")
    if isinstance(value, bool | int | float):
        return float(value)
    raise NoAnswer(f"{key}: is not a number")


def _name(entry: Any) -> str:
    return str(entry.get("name", "")) if isinstance(entry, Mapping) else ""
