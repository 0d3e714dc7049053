"""Compares results: keys of their cases that differ, numbers that differ, and their curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import Curve
from cases.mode import modes
from cases.six import PAIR_MODES, REACTIONS

Array = NDArray[np.float64]

# Entries of a result that say how it was computed, not what it is; problems have an entry of their own.
_HOW = ("case", "versions", "timings_s", "problems", "files", "question", "command", "data_faults")
# The same of a channel, and sentences that repeat numbers.
_HOW_OF_CHANNEL = (
    "seconds", "newton_iterations", "text", "headline", "iterations", "sweeps", "forward_solves", "failed_solves",
)  # fmt: skip
# Numbers that differ by less than this share of the larger one are equal: local strains of equal designs differ by up
# to some 1e-7, the tolerance of a march being 1e-8 of the reactions.
EQUAL = 1e-6


# Lists of a case of which another case may have other entries, which are then one difference.
_LISTS = ("recordings", "specimens", "coupons", "load_cases", "vibrations")
# Reactions of six motions below this share of the largest force, or moment, are rounding errors.
_NOTHING = 1e-3


@dataclass(frozen=True)
class ReactionHistory:
    """A reaction of six motions over time: s, N or N mm; its mode is one with forces of its kind."""

    mode: str
    time: Array
    force: Array


@dataclass(frozen=True)
class ComparedResult:
    """A result to be compared.

    Attributes
    ----------
    name : str
        As the user gave it.
    result : mapping
        Its JSON.
    curves : mapping of str to Curve or ReactionHistory
        Simulated or mean curves by channel: mm or rad, N or N mm; of six motions, "CHANNEL Fx" and so on.
    """

    name: str
    result: Mapping[str, Any]
    curves: Mapping[str, Curve | ReactionHistory]


@dataclass(frozen=True)
class Difference:
    """A key with its values, one for each result; None where a result has none."""

    key: str
    values: tuple[Any, ...]

    @property
    def percent(self) -> tuple[float | None, ...]:
        """Change of each number against the first, percent; None where there are no two numbers."""
        reference = self.values[0]
        return tuple(
            100.0 * (value / reference - 1.0)
            if _is_number(value) and _is_number(reference) and reference
            else None
            for value in self.values
        )


@dataclass(frozen=True)
class CurveDifference:
    """Largest difference of each result's curve to the first one's, over the displacements that both have."""

    channel: str
    # Of the first curve's force range; None where a result has no such curve, or no common displacement.
    percent: tuple[float | None, ...]


@dataclass(frozen=True)
class Comparison:
    """Results beside each other: differing keys of the cases, differing numbers, curves, problems by result."""

    items: tuple[ComparedResult, ...]
    keys: tuple[Difference, ...]
    numbers: tuple[Difference, ...]
    curves: tuple[CurveDifference, ...]
    problems: tuple[tuple[str, ...], ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of which at least one result has a curve."""
        return tuple(dict.fromkeys(name for item in self.items for name in item.curves))


def compare(items: Sequence[ComparedResult]) -> Comparison:
    """Compare results with the first one."""
    given_cases = [dict(item.result.get("case", {})) for item in items]
    lists = []
    for key in _LISTS:
        lists_of_key = (case.get(key) or () for case in given_cases)
        tables = [[entry for entry in entries if isinstance(entry, Mapping)] for entries in lists_of_key]
        names = [[str(entry.get("name", entry.get("mode"))) for entry in table] for table in tables]
        # All names, or how many and the ends.
        summaries = (f"{len(n)}: {n[0]} ... {n[-1]}" if len(n) > 3 else ", ".join(n) or None for n in names)
        lists.append(Difference(key, tuple(summaries)))
    other = [difference for difference in lists if len(set(difference.values)) > 1]
    for case in given_cases:
        for key in ("path", *(difference.key for difference in other)):
            case.pop(key, None)
    cases = [dict(_leaves(case)) for case in given_cases]
    numbers = [
        dict(_leaves({key: value for key, value in item.result.items() if key not in _HOW})) for item in items
    ]
    # What only one kind of result has is no difference, and a key of the cases is one already.
    case_keys = {key for case in cases for key in case}
    common = [
        {
            key: value
            for key, value in table.items()
            if key not in case_keys and sum(key in entries for entries in numbers) > 1
        }
        for table in numbers
    ]
    channels = dict.fromkeys(name for item in items for name in item.curves)
    return Comparison(
        tuple(items),
        (*_differences(cases), *other),
        tuple(
            difference
            for difference in _differences(common)
            # What another command, or a result without it, does not say is no other number.
            if not _equal([value for value in difference.values if value is not None])
        ),
        tuple(
            CurveDifference(name, _curve_differences([item.curves.get(name) for item in items]))
            for name in channels
        ),
        tuple(tuple(problem["name"] for problem in item.result.get("problems", [])) for item in items),
    )


