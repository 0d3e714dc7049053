"""A channel: one measured curve, its model, and the weight of their difference.

Coupons and bushings are treated alike: a model with a mode. A law without history is solved once over the range of the
curve, and every recorded sample, whatever its cycle, is interpolated from that solution. With effects the channel is a
`bushcli.simulate.simulation.Simulation`, which follows the recorded path where the rubber has memory.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.curve.curve import Curve
from bushcli.curve.earlier import Earlier, earlier
from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.curve.odd import swept_range, unfolded
from bushcli.effects.active import ActiveEffect, acting, require_time
from bushcli.effects.rig import NoEquilibrium
from bushcli.faults import bad_samples
from bushcli.inverse.result import Weighting
from bushcli.recording import (
    Recording,
    displacement_noise,
    force_noise,
)
from bushcli.simulate.reaction import Paths, Reaction, reaction
from bushcli.simulate.simulation import FollowedPath, Simulation
from bushcli.simulate.steps import IDENTIFIED
from cases.equilibrium import Equilibrium
from cases.march import History, unsolved
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.simulate import Prepare, Rubber, even_targets, is_odd, prepare, sweep
from cases.stretches import principal_stretches
from geometry.shape import Shape

Array = NDArray[np.float64]

# Even points over a coupon's range. Up to this many recorded strains are solved too, with a third of the even points.
DENSE = 60
# A relative misfit is divided by the stress, or by this share of the largest stress where the stress is smaller.
RELATIVE_FLOOR = 0.05
# Sampled states of the rubber in which the law has to be stable, per channel.
REACHED = 60
# Solved curves that are cached: one fit often begins where another one ended, and a curve may take some seconds.
KEPT = 32


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


class FitChannel(Protocol):
    """What a least-squares problem asks of a channel: measured rows, their scale, and the model's answer to each."""

    @property
    def scale(self) -> Array:
        """Size of a unit of misfit at each row, shape (n,); inf where it is not used."""

    @property
    def comm(self) -> MPI.Comm:
        """Ranks that share the model."""

    @property
    def coupon(self) -> bool:
        """Whether the data are from a material test."""

    @property
    def name(self) -> str:
        """Name of the channel."""

    @property
    def active(self) -> tuple[ActiveEffect, ...]:
        """Effects that act on it, at its temperature."""

    @property
    def measured(self) -> Array:
        """Measured rows, shape (n,), proportional to the stiffness of the specimen."""

    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], patience: Patience | None = None
    ) -> ChannelForces:
        """Return the answer for a set of parameters, and its derivatives with respect to those named."""

    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        """Return the model's rows (n,) and their derivatives (n, parameters)."""

    def reached(self, parameters: Mapping[str, float], patience: Patience) -> Array:
        """Return a sample of the isochoric principal stretches that the rubber reaches, shape (n, 3)."""


