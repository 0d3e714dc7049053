"""Derivatives of the curves by effects that a model does not have, reused from model to model (`columns`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.effect import Effect
from bushcli.runtime.workers import Workers
from bushcli.selection.columns import Candidate, columns, effects_beside, trials
from bushcli.selection.predict import Beside
from bushcli.selection.prediction import Addition
from bushcli.selection.search_extent import NOT_SIMULATED
from bushcli.selection.state import CommonData, State

Array = NDArray[np.float64]
Name = tuple[object, ...]
"""What a derivative depends on."""

# Least share of an effect's change of the curves that the fitted parameters cannot make: less is rounding.
OWN = 1e-3


@dataclass
class Derivatives:
    """Derivatives by the effects of a catalogue.

    Attributes
    ----------
    progress : callable
        Called with the stage, its subject, and a text about it.
    shear : float
        Shear modulus of the plain law, MPa.
    untestable : dict
        Effects that the recordings cannot show, and why.
    """

    problem: CommonData
    workers: Workers
    catalogue: Sequence[Effect]
    progress: Callable[[str, str, str], None]
    shear: float
    untestable: dict[str, str] = field(default_factory=dict)
    _columns: dict[Name, tuple[Array, ...] | None] = field(default_factory=dict)

    def additions_beside(
        self, state: State, is_plain: bool = False, among: Sequence[Effect] | None = None
    ) -> list[Addition]:
        """Return the change of the curves by every effect beside a model, at every point of its grid.

        Parameters
        ----------
        state : State
            The model with its best-fitting values.
        is_plain : bool
            Whether it is the plain law: effects that change nothing beside it are noted in `untestable`.
        among : sequence of Effect, optional
            These instead of the catalogue.
        """
        candidates: list[Candidate] = []
        for effect in self.catalogue if among is None else among:
            variants, reason = trials(
                self.problem.case, state.model, effect, self.problem.sound_recordings, self.shear
            )
            if not variants and is_plain:
                self.untestable[effect.name] = reason
            candidates += variants
        names = [self._name(state, trial) for trial in candidates]
        self._solve(state, dict(zip(names, candidates, strict=True)))
        additions = []
        for name, trial in zip(names, candidates, strict=True):
            known = self._columns[name]
            if known is None:
                continue
            slopes = tuple(
                feature.of(column)
                for feature, column in zip(self.problem.likelihood.features, known, strict=True)
            )
            if any(np.any(slope) for slope in slopes):
                additions.append(Addition(trial, slopes))
        reasons = {trial.effect.name: NOT_SIMULATED for trial in candidates}
        for name, trial in zip(names, candidates, strict=True):
            if self._columns[name]:
                reasons[trial.effect.name] = "these recordings do not respond to it"
        shown = []
        beside = Beside(state, ())
        for addition in additions:
            size, own = beside.changes(addition)
            if np.max(own / np.where(size > 0.0, size, 1.0)) < OWN:
                reasons[addition.trial.effect.name] = (
                    "the parameters of the law have the same influence on these recordings"
                )
            else:
                shown.append(addition)
        if is_plain:
            for addition in shown:
                reasons.pop(addition.trial.effect.name, None)
            self.untestable |= reasons
        return shown

    def _solve(self, state: State, candidates: Mapping[Name, Candidate]) -> None:
        """Calculate the derivatives of trials that are not known yet."""
        parts = self._parts(candidates)
        # One task for all points that share a body; first those that take longest, so that no worker waits at the end.
        groups: dict[tuple[str, tuple[str, ...], Name, tuple[str, ...]], dict[Name, Candidate]] = {}
        for name, trial in candidates.items():
            if name in self._columns or name in parts:
                continue
            mesh = tuple(trial.active.values[p.name] for p in trial.active.parameters if p.of_mesh)
            known = self._known_channels(state, trial)
            groups.setdefault((trial.active.identity, trial.amplitudes, mesh, known), {})[name] = trial
        tasks = sorted(groups.items(), key=lambda group: _expected_time(group[1]), reverse=True)

        def notify(i: int, answer: tuple[Array, ...]) -> None:
            (*_, known), task = tasks[i]
            for k, (name, trial) in enumerate(task.items()):
                alone = self._columns.get(_name_alone(trial))
                own = tuple(
                    alone[c] if alone is not None and recording.name in known else answer[c][k]
                    for c, recording in enumerate(self.problem.recordings)
                )
                solved = all(np.isfinite(slope).all() for slope in own)
                self._columns[name] = own if solved else None
                point = ", ".join(
                    (*(f"{key} {v:.3g}" for key, v in trial.shape.items()), *(trial.active.channels or ()))
                )
                self.progress("screen", trial.effect.name, point if solved else f"{point} cannot be solved")

        questions = [
            (self.problem.case, state.model, tuple(task.values()), known) for (*_, known), task in tasks
        ]
        self.workers.run(columns, questions, notify)
        self._columns |= {
            name: self._in_channels(trial, self._columns[shared]) for name, (trial, shared) in parts.items()
        }

    def _parts(self, candidates: Mapping[Name, Candidate]) -> dict[Name, tuple[Candidate, Name]]:
        """Return trials in the rig of one channel that are part of a trial in all rigs, with the key of the latter."""
        points = {
            name: (trial.effect.name, *trial.shape.items(), trial.size) for name, trial in candidates.items()
        }
        shared = {
            points[name]: name
            for name, trial in candidates.items()
            if trial.effect.may_be_shared and trial.active.channels is None
        }
        wholes = {name: shared.get(point, name) for name, point in points.items()}
        return {name: (candidates[name], whole) for name, whole in wholes.items() if whole != name}

    def _in_channels(self, trial: Candidate, known: tuple[Array, ...] | None) -> tuple[Array, ...] | None:
        """Return derivatives (n, k) of all channels by an effect in all as those by the effect in some of them."""
        if known is None:
            return None
        recordings = self.problem.recordings
        return tuple(
            slope
            if trial.active.acts_on(recording.name, recording.mode, recording.kind)
            else np.zeros_like(slope)
            for recording, slope in zip(recordings, known, strict=True)
        )

    def _known_channels(self, state: State, trial: Candidate) -> tuple[str, ...]:
        """Return the channels in which the derivative is that beside the law alone: no effect stays active there."""
        if self._columns.get(_name_alone(trial)) is None:
            return ()
        beside = effects_beside(self.problem.case, state.model, trial)
        return tuple(
            r.name
            for r in self.problem.recordings
            if not any(active.acts_on(r.name, r.mode, r.kind) for active in beside)
        )

    def _name(self, state: State, trial: Candidate) -> Name:
        """Return the name of a derivative: effects in the bushing are taken without the other effects there."""
        base: Name = ()
        has_branches = any(active.identity == trial.active.identity for active in state.model.effects)
        if has_branches or effects_beside(self.problem.case, state.model, trial):
            base = (*sorted(state.model.values.items()), *state.model.identities)
        # Any law that was fitted serves for the others, as its values serve for other values.
        law = state.model.law if base or trial.effect.acts == "rig" else ""
        return (law, base, *_point(trial))


def _name_alone(trial: Candidate) -> Name:
    """Return the name of the derivative by an effect in the bushing beside a law alone."""
    return ("", (), *_point(trial))


def _point(trial: Candidate) -> Name:
    return (trial.active.identity, trial.amplitudes, *trial.shape.items(), trial.size)


def _expected_time(task: Mapping[Name, Candidate]) -> tuple[int, int]:
    """Order of tasks by the time that they take: bodies of the assembly are not symmetric, rigs share a curve."""
    effects = {trial.effect.acts for trial in task.values()}
    return 2 * ("assembly" in effects) + ("rubber" in effects), len(task)
