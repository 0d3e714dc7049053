"""A channel: one measured curve, its model, and the weight of their difference.

Coupons and bushings are treated alike: a model with a mode. There is one class for each kind of simulation: a law
without history is solved once over the range of the curve, and every recorded sample, whatever its cycle, is
interpolated from that solution (`SweptChannel`); with effects, or with six motions, the recorded path is followed
(`FollowedChannel`); a table of dynamic stiffness is `bushcli.inverse.dynamic_channel.DynamicChannel`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from typing_extensions import override

from bushcli.curve.curve import Curve
from bushcli.curve.earlier import Earlier
from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.curve.symmetry import both_halves, swept_range
from bushcli.effects.active import ActiveEffect
from bushcli.effects.rig import NoEquilibrium
from bushcli.inverse.result import Weighting
from bushcli.recording import Recording
from bushcli.simulate.derivatives import local_slopes
from bushcli.simulate.extent import Extent, of_path
from bushcli.simulate.simulation import FollowedPath
from bushcli.simulate.steps import IDENTIFIED, steps_of_sweep
from cases.local import Cells
from cases.march import TOLERANCE, History, failure_at_start
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.simulate import even_targets, is_odd, sweep

Array = NDArray[np.float64]

# Even points over a coupon's range. Up to this many recorded strains are solved too, with a third of the even points.
DENSE = 60
# A relative misfit is divided by the stress, or by this share of the largest stress where the stress is smaller.
RELATIVE_FLOOR = 0.05
# Sampled states of the rubber in which the law has to be stable, per channel.
REACHED = 60
# Solved curves that are cached: one fit often begins where another one ended, and a curve may take some seconds.
CACHED = 32
# Failed steps that every march is allowed if no limit is given.
ALLOWED = 3


@dataclass(frozen=True)
class ChannelForces:
    """Force at the solved displacements, shape (m,), and its derivatives, shape (m, parameters).

    Nothing else of an evaluation has to be saved, because samples are interpolated from it. For a channel with effects
    the solved displacements are those of the samples. `states`, shape (n, 3), is a sample of the rubber's isochoric
    principal stretches at the ends of the range; None for coupons and for marched paths.
    """

    displacement: Array
    force: Array
    slope: Array
    states: Array | None = None

    @property
    def is_finite(self) -> bool:
        """Whether all are numbers: close to a singular tangent the derivatives of a solved curve may exceed all."""
        return bool(np.isfinite(self.force).all() and np.isfinite(self.slope).all())


@dataclass(frozen=True)
class MeshCorrection:
    """Factor and difference, shape (n,), that correct the force of a model on a coarse mesh to the usual mesh."""

    share: float
    offset: Array


Corrected = Callable[[str, FiniteElementModel], MeshCorrection | None]
"""Name and model of a channel -> the correction of its mesh; None on the usual mesh."""


@dataclass
class StepLimit:
    """Failed steps after which marches of one channel are given up; it belongs to one fit, and learns from its marches.

    Once a march has reached its end, a march with far more failed steps belongs to a trial that is too far off; to cut
    its steps down to the smallest takes a hundred times as long as to solve a good trial.

    Attributes
    ----------
    given : int or None
        Limit of every march. None: unlimited at first, then derived from the marches that have reached their end.
    hardest : int or None
        Largest number of failed steps of a march that reached its end; None before the first one.
    """

    given: int | None = None
    hardest: int | None = None

    @property
    def steps(self) -> int | None:
        """Failed steps after which the next march is given up; None: `cases.march` decides."""
        return self.given if self.given is not None or self.hardest is None else ALLOWED + 2 * self.hardest

    def learn(self, history: History) -> None:
        """Take note of a march that has reached its end."""
        failed = sum(not attempt.accepted for attempt in history.attempts)
        self.hardest = failed if self.hardest is None else max(self.hardest, failed)


class FitChannel(ABC):
    """What a least-squares problem asks of a channel: measured rows, their scale, and the model's answer to each."""

    model: FiniteElementModel
    # Effects that act on it, at its temperature.
    active: tuple[ActiveEffect, ...] = ()
    # Whether the data are from a material test.
    coupon: bool = False
    # Measured rows (n,), proportional to the stiffness of the specimen.
    measured: Array
    # Size of a unit of misfit at each row (n,); inf where it is not used.
    scale: Array

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the channel."""

    @property
    def comm(self) -> MPI.Comm:
        """Ranks that share the model."""
        return self.model.comm

    @property
    def stretches(self) -> tuple[float, ...]:
        """Stretches of a coupon at the samples, at which the law has to be stable; none of a bushing."""
        return ()

    def _set_constants(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """Set and return the constants of the model; parameters of effects that do not act on it are none of them."""
        constants = {k: v for k, v in parameters.items() if k in self.model.constants}
        self.model.set_parameters(constants)
        return constants

    @abstractmethod
    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], limit: StepLimit | None = None
    ) -> ChannelForces:
        """Return the answer for parameters by name, in their units, and its exact derivatives by those named.

        The march learns its limit of failed steps, and is given up beyond it. Raises `NotConverged`.
        """

    @abstractmethod
    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        """Return the model's rows (n,) and their derivatives (n, parameters)."""

    def reached_stretches(
        self, parameters: Mapping[str, float], answer: ChannelForces, limit: StepLimit
    ) -> Array:
        """Return a sample (n, 3) of isochoric stretches at the ends of the range; none of a coupon; collective."""
        return np.zeros((0, 3)) if answer.states is None else answer.states

    @abstractmethod
    def extent(self, temperature: float | None) -> Extent:
        """Return what the data cover, at a temperature in degrees C that the data do not say themselves."""