class Channel:
    """One measured curve and its model; a `FitChannel`.

    Attributes
    ----------
    recording : Recording
    scale : shape (n,)
        Force that counts as a unit of misfit at each sample, in the recording's force unit; inf at a sample that is
        bad or not used.
    branch : str
        Of a coupon: the branch that is used, "loading", "unloading" or "both"; empty where the recording has one alone.
    coupon : bool
        Whether the curve is from a material test.
    comm : MPI.Comm
        Ranks that share the model.
    noise : float
        Standard deviation of the force's noise, the displacement's included, in the recording's force unit.
    """

    def __init__(
        self,
        recording: Recording,
        shape: Shape,
        rubber: Rubber,
        case: Case,
        weighting: Weighting | None,
        comm: MPI.Comm,
        prepared: Prepare = prepare,
        paths: Paths | None = None,
        corrected: Corrected | None = None,
        bad: NDArray[np.bool_] | None = None,
        branch: str = "",
    ) -> None:
        self.recording, self.comm, self.branch = recording, comm, branch
        mode = modes()[recording.mode]
        self.simulation: FollowedPath | None = (
            _with_effects(recording, shape, rubber, case, comm, prepared)
            if recording.six is None
            else reaction(
                recording,
                recording.six,
                {} if paths is None else paths,
                shape,
                rubber,
                case,
                case.mesh.refinement,
                comm,
                prepared,
            )
        )
        self.model: FiniteElementModel = (
            prepared(shape, mode, rubber, case.mesh.refinement, comm)
            if self.simulation is None
            else self.simulation.model
        )
        self._correction = None if corrected is None else corrected(recording.name, self.model)
        # Solved curves by parameter values and names of the derivatives.
        self._solved: dict[tuple[object, ...], ChannelForces] = {}
        self.odd = is_odd(shape, mode)
        q = recording.displacement
        self.coupon = mode.specimen == "coupon"
        self.targets = (
            _coupon_targets(q) if self.coupon else even_targets(*swept_range(q, self.odd), IDENTIFIED)
        )
        # A marched path is free of the displacement's noise.
        self.noise = _noise(recording) if self.simulation is None else force_noise(recording)
        size = np.abs(recording.force)
        if weighting is None:
            self.scale = np.full(len(q), max(self.noise, NOISE_FLOOR * float(np.ptp(recording.force))))
        elif weighting == "absolute":
            self.scale = np.full(len(q), float(size.max()))
        else:
            self.scale = np.maximum(size, RELATIVE_FLOOR * float(size.max()))
        # Spikes and stuck samples are not the bushing's response.
        self.scale[bad_samples(recording) if bad is None else bad] = np.inf

    @property
    def name(self) -> str:
        """Name of the channel."""
        return self.recording.name

    @property
    def active(self) -> tuple[ActiveEffect, ...]:
        """Effects that act on it, at its temperature."""
        return () if self.simulation is None else tuple(self.simulation.active)

    @property
    def measured(self) -> Array:
        """Recorded force, shape (n,)."""
        return self.recording.force

    @property
    def before(self) -> Earlier | None:
        """The path before the recording that is assumed, where the rubber remembers it."""
        return None if self.simulation is None else self.simulation.remembered

    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], patience: Patience | None = None
    ) -> ChannelForces:
        """Return the curve for a set of parameters, and its exact derivatives with respect to those named.

        Parameters
        ----------
        parameters : Mapping[str, float]
            All parameters by name, in their units, and "compliance" (1/MPa) if it differs from the case's.
        names : Sequence[str]
            Order of the derivatives.
        patience : Patience or None
            Failed steps after which the march is given up; None for no limit. It learns from the march.

        Raises
        ------
        NotConverged
            The march could not cover the range.
        """
        patience = Patience() if patience is None else patience
        if self.simulation is not None:
            try:
                answer = self.simulation.solve(parameters, names, patience=patience.limit)
            except NoEquilibrium as error:
                raise unsolved(str(error)) from None
            patience.learn(answer.history)
            q = self.recording.displacement
            return ChannelForces(q, answer.force[self.recording.places], answer.slope[self.recording.places])
        # The model has no parameters of effects that do not act on this channel.
        own = {k: v for k, v in parameters.items() if k in self.model.constants}
        self.model.set_parameters(own)
        asked = (*own.items(), *names)
        if asked not in self._solved:
            if len(self._solved) == KEPT:
                self._solved.pop(next(iter(self._solved)))
            self._solved[asked] = self._swept(names, patience)
        return self._solved[asked]

    def _swept(self, names: Sequence[str], patience: Patience) -> ChannelForces:
        ends: list[Array] = []

        def at_the_end(solver: Equilibrium) -> None:
            if not self.coupon and solver.q in (self.targets[0], self.targets[-1]) and solver.q != 0.0:
                ends.append(principal_stretches(self.model).reshape(-1, 3))

        history = sweep(
            self.model, self.targets, sensitivity=tuple(names), observer=at_the_end, patience=patience.limit
        )
        patience.learn(history)
        none = np.zeros((len(history.force), 0))
        return ChannelForces(
            history.displacement,
            history.force,
            none if history.sensitivity is None else history.sensitivity,
            None if self.coupon else isochoric_sample(self.model.comm, ends),
        )

    def reached(self, parameters: Mapping[str, float], patience: Patience) -> Array:
        """Return a sample of isochoric principal stretches of the rubber at the ends of the range, shape (n, 3).

        Collective; every rank gets its own sample of the whole body.

        Parameters
        ----------
        parameters : Mapping[str, float]
            All parameters by name, in their units; the march has been solved with them before.
        patience : Patience
            Failed steps after which the march is given up.

        Raises
        ------
        NotConverged
            The march could not cover the range.
        """
        self.model.set_parameters({k: v for k, v in parameters.items() if k in self.model.constants})
        if isinstance(self.simulation, Reaction):
            return isochoric_sample(self.model.comm, self.simulation.reached(patience.limit))
        found: list[Array] = []
        for side in (self.targets[self.targets < 0], self.targets[self.targets > 0]):
            if not len(side):
                continue
            sweep(self.model, side, patience=patience.given)
            found.append(principal_stretches(self.model).reshape(-1, 3))
        return isochoric_sample(self.model.comm, found)

    def curve(self, answer: ChannelForces) -> Curve:
        """Return the solved curve over the recorded range, smooth enough to be drawn; with effects, along the path."""
        if self.simulation is not None:
            path = self.simulation.path[self.recording.places]
            return Curve(self.recording.mode, path, answer.force, self.recording.time)
        from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed

        q, force, _ = self._both_sides(answer)
        low, high = self.recording.displacement.min(), self.recording.displacement.max()
        fine = np.unique(np.concatenate([np.linspace(low, high, 101), [0.0] if low < 0 < high else []]))
        return Curve(self.recording.mode, fine, CubicSpline(q, force)(fine))

    def _both_sides(self, answer: ChannelForces) -> tuple[Array, Array, Array]:
        q, values = answer.displacement, np.column_stack([answer.force, answer.slope])
        if self.odd:
            q, values = unfolded(q, values)
        return q, values[:, 0], values[:, 1:]

    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        """Return force (n,) and derivatives (n, parameters) at the recorded displacements."""
        if self.simulation is not None:
            if self._correction is None:
                return answer.force, answer.slope
            share = self._correction.share
            return share * answer.force + self._correction.offset, share * answer.slope
        from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed

        q, force, slope = self._both_sides(answer)
        both = CubicSpline(q, np.column_stack([force, slope]))(self.recording.displacement)
        return both[:, 0], both[:, 1:]


