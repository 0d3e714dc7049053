"""The most informative next recording per minute of testing, given the rivals.

Each rival predicts every recording of a menu. The expected gain of information about which of them is right is the
mutual information of model and data, bounded from below by the distances between the predicted curves:

    I >= - sum_k p_k log sum_j p_j exp(-C_kj),

with C the Bhattacharyya distance. It accounts for noise, for the error of form, and for the parameters of both models,
which are free within their posterior and may imitate the other model. As in the likelihood, formulas are wrong by a
share of what their effects do in the new recording, beyond what the law could imitate: a repetition of the recorded
program says little, since the two models differ there by no more than formulas err.

References
----------
Kolchinsky and Tracey (2017), Estimating mixture entropy with pairwise distances, Entropy 19:361,
doi:10.3390/e19070361.
Lindley (1956), On a measure of the information provided by an experiment, Ann. Math. Stat. 27:986-1005,
doi:10.1214/aoms/1177728069.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.diagnosis.menu import Proposal, menu
from bushcli.diagnosis.next_table import TableProposal, expected_table, noise_of, rows, table_menu
from bushcli.diagnosis.posterior import CREDIBLE, MEMBER, WeighedModel
from bushcli.diagnosis.result import NextTest
from bushcli.effects.active import effects_on_channel
from bushcli.effects.names import readable_name
from bushcli.effects.rig import NoEquilibrium
from bushcli.effects.titles import phrase
from bushcli.likelihood.form import LAMBDA, PHI, effective_features
from bushcli.runtime.workers import Workers
from bushcli.selection.model import Model
from bushcli.selection.model_cache import ESTIMATED, ModelCache
from bushcli.selection.state import CommonData
from bushcli.simulate.predict import rubber_of
from bushcli.simulate.simulation import Simulation
from bushcli.standards import observe
from cases.march import NotConverged
from cases.mode import modes

Array = NDArray[np.float64]
Progress = Callable[[str, str, str], None]

# Rivals that are compared, and recordings of the recorded modes that are tried: the cheapest. Each other mode adds
# one. Time: each rival is simulated in each of these recordings.
RIVALS, PROPOSALS = 3, 6
# For modes that have not been recorded: seconds to reach their travel. Judgement: common programs.
SECONDS = 20.0
# Expected noise in a mode that has not been recorded, as a share of the force range. Judgement: within the 0.1 to 1 %
# of the decks' recordings.
NOISE = 3e-3
# Samples on the longest way: judgement: enough for a loop and its ends; each is a step of a march.
SAMPLES = 9
# Least expected gain, in bits, for a recording to be proposed, and distance above which two rivals count as
# distinguished: a probability of 1 in 20 of the wrong one. Words only: a tenth of what decides between two equally
# probable rivals.
WORTH, APART = 0.1, math.log(20.0)


@dataclass(frozen=True)
class ExpectedCurve:
    """Curve that a model predicts for a recording.

    Attributes
    ----------
    force : shape (n,)
        N or N mm.
    spread : shape (n, p)
        Change of the force by one standard deviation of each independent combination of the parameters.
    effects : shape (n,)
        Part of the force that the effects cause, and that no other parameters of the law could.
    """

    force: Array
    spread: Array
    effects: Array


def next_test(
    problem: CommonData, rivals: Sequence[WeighedModel], workers: Workers, notify: Progress
) -> NextTest | None:
    """Return the recording with the largest expected gain of information per minute; None where none is worth it."""
    chosen, weights = _rival_sets(rivals)
    if len(chosen) < 2:
        return None
    possible = float(-np.sum(weights * np.log2(weights)))
    best: tuple[float, NextTest] | None = None
    proposals: list[Proposal | TableProposal] = [*_menu(problem), *table_menu(problem)]
    for proposal, answers in _expectations(problem, chosen, proposals, workers, notify):
        if any(answer is None for answer in answers):
            continue
        if isinstance(proposal, TableProposal):
            errors = noise_of(problem)
            answers = [ExpectedCurve(*rows(answer, answers[0].stiffness, errors)) for answer in answers]
            sigma = 1.0
        else:
            sigma = _sigma(problem, proposal, max(float(np.ptp(answer.force)) for answer in answers))
        apart = np.array([[distance(a, b, sigma) for b in answers] for a in answers])
        nats = -float(np.sum(weights * np.log(np.exp(-apart) @ weights)))
        bits = nats / math.log(2.0)
        if bits > WORTH and (best is None or bits / proposal.cost > best[0]):
            pairs = tuple(
                (model, other)
                for i, model in enumerate(chosen)
                for j, other in enumerate(chosen[:i])
                if apart[i, j] > APART
            )
            best = bits / proposal.cost, _test(proposal, bits, possible, pairs)
    return None if best is None else best[1]


def _expectations(
    problem: CommonData,
    rivals: Sequence[WeighedModel],
    proposals: Sequence[Proposal | TableProposal],
    workers: Workers,
    notify: Progress,
) -> list[tuple[Proposal | TableProposal, list[Any]]]:
    """Return each proposal with what every rival expects of it; all are asked at once, so that no worker waits."""
    expected: list[tuple[Proposal | TableProposal, list[Any]]] = []
    for kind, predict in ((Proposal, expected_curve), (TableProposal, expected_table)):
        pairs = [
            (proposal, model) for proposal in proposals if isinstance(proposal, kind) for model in rivals
        ]

        def report(
            i: int, _: object, pairs: Sequence[tuple[Proposal | TableProposal, WeighedModel]] = pairs
        ) -> None:
            if i % len(rivals) == 0:
                notify("next", "test", pairs[i][0].name)

        questions = [(problem.case, model.state.model, _spread(model), proposal) for proposal, model in pairs]
        answers = workers.run(predict, questions, report)
        for i in range(0, len(pairs), len(rivals)):
            expected.append((pairs[i][0], answers[i : i + len(rivals)]))
    return expected


def _rival_sets(models: Sequence[WeighedModel]) -> tuple[list[WeighedModel], Array]:
    """Return the rival sets of effects, each with its best law, and their shares (k,) of the probability."""
    best: dict[tuple[str, ...], WeighedModel] = {}
    sums: dict[tuple[str, ...], float] = {}
    for model in models:
        if model.predicted is None and (model.state.model.effects or not model.unknown):
            names = model.state.model.identities
            sums[names] = sums.get(names, 0.0) + model.probability
            if names not in best or model.probability > best[names].probability:
                best[names] = model
    # Those of the credible set, and every other one that the report names.
    order, total = [], 0.0
    for names in sorted(sums, key=lambda names: -sums[names])[:RIVALS]:
        if total >= CREDIBLE * sum(sums.values()) and sums[names] < MEMBER:
            break
        order.append(names)
        total += sums[names]
    weights = np.array([sums[names] for names in order])
    return [best[names] for names in order], weights / max(float(weights.sum()), 1e-300)


def _spread(model: WeighedModel) -> tuple[tuple[str, ...], Array]:
    """Names of the parameters, and a square root (p, p) of their posterior covariance."""
    values, vectors = np.linalg.eigh(model.state.evidence.covariance)
    return model.state.fitted.names, vectors * np.sqrt(np.maximum(values, 0.0))


def expected_curve(
    cache: ModelCache, case: Case, model: Model, known: tuple[tuple[str, ...], Array], proposal: Proposal
) -> ExpectedCurve | None:
    """Return the curve that a rival predicts for a recording; None where it cannot be solved.

    `known` has the names of the parameters and a square root of their posterior covariance, shape (p, p).
    """
    whole, law_alone = (
        _simulation(cache, case, variant, proposal) for variant in (model, replace(model, effects=()))
    )
    names, root = known
    try:
        for simulation in (whole, law_alone):
            simulation.plan(1.0, ESTIMATED)
        answer = whole.solve(model.values, names)
        bare = law_alone.solve(model.start, ())
    except (NotConverged, NoEquilibrium):
        return None
    law = answer.slope[:, [name in model.start for name in names]]
    effects = answer.force - bare.force
    effects = effects - law @ np.linalg.lstsq(law, effects, rcond=None)[0]
    return ExpectedCurve(answer.force, answer.slope @ root, effects)


def _simulation(cache: ModelCache, case: Case, model: Model, proposal: Proposal) -> Simulation:
    """Return the simulation of a proposed recording by a model."""
    time, q = proposal.program(SAMPLES)
    task = model.task(case)
    # A recording of this mode is made on the same rig as the present recordings of it. Another mode has a rig of its
    # own, with another load cell, of which the recordings say nothing.
    labels = [recording.label for recording in case.recordings if recording.mode == proposal.channel]
    effects = [active for active in model.effects if labels or not active.effect.of_channel]
    acting_effects = {
        active.identity: active
        for name in labels or [proposal.channel]
        for active in effects_on_channel(effects, name, proposal.channel)
    }
    return Simulation(
        case.geometry,
        modes()[proposal.channel],
        rubber_of(task.material),
        case.mesh.refinement,
        tuple(acting_effects.values()),
        time,
        q,
        None,
        comm=MPI.COMM_SELF,
        prepared=cache.bodies(task, "always"),
    )


def distance(right: ExpectedCurve, other: ExpectedCurve, sigma: float) -> float:
    """Return the Bhattacharyya distance of two predictions with their uncertainty; `sigma` of the noise, N or N mm."""
    difference = (right.force - other.force) / sigma
    spread = np.hstack([right.spread, other.spread]) / sigma
    signal = float(np.sum((right.force / sigma) ** 2))
    # The formulas of both models may be wrong: the mean of their errors of form.
    explained = 0.5 * float(np.sum((right.effects / sigma) ** 2) + np.sum((other.effects / sigma) ** 2))
    v = 1.0 + (LAMBDA**2 * signal + PHI**2 * explained) / effective_features(len(difference))
    # d' (v + S S')^-1 d, by the smaller system of the parameters.
    inner = v * np.eye(spread.shape[1]) + spread.T @ spread
    imitated = (spread.T @ difference) @ np.linalg.solve(inner, spread.T @ difference)
    return max(float(difference @ difference - imitated), 0.0) / (8.0 * v)


def _menu(problem: CommonData) -> list[Proposal]:
    """Return the cheapest recordings of the modes that have been recorded, and one of each other mode."""
    mounted = [recording.mode for recording in problem.recordings if recording.kind == "static"]
    amplitudes: dict[str, float] = {}
    rate: dict[str, float] = {}
    for recording in problem.recordings:
        if recording.kind == "dynamic":
            continue
        reach = float(np.abs(recording.displacement).max())
        amplitudes[recording.mode] = max(reach, amplitudes.get(recording.mode, 0.0))
        # The fastest ramp, so that "ten times as fast" is. A hold has no speed, nor has a recording without times.
        fastest = max(observe(recording).rates, default=reach / SECONDS)
        rate[recording.mode] = max(fastest, rate.get(recording.mode, 0.0))
    proposals = list(menu(amplitudes, rate, mounted)[:PROPOSALS])
    wall = problem.case.geometry.wall
    if wall is not None and mounted:
        others = {
            mode.name: mode.proposed_travel * (1.0 if mode.rotational else wall.thickness)
            for mode in modes().values()
            if mode.proposed_travel is not None and mode.name not in mounted
        }
        rates = {name: reach / SECONDS for name, reach in others.items()}
        proposals += [proposal for proposal in menu(others, rates, mounted) if proposal.repeats]
    return proposals


def _sigma(problem: CommonData, proposal: Proposal, span: float) -> float:
    for recording, noise in zip(problem.recordings, problem.noises, strict=True):
        if (recording.mode, recording.kind) == (proposal.channel, "static"):
            return noise.sigma
    return NOISE * span


def _test(
    proposal: Proposal | TableProposal,
    bits: float,
    possible: float,
    pairs: tuple[tuple[WeighedModel, WeighedModel], ...],
) -> NextTest:
    names = [(_name(a, phrase), _name(b, phrase)) for a, b in pairs]
    separates = tuple((_name(a, readable_name), _name(b, readable_name)) for a, b in pairs)
    rates: tuple[float, ...] = ()
    holds: tuple[float, ...] = ()
    levels: list[tuple[float, ...]] = []
    if isinstance(proposal, TableProposal):
        table = proposal.table
        points, *levels = (
            tuple(map(float, np.unique(values[np.isfinite(values)])))
            for values in (table.preload, table.frequency, table.amplitude, table.temperature)
        )
        text = f"a table of dynamic stiffness: {proposal.text}"
    else:
        points, rates, holds = proposal.points, proposal.rates, proposal.holds
        text = _words(proposal)
    cost, name, channel = proposal.cost, proposal.name, proposal.channel
    text += _gains(cost, names)
    return NextTest(name, channel, points, rates, holds, cost, bits, possible, separates, text, *levels)


def _words(proposal: Proposal) -> str:
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
    return text


def _gains(cost: float, pairs: Sequence[tuple[str, str]]) -> str:
    """Return the cost of a test and what it would distinguish, for the end of a sentence."""
    gain = "it would not settle the question, but is the most informative of the possible tests"
    if pairs:
        gain = f"it would distinguish {'; '.join(f'{a} from {b}' for a, b in pairs)}"
    return f" (about {cost:.0f} minutes with the set-up of the rig); {gain}."


def _name(model: WeighedModel, of: Callable[[str], str]) -> str:
    return " + ".join(map(of, model.effects)) or "no effect"
