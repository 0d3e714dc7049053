"""Refit the answer: the values, and the number of branches, with which its effects come closest to the recordings.

The likelihood with the error of form chooses between effects. It ends a fit as soon as better values gain nothing, and
adds no branch to remove a misfit that the formulas' error may explain. The model of the answer is therefore fitted once
more from where the search left it, with the weights of `bushcli inverse`. The priors are weighed against independent
samples of noise as large as the remaining misfit, so that they decide only what the recordings leave open. Branches of
its effects are added while they improve the prediction of held-out data: each cycle and each hold in turn, to first
order.

References
----------
Breiman, Friedman, Olshen and Stone (1984), Classification and Regression Trees, section 3.4.3: a larger model counts
as better only where it predicts better by more than the standard error of the difference.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from bushcli.case import Case
from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.evidence.prior import ParameterPrior, known_parameters
from bushcli.inverse.minimum_search import search
from bushcli.inverse.problem import LeastSquaresProblem, Stopping
from bushcli.recording import Recording
from bushcli.recording.dynamic.rows import RecordedTable
from bushcli.selection.fit import refine_mesh, with_fitted_values
from bushcli.selection.model import Fitted, Model
from bushcli.selection.model_cache import Coarse, ModelCache
from bushcli.selection.neighbours import label
from bushcli.selection.predict import Beside
from bushcli.selection.queue import Search
from bushcli.selection.state import State

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# When the last fit ends: it begins near its minimum, and a hundredth of the misfit is not seen in any number reported.
STOPPING = Stopping(tolerance=1e-3, valley=(6, 1e-2), evaluations=40)
# Least share of the rms misfit of a channel by which a fit is closer than another one: free parameters alone remove
# some hundredths of noise.
CLOSER = 0.05
# Fewest parts of the recordings of which one can be held out.
FEWEST = 2


class _Closest(LeastSquaresProblem):
    """The misfit as an identification weighs it, and the priors of effects.

    Channels and parameters are those of `identification`, `mesh_error` (n,) is added to their forces, N or N mm; the
    misfit that `start` (p,) leaves is the unit of the priors.
    """

    def __init__(
        self,
        identification: LeastSquaresProblem,
        recordings: Sequence[Recording],
        used: Sequence[Mask],
        known: Mapping[str, ParameterPrior],
        start: Array,
        mesh_error: Sequence[Array],
    ) -> None:
        super().__init__(*identification.posed, stopping=STOPPING)
        self._recordings, self._mesh_error = recordings, mesh_error
        self._used, self._known_values, self._unit = used, known, 0.0
        size = np.linalg.norm(self._rows(start)[0])
        self._unit = float(size / np.sqrt(sum(np.count_nonzero(mask) for mask in used)))

    def forces(self, x: Array) -> list[tuple[Array, Array]] | None:
        """Force and derivatives at the samples of each channel; None where a march did not converge."""
        forces = super().forces(x)
        if forces is None or not self._mesh_error:
            return forces
        return [
            (force + error, slope) for (force, slope), error in zip(forces, self._mesh_error, strict=True)
        ]

    @property
    def samples(self) -> int:
        """Number of rows without those that penalise instability."""
        return super().samples + len(self.names)

    def _rows(self, x: Array) -> tuple[Array, Array]:
        forces = self.forces(x)
        if forces is None:
            size = self.samples + len(self.states)
            return np.full(size, np.nan), np.full((size, len(x)), np.nan)
        simulated, jacobians = zip(*forces, strict=True)
        misfits = _weighted(self._recordings, self._used, simulated, jacobians)
        value, slope = _prior_rows(self.names, x, self._known_values)
        unstable, steeper = self._stability(x)
        return (
            np.concatenate([*(r for r, _ in misfits), self._unit * value, unstable]),
            np.concatenate([*(J for _, J in misfits), self._unit * slope, steeper]),
        )


def come_closest(
    cache: ModelCache, case: Case, model: Model, used: tuple[Mask, ...], mesh_error: tuple[Array, ...] = ()
) -> Fitted | None:
    """Fit a model from its values until it comes closest to the recordings; None if it cannot be solved there.

    Parameters
    ----------
    cache : ModelCache
    case : Case
    model : Model
    used : tuple of (n,) array of bool
        Samples that count, by channel.
    mesh_error : tuple of (n,) array, optional
        Force of the default mesh less that of the coarse one, N or N mm, by channel.
    """
    task = model.task(case)
    coarse: Coarse = "never" if model.anchor is None else "memory"
    channels = cache.channels(task, coarse=coarse, anchor=model.anchor)
    identification = task.pose(channels)
    start = identification.bounds.inside(task.vectors()[0])
    if not identification.names or identification.forces(start) is None:
        return None
    sound = [channel.recording.with_gaps_interpolated(m) for channel, m in zip(channels, used, strict=True)]
    known = known_parameters(case, task.effects, float(task.law.shear_modulus(**model.start)), sound)
    problem = _Closest(
        identification, [channel.recording for channel in channels], used, known, start, mesh_error
    )
    problem.watch(problem.reached_stretches(start), start)
    end = search(problem, start)
    return with_fitted_values(model, problem, end.x, end.converged)


def closest_model(search: Search, state: State) -> State:
    """Return the model of the answer at its closest to the recordings, with as many branches as they support.

    Parameters
    ----------
    search : Search
        Whose workers and derivatives are used.
    state : State
        The answer as the search has fitted it.
    """

    def fit_to_the_end(models: Sequence[Model]) -> list[State]:
        for model in models:
            search.progress("fit", label(model), "to the end, as bushcli inverse fits")
        questions = [(problem.case, model, problem.used) for model in models]
        fits: list[Fitted | None] = search.workers.run(come_closest, questions)
        # It improves on a fit that has converged, or has not, however far it gets.
        ended = (replace(fit, converged=state.fitted.converged) for fit in fits if fit is not None)
        return [State(problem, fit) for fit in ended]

    problem = search.problem
    best = next(iter(fit_to_the_end([state.model])), state)
    for other in search.states.values():
        # A model with fewer branches may be closer already, where this search ended in a valley.
        if state.model.contains(other.model) and other.model.identities == state.model.identities:
            best = next(iter(fit_to_the_end([other.model])), best) if _size(other) < _size(best) else best
    while time.perf_counter() < search.deadline and best.leaves_misfit:
        own = [active.effect for active in best.model.effects if active.can_branch]
        more = Beside(best, search.derivatives.additions_beside(best, among=own)).singles() if own else []
        better = [
            candidate
            for candidate in fit_to_the_end([candidate.model for candidate in more])
            if predicts_better(candidate, best)
        ]
        if not better:
            break
        best = min(better, key=lambda candidate: float(held_out_misfits(candidate).sum()))
    return best if _is_closer(best, state) else state


def on_default_mesh(search: Search, state: State) -> State:
    """Return a model with the forces of the default mesh, as close to the recordings there as on its own mesh.

    The error of a coarse mesh is known for the law alone (`ModelCache`), and effects change it. Where a channel is
    farther from its recording for that, the model is fitted once more with the error at its values.

    Parameters
    ----------
    search : Search
        Whose workers are used.
    state : State
    """
    if state.model.anchor is None:
        return state
    problem, workers = search.problem, search.workers
    error = tuple(np.zeros_like(force) for force in state.fitted.simulated)
    expected: State | None = state
    best: State | None = None
    while expected is not None:
        refined = workers.run(refine_mesh, [(problem.case, expected.fitted)])[0]
        found = None if refined is None else State(problem, refined)
        if found is None or (best is not None and _size(found) >= _size(best)):
            break
        best = found
        if not _is_closer(expected, best):
            break
        # The error depends on the values: each round leaves only the share of it that changed with them.
        pairs = zip(error, best.fitted.simulated, expected.fitted.simulated, strict=True)
        error = tuple(known + np.nan_to_num(fine - coarse) for known, fine, coarse in pairs)
        fit = workers.run(come_closest, [(problem.case, best.model, problem.used, error)])[0]
        expected = None if fit is None else State(problem, replace(fit, converged=state.fitted.converged))
    return state if best is None else best


def _is_closer(state: State, other: State) -> bool:
    """Whether a model is closer to a recording than another one, by `CLOSER`."""
    left, left_by_other = (np.array([np.linalg.norm(r) for r, _ in _misfits(s)]) for s in (state, other))
    return bool((left < (1.0 - CLOSER) * left_by_other).any())


def _size(state: State) -> float:
    """Root of the sum of squares of the weighted misfit."""
    return float(np.linalg.norm(np.concatenate([r for r, _ in _misfits(state)])))


def predicts_better(state: State, other: State) -> bool:
    """Whether a model predicts the parts of the recordings that are held out better than another one."""
    gain = held_out_misfits(other) - held_out_misfits(state)
    if len(gain) < FEWEST:
        return False
    return float(gain.sum()) > float(np.sqrt(len(gain)) * gain.std(ddof=1))


def held_out_misfits(state: State) -> Array:
    """Return the sum of squares (parts,) of the misfit of each part of the recordings, predicted from the others.

    The parameters that fit the others follow to first order, within a factor of two.
    """
    misfits = _misfits(state)
    r, J = (np.concatenate(rows) for rows in zip(*misfits, strict=True))
    x = state.fitted.x
    unit = _size(state) / np.sqrt(sum(map(np.count_nonzero, state.problem.used)))
    value, slope = _prior_rows(state.fitted.names, x, state.priors)
    bounds = state.bounds
    limits = np.maximum(bounds.lower - x, -0.5 * np.abs(x)), np.minimum(bounds.upper - x, np.abs(x))
    size = np.linalg.norm(J, axis=0) + 1e-300
    low, high = np.minimum(limits[0], -1e-12) * size, np.maximum(limits[1], 1e-12) * size
    sums = []
    for part in _parts(state.problem.recordings):
        rows = np.concatenate([J[~part], unit * slope]) / size
        step = lsq_linear(rows, -np.concatenate([r[~part], unit * value]), (low, high)).x / size
        sums.append(float(np.sum((r[part] + J[part] @ step) ** 2)))
    return np.array(sums)


def _parts(recordings: Sequence[Recording]) -> list[Mask]:
    """Samples of all channels that belong to each part: a cycle without its holds, a hold, or some rows of a table."""
    names: list[tuple[int, ...]] = []
    for i, recording in enumerate(recordings):
        if isinstance(recording, RecordedTable):
            names += [(i, number) for number in recording.parts()]
            continue
        for j, branch in enumerate(recording.branches):
            name = (i, -1, j) if branch.kind == "hold" else (i, branch.cycle)
            names += [name] * (branch.stop - branch.start)
    return [np.array([name == part for name in names]) for part in dict.fromkeys(names)]


def _misfits(state: State) -> list[tuple[Array, Array]]:
    """Weighted misfit (n,) and derivatives (n, p) of a model, by channel."""
    problem, fitted = state.problem, state.fitted
    return _weighted(problem.recordings, problem.used, fitted.simulated, fitted.jacobians)


def _weighted(
    recordings: Sequence[Recording], used: Sequence[Mask], simulated: Sequence[Array], slopes: Sequence[Array]
) -> list[tuple[Array, Array]]:
    """Misfits and slopes over noise or the floor of the force range; each channel counts alike."""
    rows = []
    for recording, mask, force, slope in zip(recordings, used, simulated, slopes, strict=True):
        unit = 1.0
        if recording.kind == "static":
            unit = max(recording.force_noise, NOISE_FLOOR * float(np.ptp(recording.force[mask])))
        w = np.where(mask, 1.0 / (unit * np.sqrt(np.count_nonzero(mask))), 0.0)
        rows.append(((force - recording.force) * w, slope * w[:, None]))
    return rows


def _prior_rows(names: Sequence[str], x: Array, known: Mapping[str, ParameterPrior]) -> tuple[Array, Array]:
    """Rows (p,) of the priors and their derivatives (p, p); zero for parameters without one."""
    rows = [known[n].row(float(v)) if n in known else (0.0, 0.0) for n, v in zip(names, x, strict=True)]
    return np.array([row for row, _ in rows]), np.diag([slope for _, slope in rows])