def _with_effects(
    recording: Recording,
    shape: Shape,
    rubber: Rubber,
    case: Case,
    comm: MPI.Comm,
    prepared: Prepare,
) -> Simulation | None:
    """Return the simulation of a channel with its effects along the whole record; None where no effect acts on it.

    Raises
    ------
    InputError
        The recording has no time, which an effect needs.
    """
    active = acting(case.effects, recording.name, recording.mode)
    if not active:
        return None
    path = recording.record
    if path.time is None:
        require_time(active, recording.name, recording.mode, str(recording.source))
    return Simulation(
        shape,
        modes()[recording.mode],
        rubber,
        case.mesh.refinement,
        active,
        path.time,
        path.displacement,
        displacement_noise(path),
        comm,
        prepared,
        earlier(path),
        path.temperature,
    )


def isochoric_sample(comm: MPI.Comm, found: Sequence[Array]) -> Array:
    """Return a sample (m, 3) of the isochoric part of principal stretches, each (n, 3) of this rank."""
    local = np.concatenate(found)
    stretches = np.concatenate(comm.allgather(local))
    isochoric = stretches / np.prod(stretches, axis=1, keepdims=True) ** (1.0 / 3.0)
    # The most stretched state, and an even sample of the rest: neighbouring Gauss points differ little.
    order = np.argsort(isochoric[:, -1])
    chosen = order[np.unique(np.linspace(0, len(order) - 1, REACHED).round().astype(int))]
    return np.asarray(isochoric[chosen])


def _coupon_targets(q: Array) -> Array:
    distinct = np.unique(q)
    # The even points make a smooth curve from few samples, and steps that the march can take.
    even = np.linspace(
        min(0.0, distinct[0]), max(0.0, distinct[-1]), DENSE if len(distinct) > DENSE else DENSE // 3
    )
    if len(distinct) > DENSE:
        return even
    # Points that nearly coincide would spoil the spline.
    gap = np.abs(even[:, None] - distinct).min(axis=1) > 0.2 * np.diff(even).min()
    return np.union1d(distinct, even[gap])


def _noise(recording: Recording) -> float:
    """Return the noise of the force, with that of the displacement converted by the mean stiffness."""
    # Where nothing moves, a hold, there is none.
    stiffness = float(np.nan_to_num(abs(recording.secant_stiffness())))
    return float(np.hypot(force_noise(recording), stiffness * displacement_noise(recording)))


# Failed steps that every march is allowed if no limit is given.
ALLOWED = 3


@dataclass
class Patience:
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
    def limit(self) -> int | None:
        """Failed steps after which the next march is given up; None: `cases.march` decides."""
        if self.given is not None or self.hardest is None:
            return self.given
        return ALLOWED + 2 * self.hardest

    def learn(self, history: History) -> None:
        """Take note of a march that has reached its end."""
        failed = sum(not one.accepted for one in history.attempts)
        self.hardest = failed if self.hardest is None else max(self.hardest, failed)
