"""Property files in the TeimOrbit format of Adams, Altair MotionSolve and Simpack: blocks, units, curves."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bushcli.errors import InputError, Problem
from bushcli.export.curves import BushingData
from bushcli.export.units import UnitSystem
from bushcli.export.vibration import FORCES, mode_of
from bushcli.export.writer import Order, one_line

_LENGTHS = {"mm": "mm", "m": "meter", "in": "inch"}
_FORCES = {"N": "newton", "kN": "knewton", "lbf": "pound_force"}
_TIMES = {"s": "second", "ms": "millisecond"}


def block(name: str, lines: Sequence[str]) -> list[str]:
    """Return the lines of a block, with a rule above it."""
    return [f"${name:->79s}", f"[{name}]", *lines]


def units_block(units: UnitSystem, angle: str) -> list[str]:
    """Return the block [UNITS]."""
    values = {
        "LENGTH": _LENGTHS[units.length_name],
        "ANGLE": angle,
        "FORCE": _FORCES[units.force_name],
        "MASS": "kg",
        "TIME": _TIMES[units.time_name],
    }
    return block("UNITS", [f"{name:13s} = '{value}'" for name, value in values.items()])


def curve(order: Order, direction: str, program: str) -> list[str]:
    """Return rows of displacement (length or degrees) and force of a direction; refuse what no spring can follow."""
    q, force = order.bushing.curve_of(direction, program)
    if len(q) < 2:
        raise InputError(Problem(f"--to {program}", f"the curve of {direction} has fewer than two points"))
    rotational = direction.startswith("T")
    x = [math.degrees(value) if rotational else order.units.of_length(value) for value in q]
    y = [order.units.of_moment(value) if rotational else order.units.of_force(value) for value in force]
    return [f"{a:16.9g} {b:16.9g}" for a, b in zip(x, y, strict=True)]


def comments(bushing: BushingData) -> list[str]:
    """Return the comment lines that state the source of each direction's curve, and the bushing's remarks."""
    curves, lines = bushing.by_mode(), []
    for direction in FORCES:
        curve = curves.get(mode_of(direction))
        lines.append(
            f"{direction}: {f'simulated, {curve.name}' if curve else 'a line of the stiffness matrix'}"
        )
    return [f"$ {one_line(line)}" for line in (*lines, *bushing.remarks)]
