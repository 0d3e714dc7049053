"""Cycles and holds of every channel, recorded and simulated on the same path -> values, conditions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bushcli.curve.cycles import NO_NOISE, Cycle, Uncertain, cycles_along, noise_of
from bushcli.curve.holds import Hold, holds_along
from bushcli.report.document import Array
from bushcli.report.quantity import Quantities, number, percent, quantities
from bushcli.runtime.condition import Condition

if TYPE_CHECKING:
    from bushcli.curve.curve import Curve
    from bushcli.inverse import Fit
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response

_Part = TypeVar("_Part", Cycle, Hold)

# Recorded loops are real if their energy, over all closed cycles of a channel, exceeds this many standard errors...
SURE = 5.0
# ... and this share of the work done while loading. Arbitrary: a rig's own friction, or a force logged a sample late,
# may add less than that.
SMALLEST_LOSS = 0.02
# A simulation that dissipates less than this share of the recorded energy counts as one without loops.
NONE_SIMULATED = 0.1
# A smaller simulated loss is an error of the solver: for a law without memory, 1e-8 was observed in radial cycles.
ROUNDING = 1e-6


@dataclass(frozen=True)
class ChannelHistory:
    """One channel along its path: the recording, or the simulated curve of a channel without one.

    A cycle and a hold are three: one that describes its path, the recorded and the simulated one. These are None where
    there is no recording, or where the simulation ended before the end of the cycle.
    """

    name: str
    mode: str
    path: Curve
    simulated_force: Array = field(repr=False)  # (n,), nan where the simulation ended earlier
    cycles: tuple[tuple[Cycle, Cycle | None, Cycle | None], ...]
    holds: tuple[tuple[Hold, Hold | None, Hold | None], ...]
    comes_back: bool  # whether the path reverses
    held_out: bool = False  # no identification used it: the simulation is a prediction

    @property
    def has_recording(self) -> bool:
        """Whether the path is that of a recording."""
        return any(recorded is not None for _, recorded, _ in self.cycles)

    @property
    def has_history(self) -> bool:
        """Whether the path comes back or holds; a path in one direction has neither loop nor relaxation."""
        return (self.comes_back and bool(self.cycles)) or bool(self.holds)


def shown_values(segment: Cycle | Hold, units: Quantities) -> dict[str, Uncertain]:
    """Return the values of a cycle or a hold by their keys in JSON, in the units that are shown."""
    if isinstance(segment, Hold):
        forces = {"force_start": segment.force_start, "force_end": segment.force_end}
        return forces | {"relaxation_percent": times(100.0, segment.relaxation)}
    return {
        "energy": segment.energy,
        "loss_percent": times(100.0, segment.loss),
        "secant_stiffness": times(1.0 / units.per_internal, segment.secant),
        "peak_force": segment.peak_force,
    }


def times(factor: float, estimate: Uncertain) -> Uncertain:
    """Return a value and its standard error times a factor."""
    return Uncertain(factor * estimate.value, factor * estimate.std)


def response_histories(response: Response, misfits: Mapping[str, Misfit]) -> tuple[ChannelHistory, ...]:
    """Return the channels of a direct prediction whose path reverses or has holds, except paths of six motions."""
    histories = []
    for channel in (channel for channel in response.channels if not channel.in_time):
        path, force, compared = channel.recording, channel.curve.force, misfits.get(channel.name)
        if path is not None:
            force = np.full(len(path.displacement), np.nan)
            if compared is not None:
                force[_where(compared.displacement, path.displacement)] = compared.simulated
        histories.append(_history(channel.name, path or channel.curve, force, recorded=path is not None))
    return tuple(history for history in histories if history.has_history)


def fit_histories(fit: Fit) -> tuple[ChannelHistory, ...]:
    """Return the channels of an identification whose path reverses or has holds, except paths of six motions."""
    curves = [curve for curve in fit.curves if curve.recording.of_one_motion]
    histories = (_history(c.name, c.recording, c.fitted.force, True, c.held_out) for c in curves)
    return tuple(history for history in histories if history.has_history)


def _where(part: Array, whole: Array) -> list[int]:
    """Return the indices in the whole of the samples of a part, which has the same order."""
    if len(part) == len(whole):
        return list(range(len(whole)))
    indices = iter(range(len(whole)))
    return [next(index for index in indices if whole[index] == value) for value in part]


def _history(
    name: str, path: Curve, simulated: Array, recorded: bool, held_out: bool = False
) -> ChannelHistory:
    segments = path.branches
    noise = noise_of(path) if recorded else NO_NOISE
    measured = path.force if recorded else np.full(len(path.force), np.nan)
    cycles = _threes(
        cycles_along(path, measured, noise, segments),
        map(_without_rounding, cycles_along(path, simulated, NO_NOISE, segments)),
    )
    holds = _threes(
        holds_along(path, measured, noise, segments),
        holds_along(path, simulated, NO_NOISE, segments, SURE * noise.force),
    )
    comes_back = {branch.direction for branch in segments} >= {1, -1}
    return ChannelHistory(name, path.mode, path, simulated, cycles, holds, comes_back, held_out)


def _without_rounding(cycle: Cycle | None) -> Cycle | None:
    """Return a simulated cycle; an energy within the solver's rounding is zero."""
    if cycle is None or abs(cycle.loss.value) >= ROUNDING:
        return cycle
    return replace(cycle, energy=Uncertain(0.0), loss=Uncertain(0.0))