class Channel(FitChannel):
    """One measured curve and its model.

    Attributes
    ----------
    recording : Recording
    noise : float
        Standard deviation of the force's noise, the displacement's included, in the recording's force unit.
    branch : str
        Of a coupon: the branch that is used, "loading", "unloading" or "both"; empty where the recording has one alone.
    targets : shape (m,)
        Displacements at which the curve is solved.
    odd : bool
        Whether one side of the curve gives the other.
    before : Earlier or None
        The path before the recording that is assumed, where the rubber remembers it.
    simulation : FollowedPath or None
        None where the curve is swept.
    """

    before: Earlier | None = None
    simulation: FollowedPath | None = None

    def __init__(
        self,
        recording: Recording,
        model: FiniteElementModel,
        noise: float,
        weighting: Weighting | None,
        faulty: NDArray[np.bool_],
        branch: str = "",
    ) -> None:
        self.recording, self.model, self.noise, self.branch = recording, model, noise, branch
        mode, q, force = modes()[recording.mode], recording.displacement, recording.force
        self.measured, self.coupon, self.odd = (
            force,
            mode.specimen == "coupon",
            is_odd(model.mesh.shape, mode),
        )
        ends = swept_range(q, self.odd)
        dimension = model.mesh.dimension
        steps = steps_of_sweep(model.mesh.shape, dimension) if dimension == 3 else IDENTIFIED
        self.targets = _coupon_targets(q) if self.coupon else even_targets(*ends, steps)
        size = np.abs(force)
        if weighting is None:
            self.scale = np.full(len(q), max(noise, NOISE_FLOOR * float(np.ptp(force))))
        elif weighting == "absolute":
            self.scale = np.full(len(q), float(size.max()))
        else:
            self.scale = np.maximum(size, RELATIVE_FLOOR * float(size.max()))
        # Spikes and stuck samples are not the bushing's response.
        self.scale[faulty] = np.inf

    @property
    @override
    def name(self) -> str:
        return self.recording.name

    @property
    @override
    def stretches(self) -> tuple[float, ...]:
        mode = modes()[self.recording.mode]
        used = self.coupon and not mode.needs_compressibility
        return tuple(map(float, mode.stretch(self.recording.displacement))) if used else ()

    @override
    def extent(self, temperature: float | None) -> Extent:
        path = self.recording
        return of_path(path.mode, path.displacement, path.time, temperature)

    def plan(self, fineness: float, tolerance: float) -> None:
        """Choose the steps along a path that is followed, and the tolerance of the march.

        Parameters
        ----------
        fineness : float
            Factor on the default number of steps.
        tolerance : float
            Largest out-of-balance force of an equilibrium, a share of the norm of the reactions.
        """

    @abstractmethod
    def local_slopes(self, parameters: Mapping[str, float]) -> tuple[Array, Cells]:
        """Return derivatives (n, cells) of the force at the samples by the stiffness of each cell, and the cells.

        The parameters are those of `solve`. Raises `NotConverged`.
        """

    @abstractmethod
    def curve(self, answer: ChannelForces) -> Curve:
        """Return the solved curve over the recorded range, smooth enough to be drawn; with effects, along the path."""