def curves_in(result: Mapping[str, Any]) -> dict[str, Curve | ReactionHistory]:
    """Return the simulated curves of a result of `direct`, and the mean curves of `batch`."""
    curves: dict[str, Curve | ReactionHistory] = {}
    for entry in (
        *result.get("load_cases", []),
        *(result.get("curves", []) if result.get("command") == "batch" else []),
    ):
        if isinstance(entry.get("force"), Mapping):
            time = np.array(entry["time"], dtype=float)
            reactions = np.array([entry["force"][name] for name in REACTIONS], dtype=float)
            size = np.abs(reactions).max(axis=1, initial=0.0)
            for k, (name, pair_mode) in enumerate(zip(REACTIONS, PAIR_MODES, strict=True)):
                if len(time) > 1 and size[k] > _NOTHING * size[3 * (k // 3) : 3 * (k // 3) + 3].max():
                    curves[f"{entry['name']} {name}"] = ReactionHistory(pair_mode, time, reactions[k])
            continue
        mode = modes().get(entry.get("mode", ""))
        q, force = entry.get("displacement"), entry.get("force")
        if mode is None or not isinstance(q, list) or not isinstance(force, list) or len(q) < 2:
            continue
        unit = np.pi / 180.0 if mode.rotational else 1.0
        rest = 1.0 if mode.specimen == "coupon" and not mode.sheared else 0.0
        pairs = [(a, b) for a, b in zip(q, force, strict=True) if _is_number(a) and _is_number(b)]
        x, y = np.array(pairs, dtype=float).T
        curves[str(entry.get("name", entry["mode"]))] = Curve(mode.name, unit * (x - rest), y)
    return curves


def _leaves(value: Any, at: str = "") -> Iterator[tuple[str, Any]]:
    """Yield numbers and words by dotted key; lists of numbers are curves, and are left out unless they are short."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key in _HOW_OF_CHANNEL:
                continue
            yield from _leaves(item, f"{at}.{key}" if at else str(key))
    elif isinstance(value, list) and any(isinstance(entry, Mapping) for entry in value):
        for i, item in enumerate(value):
            name = item.get("name", item.get("mode")) if isinstance(item, Mapping) else None
            names = [entry.get("name", entry.get("mode")) for entry in value if isinstance(entry, Mapping)]
            yield from _leaves(item, f"{at}.{name}" if name and names.count(name) == 1 else f"{at}[{i}]")
    elif isinstance(value, list):
        if len(value) <= 6:
            yield at, tuple(value) if all(not isinstance(entry, list) for entry in value) else str(value)
    elif value is not None:
        yield at, value


def _differences(tables: Sequence[Mapping[str, Any]]) -> tuple[Difference, ...]:
    keys = dict.fromkeys(key for table in tables for key in table)
    differences = (Difference(key, tuple(table.get(key) for table in tables)) for key in keys)
    return tuple(difference for difference in differences if not _equal(difference.values))


def _equal(values: Sequence[Any]) -> bool:
    return all(_same(values[0], value) for value in values)


def _same(value: Any, other: Any) -> bool:
    if _is_number(value) and _is_number(other):
        return bool(abs(value - other) <= EQUAL * max(abs(value), abs(other)))
    if isinstance(value, tuple) and isinstance(other, tuple) and len(value) == len(other):
        return all(map(_same, value, other))
    return bool(value == other)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _curve_differences(curves: Sequence[Curve | ReactionHistory | None]) -> tuple[float | None, ...]:
    reference = curves[0]
    if reference is None:
        return (None,) * len(curves)
    differences: list[float | None] = []
    x, force = _points_of(reference)
    for curve in curves:
        difference = None
        if curve is not None and (type(curve), curve.mode) == (type(reference), reference.mode):
            own, other = _points_of(curve)
            low, high = max(x[0], own[0]), min(x[-1], own[-1])
            if high > low:
                at = np.linspace(low, high, 200)
                apart = np.interp(at, own, other) - np.interp(at, x, force)
                difference = float(100.0 * apart[np.argmax(np.abs(apart))] / np.ptp(force))
        differences.append(difference)
    return tuple(differences)


def _points_of(curve: Curve | ReactionHistory) -> tuple[Array, Array]:
    """Return the growing displacements or times of a curve, and its forces."""
    if isinstance(curve, ReactionHistory):
        return curve.time, curve.force
    backbone = curve.backbone()
    return backbone.displacement, backbone.force