def _threes(
    recorded: Iterable[_Part | None], simulated: Iterable[_Part | None]
) -> tuple[tuple[_Part, _Part | None, _Part | None], ...]:
    pairs = zip(recorded, simulated, strict=True)
    return tuple((part, r, s) for r, s in pairs if (part := r or s) is not None)


def with_hysteresis(
    conditions: tuple[Condition, ...], histories: Iterable[ChannelHistory]
) -> tuple[Condition, ...]:
    """Add the conditions of loops without simulated dissipation, unless the data have to be corrected first."""
    if any(condition.name == "faulty_data" for condition in conditions):
        return conditions
    return (*conditions, *filter(None, map(unexplained_hysteresis, histories)))


def unexplained_hysteresis(history: ChannelHistory) -> Condition | None:
    """Return a condition if the recording dissipates, well above its noise, but not its simulation."""
    pairs = [(r, s) for _, r, s in history.cycles if r is not None and s is not None and r.closed]
    energy = sum(recorded.energy.value for recorded, _ in pairs)
    std = math.sqrt(sum(recorded.energy.std**2 for recorded, _ in pairs))
    simulated = sum(loop.energy.value for _, loop in pairs)
    work = sum(r.energy.value / r.loss.value for r, _ in pairs if r.loss.value)
    real = bool(pairs) and energy > SURE * std and energy > SMALLEST_LOSS * work
    if not real or simulated > NONE_SIMULATED * energy:
        return None
    unit = energy_unit(history.mode)
    # Of the hold at the largest force, unless it is within the noise.
    holds = [hold for _, hold, _ in history.holds if hold is not None]
    loss = max(holds, key=lambda hold: abs(hold.force_start.value)).relaxation if holds else Uncertain(0.0)
    relaxed = loss.value if loss.value > SURE * loss.std else 0.0
    share = f"{percent(100 * energy / work)} of the work done while loading"
    relaxation_text = f"; in a hold the recorded force relaxes by {percent(100 * relaxed)}" if relaxed else ""
    return Condition(
        "unexplained_hysteresis",
        f"{history.name}: the recorded loops dissipate {number(energy)} ± {number(std, 2)} {unit} ({share}), the "
        f"simulated ones {number(simulated, 2) if simulated > std else '0'} {unit}{relaxation_text}",
        "add an effect that dissipates: viscoelasticity, friction or mullins (bushcli diagnose distinguishes them)",
    )


def energy_unit(mode: str) -> str:
    """Return the unit of the hysteresis energy: N mm, or MPa (energy per volume) for a coupon."""
    # N mm x rad of a rotation is N mm.
    return "MPa" if quantities(mode).force_unit == "MPa" else "N mm"
