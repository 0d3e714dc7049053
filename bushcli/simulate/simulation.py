"""A recorded channel with the effects that act on it: parameters in, force at the recorded samples out.

If the rubber has no memory, the bushing is solved once over the range of the recording, and everything that the rig
does to its curve is exact algebra on a spline. If it has memory, the recorded path is marched, in no more steps than
the accuracy needs (`bushcli.simulate.schedule`). Either way every parameter, of the law, of the rubber, of the
assembly or of the rig, has its exact derivative.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from typing_extensions import override

from bushcli.curve.earlier import Earlier
from bushcli.curve.symmetry import swept_range
from bushcli.effects import rig
from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from bushcli.effects.change import Signal
from bushcli.simulate.derivatives import columns, elastic_curve, extension_in_series, local_slopes
from bushcli.simulate.schedule import Schedule, prescribed_schedule, schedule
from bushcli.simulate.steps import FEWEST_OF_LEG, steps_of_sweep
from cases.elastic_path import acts_through_branches_off, along_elastic_path
from cases.local import Cells, differentiate_march
from cases.march import TOLERANCE, History, march
from cases.mode import Mode
from cases.model import FiniteElementModel
from cases.program import Program
from cases.series import SeriesSpring
from cases.simulate import Prepare, Rubber, even_targets, is_odd, prepare, sweep
from geometry.shape import Refinement, Shape

Array = NDArray[np.float64]
Steps = Callable[[int, int, int, float], None]

# The steps are refined while the force differs from that with twice the steps by more than this share of its range, up
# to `FINEST` times as many steps.
ACCURATE = 2e-3
FINEST = 4.0
# A rig is set to zero under a preload that has acted for this many times the duration of the recording: what relaxes
# more slowly does not change the recorded force.
RESTED = 1e3
STANDS_STILL = "the rig takes up all of the travel: the bushing does not move"


@dataclass(frozen=True)
class Answer:
    """Force of a channel at its samples, with derivatives.

    Attributes
    ----------
    force : shape (n,)
        As the rig would have logged it.
    slope : shape (n, parameters)
        Derivative by each parameter asked for.
    history : History
        The march or the sweep that gave the force.
    """

    force: Array
    slope: Array
    history: History


def with_values(
    model: FiniteElementModel, active: Sequence[ActiveEffect], parameters: Mapping[str, float]
) -> tuple[ActiveEffect, ...]:
    """Set parameters of a model by name, and return the effects with theirs; what is not given keeps its value."""
    model.set_parameters({k: v for k, v in parameters.items() if k in model.constants})
    effects = []
    for effect in active:
        if effect.temperature is not None:
            # Channels may share a model.
            model.set_parameters({"temperature": effect.temperature})
        changed = effect.with_values(parameters)
        for p in effect.parameters:
            if p.choices and changed.values[p.name] != effect.values[p.name]:
                raise ValueError(f"{effect.full_name(p)} is a choice: another one needs another model")
        effects.append(changed)
    return tuple(effects)


class FollowedPath(ABC):
    """A recorded path with the effects that act on it, which can be solved for any values of its parameters.

    Attributes
    ----------
    model : FiniteElementModel
    active : tuple of ActiveEffect
        Effects on the channel, with values.
    time : shape (n,) or None
        Times of the samples, s.
    displacement : shape (n,)
        mm or rad, as recorded.
    step_error : float or None
        Root mean square error of the steps over the force's range, once they have been chosen.
    """

    model: FiniteElementModel
    active: tuple[ActiveEffect, ...]
    time: Array | None
    displacement: Array
    step_error: float | None = None

    @property
    @abstractmethod
    def fineness(self) -> float:
        """Factor on the number of steps along the path."""

    @property
    @abstractmethod
    def path(self) -> Array:
        """Displacement at the samples without the sensor's noise, (n,), mm or rad."""

    @abstractmethod
    def plan(self, fineness: float, tolerance: float = TOLERANCE) -> None:
        """Choose the steps along the path, and the tolerance of its march.

        Parameters
        ----------
        fineness : float
            Factor on the default number of steps, a ratio.
        tolerance : float
            That of `cases.march.march`, a ratio.
        """

    @abstractmethod
    def solve(
        self,
        parameters: Mapping[str, float],
        names: Sequence[str] = (),
        *,
        keep_states: bool = False,
        progress: Steps | None = None,
        failure_limit: int | None = None,
    ) -> Answer:
        """Return the force at the samples and its derivatives.

        Parameters
        ----------
        parameters : mapping of str to float
            Values by name, N, mm, MPa, s, rad: those of the law, "compliance" (1/MPa) and "effect.parameter". What is
            not given keeps the value that the model has; an effect's parameter then has the value of the case.
        names : sequence of str
            Parameters by which derivatives are wanted.
        keep_states : bool
            Whether the history holds the displacement field of each step.
        progress : Steps or None
            Called after each step of the march.
        failure_limit : int or None
            Largest number of failed steps before the march is given up (`cases.march`).

        Raises
        ------
        NotConverged
            The march could not go on.
        NoEquilibrium
            The displacement could not be shared with a spring in series.
        """

    @abstractmethod
    def stretches_at_ends(self, failure_limit: int | None = None) -> list[Array]:
        """Principal stretches of the rubber at the ends of the path, each of shape (n, 3); collective.

        The model has the values with which they are wanted. ``failure_limit``: failed steps that a march is allowed.

        Raises
        ------
        NotConverged
        """

    @abstractmethod
    def local_slopes(self) -> tuple[Array, Cells]:
        """Derivatives (samples, cells) of the force by the stiffness of each cell, and the cells; collective.

        The model has the values with which they are wanted. The rig is left out: it does not change which cells carry
        the force. Raises `NotConverged`.
        """

    @property
    def path_before(self) -> Earlier | None:
        """The assumed path before the first sample, if the rubber remembers it."""
        return None

    @property
    def path_dependent(self) -> bool:
        """Whether the recorded path has to be marched because the rubber has memory."""
        return self.model.path_dependent

    @property
    def is_exact(self) -> bool:
        """Whether its steps are those of a prescribed program, which are not refined."""
        return False

    def refine(self, parameters: Mapping[str, float]) -> float:
        """Choose steps fine enough for the recorded path, and return the error that remains.

        Returns
        -------
        float
            Root mean square change of the force when the steps are halved, over the force's range; zero where
            nothing is marched.

        Raises
        ------
        NotConverged
        """
        if not self.path_dependent or self.is_exact:
            self.step_error = 0.0
            return 0.0
        coarse = self.solve(parameters).force
        while True:
            fineness = self.fineness
            self.plan(2.0 * fineness)
            fine = self.solve(parameters).force
            error = float(np.sqrt(np.mean((fine - coarse) ** 2)) / np.ptp(fine))
            if error <= ACCURATE or fineness >= FINEST:
                # Return to the steps that were judged: twice as many take twice the time.
                self.plan(fineness)
                self.step_error = error
                return error
            coarse = fine


