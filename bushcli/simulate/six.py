"""Paths of six motions: their steps, their march, and the results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import Curve, ExactCurve
from bushcli.simulate.steps import FEWEST_OF_SEGMENT
from cases.equilibrium import Equilibrium
from cases.march import History, march
from cases.march import Progress as StepProgress
from cases.mode import Mode, modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.rigid import tangent
from cases.six import PAIR_MODES, SixPath

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SixCurve:
    """Motions and reactions of the inner sleeve along a path.

    Attributes
    ----------
    time : shape (n,)
        s.
    motion, force : shape (n, 6)
        mm and rad; N and N mm, on the sleeve, about its centre, in axes that do not turn.
    free : tuple of int
        Motions that no force holds.
    lead : int
        The motion that does most of the work.
    """

    time: Array
    motion: Array
    force: Array
    free: tuple[int, ...]
    lead: int

    @property
    def mode(self) -> str:
        """The mode whose displacement and force are the leading motion and its reaction."""
        return PAIR_MODES[self.lead]

    @property
    def curve(self) -> Curve:
        """Reaction of the leading motion over that motion, with at least two points."""
        k = self.lead
        if len(self.time) < 2:
            return Curve(self.mode, np.array([0.0, 1e-9]), np.zeros(2))
        return ExactCurve(self.mode, self.motion[:, k], self.force[:, k], self.time)


@dataclass(frozen=True)
class StiffnessMatrices:
    """Stiffness matrices at states of a march.

    Attributes
    ----------
    matrices : mapping of float to (6, 6) array
        By the program's displacement (mm, rad; s of a path): N, mm, rad, (fx fy fz mx my mz) by (ux uy uz rx ry rz).
    """

    matrices: Mapping[float, Array] = field(default_factory=dict)


def six_curve(history: History, six: SixPath) -> SixCurve:
    """Return the motions and reactions of a march along a path."""
    motion = np.zeros((0, 6)) if history.motion is None else history.motion
    force = np.zeros((0, 6)) if history.reactions is None else history.reactions
    work = np.zeros(6)
    if len(motion) > 1:
        work = np.abs(0.5 * (force[1:] + force[:-1]) * np.diff(motion, axis=0)).sum(axis=0)
    return SixCurve(history.displacement, motion, force, six.free, int(np.argmax(work)))


def mode_of(name: str, six: SixPath | None) -> Mode:
    """Return a mode by name, or that of a path of six motions.

    Parameters
    ----------
    name : str
        Name of the mode.
    six : SixPath or None
        The path.
    """
    mode = modes()[name]
    if six is None:
        return mode
    follow = modes()["path"].follow
    assert follow is not None
    return follow(six)


def program_of(six: SixPath, steps: int, also: Sequence[float] = ()) -> Program:
    """Return the steps of a path: `steps` on its longest segment, proportionally fewer on the others.

    The length of a segment is the largest motion on it, each motion as a share of its range.
    """
    span = np.ptp(six.motion, axis=0)
    ranged = np.where(span > 0.0, span, 1.0)
    lengths = np.abs(np.diff(six.motion, axis=0) / ranged).max(axis=1)
    shares = lengths / max(float(lengths.max()), 1e-300)
    counts = np.maximum(FEWEST_OF_SEGMENT, np.ceil(steps * shares)).astype(int)
    parts = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(six.time, six.time[1:], counts, strict=False)]
    times = np.unique(np.concatenate([six.time[:1], *parts, *([also] if len(also) else [])]))
    corners = frozenset(int(i) for i in np.flatnonzero(np.isin(times, six.time[1:-1])))
    return Program(times, times, corners)


def followed(
    model: FiniteElementModel,
    program: Program,
    keep_states: bool,
    progress: StepProgress,
    at: Sequence[float] = (),
) -> tuple[History, StiffnessMatrices]:
    """March along a path of six motions, and take the stiffness matrix at some of its targets.

    Parameters
    ----------
    model : FiniteElementModel
        Model of the path.
    program : Program
        Steps.
    keep_states : bool
        Whether the history holds the displacement field of each step.
    progress : Progress
        Called after each step.
    at : sequence of float
        Targets with a stiffness matrix, in the unit of the program.
    """
    found: dict[float, Array] = {}

    def observe(solver: Equilibrium) -> None:
        if solver.q in at and solver.q not in found:
            solver.factorise()
            found[solver.q] = tangent(model, solver.factor, solver.q).symmetric

    history = march(model, program, keep_states=keep_states, progress=progress, observer=observe)
    return history, StiffnessMatrices(found)


def as_path(mode: Mode, program: Program) -> tuple[SixPath, Program]:
    """Return a mode's program as a path of six motions, without symmetry, and the steps along it from rest on.

    The path's parameter is the distance that the sleeve has travelled.
    """
    program = program.from_rest
    q, time = program.displacement, program.time
    moves = np.diff(q)
    # A hold gets a short distance, over which the pose does not change.
    way = np.where(moves == 0.0, 1e-3 * np.abs(moves).max(), np.abs(moves))
    along = np.concatenate([[0.0], np.cumsum(way)])
    turns = np.flatnonzero(np.sign(moves[1:]) != np.sign(moves[:-1])) + 1
    poses = np.array([pose_of(mode, float(one)) for one in q])
    return SixPath(along, poses, whole=True), Program(along, time, frozenset(map(int, turns)))


def pose_of(mode: Mode, q: float) -> Array:
    """Return where a mode takes the inner sleeve, (6,) in mm and rad."""
    from scipy.spatial.transform import Rotation

    corners = np.column_stack([np.zeros(3), np.eye(3)])
    moved = corners + mode.solid.motion(corners, q)
    turned = moved[:, 1:] - moved[:, :1]
    return np.concatenate([moved[:, 0], Rotation.from_matrix(turned).as_rotvec()])


def whole(six: SixPath) -> SixPath:
    """Return a path without planes of symmetry, so that all six motions are possible."""
    return replace(six, whole=True)
