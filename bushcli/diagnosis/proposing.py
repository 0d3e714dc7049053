"""The recording that would tell rivals apart: each foretells every recording of a menu, and the cheapest decides."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import permutations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.active import acting
from bushcli.casefile import Case
from bushcli.diagnosis import kept
from bushcli.diagnosis.discriminate import Prediction, Separation, next_test, separate
from bushcli.diagnosis.menu import Proposal, menu
from bushcli.diagnosis.model import Fitted, Model
from bushcli.diagnosis.result import NextTest
from bushcli.diagnosis.rivals import TOLD_APART
from bushcli.diagnosis.selected import Selection
from bushcli.diagnosis.workers import Workers
from bushcli.direct import rubber_of
from bushcli.effect import spoken
from bushcli.simulation import Simulation
from cases.march import NotConverged
from cases.mode import modes
from geometry.ring import Ring

Array = NDArray[np.float64]
Progress = Callable[[str, str, str], None]

# Rivals that are looked at, the chosen one among them.
MOST_RIVALS = 3
# Recordings of the menu that are foretold, the cheapest first, of the recorded modes.
MOST_PROPOSALS = 6
# Where a mode has not been recorded: travel as a share of the rubber's thickness, or rad; seconds from rest to there.
SHARE = {"axial": 0.6, "radial": 0.3}
TURN = 0.2
SECONDS = 20.0
# Noise to be expected of a mode that has not been recorded, as a share of the force range.
NOISE = 3e-3
SAMPLES = 9


def propose(
    case: Case,
    found: Selection,
    rivals: Mapping[tuple[str, ...], Fitted],
    crew: Workers,
    told: Progress,
) -> NextTest | None:
    """The cheapest recording that separates rivals; None where none on the menu does.

    Parameters
    ----------
    rivals
        Sets of effects with their fits; the chosen one first.
    """
    models = {_name(names): (fitted.model, fitted) for names, fitted in list(rivals.items())[:MOST_RIVALS]}
    if len(models) < 2:
        return None
    special = {
        (a, b)
        for (a, (one, _)), (b, (other, _)) in permutations(models.items(), 2)
        if _is_special_case(one, other)
    }
    separations: list[Separation] = []
    for recorded in (True, False):
        # From the cheapest on: the first that decides is the answer.
        for proposal in _menu(case, found, recorded):
            told("next", "test", proposal.name)
            answers = crew.run(
                _foretell, [(case, model, fitted, proposal) for model, fitted in models.values()]
            )
            known = {name: one for name, one in zip(models, answers, strict=True) if one is not None}
            if len(known) < len(models):
                continue
            span = max(float(np.ptp(one.force)) for one in known.values())
            separations.append(separate(proposal, known, _sigma(found, proposal, span), special))
            if separations[-1].decides:
                return _test(separations[-1], models)
    best = next_test(separations)
    return None if best is None else _test(best, models)


def _test(best: Separation, models: Sequence[str] | Mapping[str, object]) -> NextTest:
    return NextTest(
        name=best.proposal.name,
        channel=best.proposal.channel,
        points=best.proposal.points,
        rates=best.proposal.rates,
        holds=best.proposal.holds,
        minutes=best.proposal.cost,
        separates=best.told_apart,
        distance=best.worst,
        text=_words(best.proposal, best.worst, tuple(models)),
    )


def _is_special_case(one: Model, other: Model) -> bool:
    """Whether the second model becomes the first where some of its effects vanish: it can imitate it always."""
    same = (one.law, one.fixed) == (other.law, other.fixed)
    having = [{e.channels for e in other.effects if e.name == mine.name} for mine in one.effects]
    return same and all(mine.channels in there for mine, there in zip(one.effects, having, strict=True))


def _menu(case: Case, found: Selection, recorded: bool) -> list[Proposal]:
    """Recordings of the modes that have been recorded, or of the others."""
    mounted = [channel.recording.mode for channel in found.plain.channels]
    amplitudes: dict[str, float] = {}
    others: dict[str, float] = {}
    rate: dict[str, float] = {}
    for channel in found.plain.channels:
        q, t = channel.recording.displacement, channel.recording.time
        reach = float(np.abs(q).max())
        mode = channel.recording.mode
        amplitudes[mode] = max(reach, amplitudes.get(mode, 0.0))
        path = float(np.abs(np.diff(q)).sum())
        rate[mode] = path / float(t[-1] - t[0]) if t is not None else reach / SECONDS
    if not recorded:
        if isinstance(case.geometry, Ring):
            others = {
                name: share * case.geometry.thickness for name, share in SHARE.items() if name not in mounted
            }
            if "torsional" not in mounted:
                others["torsional"] = TURN
        rate = {name: reach / SECONDS for name, reach in others.items()}
        amplitudes = others
    whole = menu(amplitudes, rate, mounted)
    if recorded:
        return list(whole[:MOST_PROPOSALS])
    # Of a mode that the rig is not set up for, one recording that turns, returns and repeats.
    return [proposal for proposal in whole if proposal.repeats][: len(others)]


def _foretell(case: Case, model: Model, fitted: Fitted, proposal: Proposal) -> Prediction | None:
    """What a rival expects of a recording, with derivatives by its parameters; None where it cannot be solved."""
    time, q = proposal.program(SAMPLES)
    task = model.task(case)
    # The rig of a mode is that of its recordings.
    names_ = [source.label for source in case.recordings if source.mode == proposal.channel] or [
        proposal.channel
    ]
    there = {one.name: one for name in names_ for one in acting(model.effects, name, proposal.channel)}
    simulation = Simulation(
        case.geometry,
        modes()[proposal.channel],
        rubber_of(task.material),
        case.mesh.refinement,
        tuple(there.values()),
        time,
        q,
        None,
        comm=MPI.COMM_SELF,
        prepared=kept.bodies(task, "solid"),
    )
    values: dict[str, float] = dict(model.start)
    for one in model.effects:
        values |= {one.full_name(p): one.values[p.name] for p in one.parameters}
    names = tuple(task.names)
    try:
        answer = simulation.solve(values, names)
    except (NotConverged, ArithmeticError):
        return None
    return Prediction(answer.force, answer.slope, _information(names, fitted))


def _information(names: Sequence[str], fitted: Fitted) -> Array:
    """What the present recordings know of the parameters; nothing of those that were not fitted."""
    slope = np.zeros((len(fitted.linear.jacobian), len(names)))
    for i, name in enumerate(names):
        if name in fitted.names:
            slope[:, i] = fitted.linear.jacobian[:, fitted.names.index(name)]
    return np.asarray(slope.T @ slope)


def _sigma(found: Selection, proposal: Proposal, span: float) -> float:
    for channel in found.plain.channels:
        if channel.recording.mode == proposal.channel:
            return channel.noise.sigma
    return NOISE * span


def _words(proposal: Proposal, distance: float, rivals: Sequence[str]) -> str:
    mode = modes()[proposal.channel]
    unit, factor = (" deg", 180.0 / np.pi) if mode.rotational else (" mm", 1.0)
    if mode.specimen == "coupon":
        unit = ""
    points = ", ".join(f"{factor * q:.3g}" for q in proposal.points)
    rates = sorted({float(f"{factor * v:.3g}") for v in proposal.rates})
    holds = sorted({h for h in proposal.holds if h > 0})
    speed = f"{unit}/s" if unit else " 1/s"
    text = f"{proposal.channel} through {points}{unit} at {' and '.join(f'{v:g}' for v in rates)}{speed}"
    if holds:
        text += f", holding for {' and '.join(f'{h:g}' for h in holds)} s"
    told = (
        f"it would separate {', '.join(rivals)}"
        if distance >= TOLD_APART
        else "it comes nearest to separating " + ", ".join(rivals)
    )
    return f"{text} (about {proposal.cost:.0f} minutes); {told} (by {distance:.3g} standard errors at least)."


def _name(names: Sequence[str]) -> str:
    return " + ".join(map(spoken, names)) or "no effect"
