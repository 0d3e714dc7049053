"""The recording that would tell rivals apart: each foretells every recording of a menu, and the cheapest decides."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.casefile import Case
from bushcli.diagnosis import kept
from bushcli.diagnosis.discriminate import Prediction, Separation, next_test, separate
from bushcli.diagnosis.menu import Proposal, menu
from bushcli.diagnosis.model import Fitted, Model
from bushcli.diagnosis.result import NextTest
from bushcli.diagnosis.rivals import TOLD_APART
from bushcli.diagnosis.selected import Selection
from bushcli.diagnosis.usual import usual_value
from bushcli.diagnosis.workers import Workers
from bushcli.direct import rubber_of
from bushcli.effect import ActiveEffect, Effect, acting, effects, full_name
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
    case: Case, found: Selection, rivals: Sequence[tuple[str, ...]], crew: Workers, told: Progress
) -> NextTest | None:
    """The cheapest recording that separates rivals; None where none on the menu does."""
    models = _models(found, rivals[:MOST_RIVALS])
    if len(models) < 2:
        return None
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
            separations.append(separate(proposal, known, _sigma(found, proposal, span)))
            if separations[-1].decides:
                return _test(separations[-1], models)
    best = next_test(separations)
    return None if best is None else _test(best, models)


def _test(best: Separation, models: Sequence[str] | Mapping[str, object]) -> NextTest:
    pairs = [pair for pair, distance in best.distances.items() if distance >= TOLD_APART]
    return NextTest(
        name=best.proposal.name,
        channel=best.proposal.channel,
        points=best.proposal.points,
        rates=best.proposal.rates,
        holds=best.proposal.holds,
        minutes=best.proposal.cost,
        separates=tuple(pair for pair in pairs if pair[0] < pair[1]) or (best.pair,),
        distance=best.worst,
        text=_words(best.proposal, best.worst, tuple(models)),
    )


def _models(found: Selection, rivals: Sequence[tuple[str, ...]]) -> dict[str, tuple[Model, Fitted]]:
    """Each rival with values: as refitted, or at a typical size where there is nothing to fit it to."""
    made: dict[str, tuple[Model, Fitted]] = {}
    for names in rivals:
        refit = found.refits.get(tuple(sorted(names)))
        if names == tuple(found.best.model.names):
            refit = found.best
        if refit is None:
            added = [_usual(effects()[name], found) for name in names if name in effects()]
            if len(added) != len(names):
                continue
            made[_name(names)] = (replace(found.plain.model, effects=tuple(added)), found.plain)
        else:
            made[_name(names)] = (refit.model, refit)
    return made


def _usual(effect: Effect, found: Selection) -> ActiveEffect:
    recordings = [channel.recording for channel in found.plain.channels]
    return ActiveEffect(
        effect, {p.name: usual_value(effect, p, recordings) for p in effect.parameters if not p.optional}
    )


def _menu(case: Case, found: Selection, recorded: bool) -> list[Proposal]:
    """Recordings of the modes that have been recorded, or of the others."""
    mounted = [channel.recording.mode for channel in found.plain.channels]
    amplitudes: dict[str, float] = {}
    others: dict[str, float] = {}
    rate: dict[str, float] = {}
    for channel in found.plain.channels:
        q, t = channel.recording.displacement, channel.recording.time
        reach = float(np.abs(q).max())
        amplitudes[channel.recording.mode] = reach
        path = float(np.abs(np.diff(q)).sum())
        rate[channel.recording.mode] = path / float(t[-1] - t[0]) if t is not None else reach / SECONDS
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
    simulation = Simulation(
        case.geometry,
        modes()[proposal.channel],
        rubber_of(task.material),
        case.mesh.refinement,
        acting(model.effects, proposal.channel, proposal.channel),
        time,
        q,
        None,
        comm=MPI.COMM_SELF,
        prepared=kept.bodies(task, "solid"),
    )
    values: dict[str, float] = dict(model.start)
    for one in model.effects:
        values |= {full_name(one.effect, p): one.values[p.name] for p in one.parameters}
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
    return " + ".join(names) or "no effect"