class SweptChannel(Channel):
    """A curve of rubber without memory, solved once over its range."""

    def __init__(
        self,
        recording: Recording,
        model: FiniteElementModel,
        weighting: Weighting | None,
        faulty: NDArray[np.bool_],
        branch: str = "",
    ) -> None:
        # The noise of the displacement is converted by the mean stiffness.
        noise = float(np.hypot(recording.force_noise, recording.noise_of_motion))
        super().__init__(recording, model, noise, weighting, faulty, branch)
        # Solved curves by parameter values and names of the derivatives.
        self._solved: dict[tuple[object, ...], ChannelForces] = {}
        self._tolerance = TOLERANCE

    @override
    def plan(self, fineness: float, tolerance: float) -> None:
        if self.model.mesh.dimension == 3:
            self._tolerance = tolerance
            self._solved.clear()

    @override
    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], limit: StepLimit | None = None
    ) -> ChannelForces:
        key = (*self._set_constants(parameters).items(), *names)
        if key not in self._solved:
            if len(self._solved) == CACHED:
                self._solved.pop(next(iter(self._solved)))
            self._solved[key] = self._sweep(names, StepLimit() if limit is None else limit)
        return self._solved[key]

    def _sweep(self, names: Sequence[str], limit: StepLimit) -> ChannelForces:
        history = sweep(
            self.model,
            self.targets,
            tolerance=self._tolerance,
            sensitivity=tuple(names),
            failure_limit=limit.steps,
        )
        limit.learn(history)
        q, force, slope = history.displacement, history.force, history.sensitivity
        states = None if self.coupon else isochoric_sample(self.model.comm, history.stretches)
        return ChannelForces(q, force, np.zeros((len(force), 0)) if slope is None else slope, states)

    @override
    def local_slopes(self, parameters: Mapping[str, float]) -> tuple[Array, Cells]:
        self._set_constants(parameters)
        return local_slopes(self.model, self.recording.displacement, self.odd)

    @override
    def curve(self, answer: ChannelForces) -> Curve:
        q = self.recording.displacement
        fine = np.linspace(q.min(), q.max(), 101)
        if q.min() < 0.0 < q.max():
            fine = np.unique(np.append(fine, 0.0))
        return Curve(self.recording.mode, fine, self._interpolate(answer, fine)[:, 0])

    @override
    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        columns = self._interpolate(answer, self.recording.displacement)
        return columns[:, 0], columns[:, 1:]

    def _interpolate(self, answer: ChannelForces, displacement: Array) -> Array:
        """Return force and derivatives at displacements (n,), shape (n, 1 + parameters)."""
        from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed

        q, values = answer.displacement, np.column_stack([answer.force, answer.slope])
        return np.asarray(CubicSpline(*(both_halves(q, values) if self.odd else (q, values)))(displacement))


class FollowedChannel(Channel):
    """A recorded path that is followed with the effects that act on it: of one motion, or one reaction of six.

    A marched path is free of the displacement's noise.
    """

    simulation: FollowedPath

    def __init__(
        self,
        recording: Recording,
        simulation: FollowedPath,
        weighting: Weighting | None,
        faulty: NDArray[np.bool_],
        branch: str = "",
        corrected: Corrected | None = None,
    ) -> None:
        super().__init__(recording, simulation.model, recording.force_noise, weighting, faulty, branch)
        self.simulation, self.active, self.before = simulation, simulation.active, simulation.path_before
        self._correction = None if corrected is None else corrected(recording.name, self.model)

    @override
    def plan(self, fineness: float, tolerance: float) -> None:
        self.simulation.plan(fineness, tolerance)

    @override
    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], limit: StepLimit | None = None
    ) -> ChannelForces:
        limit = StepLimit() if limit is None else limit
        try:
            answer = self.simulation.solve(parameters, names, failure_limit=limit.steps)
        except NoEquilibrium as error:
            raise failure_at_start(str(error)) from None
        limit.learn(answer.history)
        places = self.recording.places
        ends = answer.history.stretches
        states = isochoric_sample(self.comm, ends) if ends and not self.coupon else None
        return ChannelForces(self.recording.displacement, answer.force[places], answer.slope[places], states)

    @override
    def reached_stretches(
        self, parameters: Mapping[str, float], answer: ChannelForces, limit: StepLimit
    ) -> Array:
        if self.coupon or answer.states is not None:
            return super().reached_stretches(parameters, answer, limit)
        self._set_constants(parameters)
        return isochoric_sample(self.comm, self.simulation.stretches_at_ends(limit.given))

    @override
    def local_slopes(self, parameters: Mapping[str, float]) -> tuple[Array, Cells]:
        self._set_constants(parameters)
        slope, cells = self.simulation.local_slopes()
        return slope[self.recording.places], cells

    @override
    def curve(self, answer: ChannelForces) -> Curve:
        path = self.simulation.path[self.recording.places]
        return Curve(self.recording.mode, path, answer.force, self.recording.time)

    @override
    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        if self._correction is None:
            return answer.force, answer.slope
        share = self._correction.share
        return share * answer.force + self._correction.offset, share * answer.slope


def isochoric_sample(comm: MPI.Comm, stretches: Sequence[Array]) -> Array:
    """Return a sample (m, 3) of the isochoric part of principal stretches, each (n, 3) of this rank."""
    every = np.concatenate(comm.allgather(np.concatenate(stretches)))
    isochoric = every / np.prod(every, axis=1, keepdims=True) ** (1.0 / 3.0)
    # The most stretched state, and an even sample of the rest: neighbouring Gauss points differ little.
    order = np.argsort(isochoric[:, -1])
    chosen = order[np.unique(np.linspace(0, len(order) - 1, REACHED).round().astype(int))]
    return np.asarray(isochoric[chosen])


def _coupon_targets(q: Array) -> Array:
    distinct = np.unique(q)
    count = DENSE if len(distinct) > DENSE else DENSE // 3
    # The even points make a smooth curve from few samples, and steps that the march can take.
    even = np.linspace(min(0.0, distinct[0]), max(0.0, distinct[-1]), count)
    if len(distinct) > DENSE:
        return even
    # Points that nearly coincide would spoil the spline.
    gap = np.abs(even[:, None] - distinct).min(axis=1) > 0.2 * np.diff(even).min()
    return np.union1d(distinct, even[gap])