def logged_force(
    active: Sequence[ActiveEffect],
    steps: Schedule,
    clock: Array,
    q: Signal,
    force: Signal,
    names: Sequence[str],
) -> Signal:
    """Return the force as it is logged at the samples, from that of the bushing at the nodes of a march.

    If the rig was set to zero under a preload, the node at recorded zero comes before those of the steps.
    """
    zeroed = len(force.value) - len(steps.time)
    elapsed = np.concatenate([np.zeros(zeroed), np.maximum(steps.time - clock[0], 0.0)])
    total = rig.parallel(active, q, force, names, elapsed)
    if zeroed:
        total = rig.from_recorded_zero(total)
    return rig.reading_at_samples(active, steps.interpolation, clock, total, names)


class _Options(NamedTuple):
    """How a simulation is solved, as in `FollowedPath.solve`."""

    keep_states: bool
    progress: Steps | None
    failure_limit: int | None


class Simulation(FollowedPath):
    """A channel of one motion that can be solved for any values of its parameters.

    Parameters
    ----------
    shape, mode, rubber, refinement, comm
        Arguments of the finite-element model.
    active
        Effects on this channel, with values.
    time : shape (n,) or None
        Times of the recorded samples, s.
    displacement : shape (n,)
        mm or rad, as recorded; the whole path, from the virgin bushing on unless `before` is given.
    noise
        Standard deviation of the displacement's noise; None if the samples are a prescribed program, which is followed
        exactly.
    prepared
        Makes the finite-element model.
    before
        Path before the first sample, which rubber with memory remembers; None if the samples begin at rest.
    temperature : shape (n,) or None
        Degrees C at the samples, where it changes; rubber without memory has its mean.
    """

    def __init__(
        self,
        shape: Shape,
        mode: Mode,
        rubber: Rubber,
        refinement: Refinement,
        active: Sequence[ActiveEffect],
        time: Array | None,
        displacement: Array,
        noise: float | None,
        comm: MPI.Comm = MPI.COMM_WORLD,
        prepared: Prepare = prepare,
        before: Earlier | None = None,
        temperature: Array | None = None,
    ) -> None:
        self.temperature = temperature
        self.active = tuple(effect.with_start_values() for effect in active)
        if temperature is not None:
            self.active = tuple(effect.at(float(np.mean(temperature))) for effect in self.active)
        features = features_of(self.active)
        self.model = prepared(shape, mode, rubber, refinement, comm, features)
        self.time, self.displacement, self.noise = time, np.asarray(displacement, dtype=float), noise
        self.before = before
        self.odd = is_odd(shape, mode) and not any(mode.reversed_by in item.breaks for item in features)
        self._count = steps_of_sweep(shape, self.model.mesh.dimension)
        self.plan(1.0)

    @property
    @override
    def fineness(self) -> float:
        return self._fineness

    @property
    @override
    def path(self) -> Array:
        return self._path

    @property
    @override
    def is_exact(self) -> bool:
        return self.noise is None

    @override
    def plan(self, fineness: float, tolerance: float = TOLERANCE) -> None:
        self._fineness, self._tolerance = fineness, tolerance
        if self.noise is None:
            self.steps = prescribed_schedule(self.time, self.displacement)
        else:
            self.steps = schedule(*self._whole_path(), self.noise, fineness)
        earlier = 0 if self.before is None else len(self.before.time)
        samples = np.arange(earlier, earlier + len(self.displacement), dtype=float)
        self._clock = samples if self.time is None else self.time
        self._path = self.steps.path(self._clock)

    def _whole_path(self) -> tuple[Array | None, Array]:
        """Return time and displacement from rest on: of the samples, and of what was before them."""
        if self.before is None:
            return self.time, self.displacement
        q = np.concatenate([self.before.displacement, self.displacement])
        if self.time is None:
            return None, q
        return np.concatenate([self.time[0] + self.before.time, self.time]), q

    @property
    @override
    def path_before(self) -> Earlier | None:
        return self.before if self.path_dependent else None

    # -- solving -------------------------------------------------------------------------------------------------

    @override
    def solve(
        self,
        parameters: Mapping[str, float],
        names: Sequence[str] = (),
        *,
        keep_states: bool = False,
        progress: Steps | None = None,
        failure_limit: int | None = None,
    ) -> Answer:
        active = with_values(self.model, self.active, parameters)
        answer = self._answer_by_march if self.path_dependent else self._answer_by_sweep
        return answer(active, tuple(names), _Options(keep_states, progress, failure_limit))

    @override
    def stretches_at_ends(self, failure_limit: int | None = None) -> list[Array]:
        targets = even_targets(*swept_range(self.displacement, self.odd), self._count)
        return list(
            sweep(self.model, targets, tolerance=self._tolerance, failure_limit=failure_limit).stretches
        )

    @override
    def local_slopes(self) -> tuple[Array, Cells]:
        if not self.path_dependent:
            return local_slopes(self.model, self.displacement, self.odd)
        steps = self.steps
        program = Program(steps.displacement, steps.time if steps.timed else None)
        march = differentiate_march(self.model, program)
        return steps.interpolation(self._clock) @ march.slope, march.cells

    def _answer_by_sweep(
        self, active: Sequence[ActiveEffect], names: tuple[str, ...], options: _Options
    ) -> Answer:
        before_test = [0.0] if rig.is_zeroed(active) else []
        travelled = np.concatenate([before_test, self.path])
        low, high = swept_range(rig.bushing_path(active, travelled, ()).value, self.odd)
        if low == high:
            raise rig.NoEquilibrium(STANDS_STILL)
        inner = tuple(name for name in names if name in self.model.constants)
        targets = even_targets(low, high, self._count)
        solve = partial(sweep, self.model, targets, sensitivity=inner)
        history = self._history(solve, (targets.tobytes(), inner), options)
        response = elastic_curve(history, self.odd, inner, names)
        read = rig.elastic_response(active, self.path, self.time, response, names)
        return Answer(read.value, read.slope, history)

    def _answer_by_march(
        self, active: Sequence[ActiveEffect], names: tuple[str, ...], options: _Options
    ) -> Answer:
        steps, times, lead = self.steps, self.steps.time, 0
        if rig.is_zeroed(active):
            # From rest to the preload, which is held until the recording begins.
            lead = int(np.ceil(FEWEST_OF_LEG * self._fineness))
            rested = RESTED * float(np.ptp(times))
            times = np.concatenate([times[0] - rested * np.linspace(1.0, 0.0, lead), times])
            path = rig.bushing_path(active, np.concatenate([[0.0], steps.displacement]), names)
            path = path.at_samples(np.maximum(np.arange(len(times)) - lead + 1, 0))
            ramp = np.minimum(np.arange(1, len(times) + 1) / (lead - 1), 1.0)
            displacement = Signal(ramp * path.value, ramp[:, None] * path.slope)
        else:
            displacement = rig.bushing_path(active, steps.displacement, names)
        if not displacement.value.any():
            raise rig.NoEquilibrium(STANDS_STILL)
        series = None
        if rig.has_springs(active, names):
            series = SeriesSpring(extension_in_series(active, names, self._clock[0]))
        path_rates = {
            name: displacement.slope[:, i] for i, name in enumerate(names) if np.any(displacement.slope[:, i])
        }
        # Forces beside the bushing and a late logger do not change the march.
        inner = tuple(n for n in names if series is not None or n in self.model.constants or n in path_rates)
        temperature = None
        if self.temperature is not None and self.time is not None:
            temperature = np.interp(times, self.time, self.temperature)
        program = Program(displacement.value, times if steps.timed else None, temperature=temperature)
        is_plain = program.temperature is None and not path_rates
        is_force_alone = not options.keep_states and options.progress is None
        if is_plain and is_force_alone and acts_through_branches_off(self.model, inner):
            history = along_elastic_path(
                self.model,
                program,
                self._count,
                tolerance=self._tolerance,
                sensitivity=inner,
                drive=series,
                failure_limit=options.failure_limit,
            )
        else:
            solve = partial(
                march, self.model, program, sensitivity=inner, path_rates=path_rates, drive=series
            )
            rates = tuple((name, rate.tobytes()) for name, rate in path_rates.items())
            clock = None if program.time is None else program.time.tobytes()
            task = (program.displacement.tobytes(), clock, inner, rates)
            history = self._history(solve, None if series is not None else task, options)
        q = Signal(history.displacement, columns(history.path_sensitivity, inner, names, len(history.force)))
        force = Signal(history.force, columns(history.sensitivity, inner, names, len(history.force)))
        if lead:
            q, force = (signal.at_samples(np.arange(lead - 1, len(signal.value))) for signal in (q, force))
        read = logged_force(active, steps, self._clock, q, force, names)
        return Answer(read.value, read.slope, history)

    def _history(
        self, solve: Callable[..., History], task: tuple[Hashable, ...] | None, options: _Options
    ) -> History:
        """Return the body's response; one of the last two to a task is reused if only the rig has changed since."""
        # A model may have been moved to another shape since (`bushcli.simulate.bodies`).
        values = tuple(float(constant.value) for constant in self.model.constants.values())
        key = (self.model.mesh.shape, values, task, self._tolerance)
        is_kept = task is not None and not options.keep_states
        stored: History | None = self.model.curves.get(key) if is_kept and options.progress is None else None
        if stored is not None:
            return stored
        history = solve(tolerance=self._tolerance, **options._asdict())
        if is_kept:
            self.model.curves.put(key, history)
        return history
