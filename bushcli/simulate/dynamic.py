"""Dynamic stiffness of a case: for each preload the static march, then small vibrations about it at any frequency."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case, DynamicTest, Material, load_case_names
from bushcli.case.case import DENSITY
from bushcli.effects.active import ActiveEffect, acting, in_state, require_values
from bushcli.effects.assembly import features_of
from bushcli.effects.effect import effect_in_force_law
from bushcli.effects.names import readable_name
from bushcli.errors import InputError, Problem
from bushcli.runtime.condition import Condition
from bushcli.runtime.interrupt import meet
from bushcli.simulate.admissible import check_material
from bushcli.simulate.extent import Extent, of_test, outside
from bushcli.simulate.predict import rubber_of
from bushcli.simulate.response import Progress
from bushcli.simulate.touching import sharing
from cases.contact.touch import touches
from cases.dynamic.amplitude import SETTLED, UnevenModel
from cases.dynamic.model import Branches, DynamicModel, spread
from cases.dynamic.pencil import Pencil, Unstable
from cases.dynamic.reduction import basis_for
from cases.dynamic.slopes import Changes, changes
from cases.equilibrium import Equilibrium
from cases.history import Interrupted
from cases.load import PrescribedForce
from cases.march import NotConverged, march
from cases.mode import mode_of, modes
from cases.model import FiniteElementModel
from cases.program import Program, path, steps_along
from cases.ranks import summed
from cases.simulate import prepare
from cases.sine import ThinnedSpectrum
from cases.six import PAIR_MODES

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Largest deviation of the force from a prescribed one, as a share of the largest: the march leaves a tenth of it.
NEAR = 1e-6
# Gap of the plates in front of the free ends, and one that no preload closes, mm.
_GAP, _AWAY = "snubber.gap", 1e6
# Relative error of the stiffness by the reduction: what is promised, and what vectors are chosen for.
PROMISED, CHOSEN = 1e-4, 1e-5
# The same for derivatives by parameters of the model, whose error is the root of that of stiffness. Measured on a plain
# bushing to 200 Hz against central differences: by the compressibility 9 % with 1e-5, 0.2 % with 1e-6, 3e-5 with 1e-7
# (also with 1e-9); by the law 2e-5, 4e-7, 5e-9.
CHOSEN_WITH_SLOPES = 1e-7


@dataclass(frozen=True)
class DynamicCurve:
    """Dynamic stiffness about one preload.

    Attributes
    ----------
    name : str
        Name of the load case.
    test : DynamicTest
    preload, force : float
        Displacement and static force there: mm or rad, N or N mm (stretch - 1, MPa of a coupon); of a pose those of the
        motion that vibrates.
    frequency : shape (f,)
        Hz.
    stiffness : shape (f,)
        K' + i K'': N/mm, N mm/rad, MPa.
    reduction_error : float
        Bound of the relative error by the reduction, the largest of all frequencies.
    vectors : int
        Vectors to which the body was reduced.
    model : DynamicModel
        For other frequencies, branches and densities.
    branches : Branches
        Those of the rubber.
    matrix : shape (f, 6, 6) or None
        Of a pose: N, mm, rad.
    touching : tuple of (str, str)
        Surfaces in contact under the preload.
    amplitude : float or None
        Peak, mm or rad; None = small.
    third_harmonic : shape (f,) or None
        Of the force over the first; None where it is linear.
    uneven : UnevenModel or None
        For other amplitudes and frequencies; None of a rubber that amplitude does not change.
    """

    name: str
    test: DynamicTest
    preload: float
    force: float
    frequency: Array
    stiffness: Complex
    reduction_error: float
    vectors: int
    model: DynamicModel = field(repr=False)
    branches: Branches
    matrix: Complex | None = None
    touching: tuple[tuple[str, str], ...] = ()
    amplitude: float | None = None
    third_harmonic: Array | None = None
    uneven: UnevenModel | None = field(default=None, repr=False)

    @property
    def static(self) -> float:
        """Stiffness of the relaxed rubber without inertia: the slope of the static curve at the preload."""
        return float(self.model.stiffness(np.zeros(1), ()).real[0])

    @property
    def mode(self) -> str:
        """Mode whose displacement and force are those of the vibration."""
        return self.test.mode if self.test.six is None else PAIR_MODES[self.test.motion]

    @property
    def loss_angle(self) -> Array:
        """Phase by which the force leads the displacement, rad, shape (f,)."""
        return np.asarray(np.angle(self.stiffness), dtype=np.float64)


@dataclass(frozen=True)
class DynamicResponse:
    """Dynamic stiffness of all load cases.

    Attributes
    ----------
    case, material
    curves : tuple of DynamicCurve
        In the order of the case file; preloads that were not reached are missing.
    conditions : tuple of Condition
    complete : bool
        Whether every preload was reached and is stable.
    seconds : mapping
        Time of the static march and of the rest, s.
    """

    case: Case
    material: Material
    curves: tuple[DynamicCurve, ...]
    conditions: tuple[Condition, ...]
    complete: bool
    seconds: dict[str, float] = field(default_factory=dict)


class DynamicInterrupted(KeyboardInterrupt):
    """The user interrupted; `response` has the preloads so far."""

    def __init__(self, response: DynamicResponse) -> None:
        self.response = response
        super().__init__("interrupted")


def vibrate(
    case: Case,
    material: Material | None = None,
    *,
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    tested: Sequence[Extent] = (),
) -> DynamicResponse:
    """Compute the dynamic stiffness of every load case with ``[load_cases.dynamic]``.

    Parameters
    ----------
    case : Case
        Validated case.
    material : Material or None
        Used instead of the material of the case, such as one identified from coupons.
    progress : Progress or None
        Called after each step of the static march.
    comm : MPI.Comm
        Ranks that share each model.
    tested : sequence of Extent
        What was measured; a condition says which load cases lie outside.

    Raises
    ------
    InputError
        There is no dynamic load case, or an effect has no dynamic stiffness.
    DynamicInterrupted
        The user interrupted it; it carries the preloads so far.
    """
    material = material or case.material
    _check(case)
    check_material(case, material)
    run = _Run(case, material, sharing(case, comm), progress)
    try:
        for name, test in zip(load_case_names(case.vibrations, ()), case.vibrations, strict=True):
            run.test(name, test, tested)
    except (KeyboardInterrupt, Interrupted) as stopped:
        if not run.curves:
            raise KeyboardInterrupt from stopped
        raise DynamicInterrupted(run.response(interrupted=True)) from stopped
    return run.response()


def branches_of(effects: Sequence[ActiveEffect]) -> Branches:
    """Return the Maxwell branches of effects: g and tau (s) of each, at the temperature of the channel."""
    bonded, slower = _heated(effects)
    return [
        (bonded * float(one.parameters["g"]), slower * float(one.parameters["tau"]))
        for item in features_of(effects)
        if item.feature.branches is not None
        for one in item.feature.branches(item.values)
        if one.branch.name == "maxwell" and one.branch.clock == ""
    ]


def thinned_of(effects: Sequence[ActiveEffect]) -> ThinnedSpectrum | None:
    """Return the relaxation of effects that amplitude thins, at the temperature of the channel; None without one."""
    bonded, slower = _heated(effects)
    for item in features_of(effects):
        if item.feature.thinned is not None:
            found = item.feature.thinned(item.values)
            # In the time of the reference temperature: the path counts as at that.
            return replace(
                found, moduli=bonded * found.moduli, times=slower * found.times, path=slower * found.path
            )
    return None


def _heated(effects: Sequence[ActiveEffect]) -> tuple[float, float]:
    """Return the factors on the branches' moduli and on all relaxation times at the temperature of the channel."""
    for item in features_of(effects):
        if item.feature.heated is not None:
            _, bonded, slower = item.feature.heated(item.values, item.temperature)
            return float(bonded), float(slower)
    return 1.0, 1.0


def _check(case: Case) -> None:
    """Refuse a case without dynamic load cases, without branches, or with an effect that has no dynamic stiffness."""
    where = case.path.name
    if not case.vibrations:
        example = "frequency = [1, 10, 100]"
        expected = (
            f"add a table [load_cases.dynamic] with {example} (and preload) to a load case without amplitude"
        )
        raise InputError(Problem(where, "no load case has vibrations", "", expected))
    require_values(case.effects, where)
    problems: list[Problem] = []
    for name, test in zip(load_case_names(case.vibrations, ()), case.vibrations, strict=True):
        problems += unfit(where, name, acting(case.effects, name, test.mode, "dynamic", test.temperature))
    if problems:
        raise InputError(*problems)


def is_in_vibrations(one: ActiveEffect) -> bool:
    """Whether an effect that stays in a relaxed state has a dynamic stiffness, and not a force along a path alone."""
    still = one.effect.feature is None or one.effect.has_memory
    return one.effect.acts == "rig" or not still or thinned_of([one]) is not None


def unfit(where: str, name: str, active: Sequence[ActiveEffect]) -> list[Problem]:
    """Return why the effects of a channel give no dynamic stiffness: no branch, or one without such a stiffness.

    Parameters
    ----------
    where : str
        Name of the case file, for the message.
    name : str
        Name of the channel.
    active : sequence of ActiveEffect
        Effects that act on it, with values.
    """
    problems = []
    if not branches_of(active) and thinned_of(active) is None:
        what = f"{name}: no viscoelastic branch acts, so that there is no loss angle"
        branch = effect_in_force_law("maxwell")
        given = ", ".join(f"{p.name} = ..." for p in branch.parameters if not p.optional)
        expected = f'add [[effects]] name = "{branch.name}" with parameters = {{{given}}}; '
        expected += f"{branch.amplitudes[0].name} = 0 says that the rubber has no loss"
        problems.append(Problem(where, what, "", expected))
    for one in in_state(active, unrelaxed=False):
        if not is_in_vibrations(one):
            what = (
                f"{name}: {readable_name(one.name)} changes the force along a path, and a vibration has none"
            )
            expected = f'give the effect "{one.name}" channels = [...] without {name}, or leave it out'
            problems.append(Problem(where, what, "", expected))
    return problems


class _Run:
    """The load cases of a case, one after the other."""

    def __init__(self, case: Case, material: Material, comm: MPI.Comm, progress: Progress | None) -> None:
        self._case, self._material, self._comm, self._progress = case, material, comm, progress
        self.curves: list[DynamicCurve] = []
        self._conditions: list[Condition] = []
        self._complete = True
        self._seconds = {"static": 0.0, "dynamic": 0.0}

    def response(self, interrupted: bool = False) -> DynamicResponse:
        """Return the result so far."""
        curves = tuple(self.curves)
        found = [*self._conditions, *(one for curve in curves for one in doubts(curve))]
        if interrupted:
            total = sum(len(one.preload) for one in self._case.vibrations)
            what = f"interrupted after {len(curves)} of {total} preloads"
            found.append(Condition("interrupted", what, "run it again"))
        done = self._complete and not interrupted
        return DynamicResponse(self._case, self._material, curves, tuple(found), done, self._seconds)

    def test(self, name: str, test: DynamicTest, tested: Sequence[Extent]) -> None:
        """Reach the preloads of a load case, and compute the stiffness about each."""
        active = acting(self._case.effects, name, test.mode, "dynamic", test.temperature)
        self._conditions += outside(name, of_test(test), tested, active)
        self._conditions += effects_left_out(name, active)
        six = test.six and test.six.whole_body
        features = features_of(in_state(active, unrelaxed=False))
        mesh = self._case.mesh.refinement
        rubber = rubber_of(self._material)
        model = prepare(self._case.geometry, mode_of(test.mode, six), rubber, mesh, self._comm, features)
        made = Vibrations(
            name,
            replace(test, six=six),
            model,
            branches_of(active),
            self._material.density,
            thinned_of(active),
        )
        try:
            for program in made.programs():
                self._march(made, program)
        finally:
            # Also of a march that was interrupted.
            self.curves += [one for i in sorted(made.curves) for one in made.curves[i]]
            self._complete = self._complete and not made.unstable
            self._conditions += [_unstable(name, test, q) for q in made.unstable.values()]
            self._seconds["dynamic"] += made.seconds
            self._seconds["static"] -= made.seconds

    def _march(self, made: Vibrations, program: Program) -> None:
        def report(step: int, steps: int, newton: int, q: float) -> None:
            meet(self._comm)
            if self._progress is not None:
                self._progress(made.name, step, steps, newton, q)

        begin = time.perf_counter()
        try:
            march(made.model, program, drive=made.drive, progress=report, observer=made.observe)
        except NotConverged as failure:
            self._complete = False
            self._conditions.append(_not_reached(made.name, made.test, failure))
        finally:
            self._seconds["static"] += time.perf_counter() - begin


class Vibrations:
    """One load case: its model, and the curves at the preloads that were reached, one for each amplitude."""

    def __init__(
        self,
        name: str,
        test: DynamicTest,
        model: FiniteElementModel,
        branches: Branches,
        density: float,
        thinned: ThinnedSpectrum | None = None,
        names: Sequence[str] = (),
    ) -> None:
        self.name, self.test, self.model = name, test, model
        # Parameters of the model by which derivatives are wanted.
        self._names = names
        self._maxwell, self._thinned, self._density = branches, thinned, density
        # At small amplitudes the thinned relaxation is that of branches, too.
        self._branches = [*branches, *(() if thinned is None else thinned.branches())]
        # By number of the preload; of the unstable ones the displacement.
        self.curves: dict[int, list[DynamicCurve]] = {}
        self.unstable: dict[int, float] = {}
        self.seconds = 0.0

    @property
    def drive(self) -> PrescribedForce | None:
        """What a march needs beside a program."""
        return PrescribedForce() if self.test.by_force else None

    def programs(self) -> Iterator[Program]:
        """Yield the ways from rest to the preloads: on each side from the nearest to the furthest."""
        if self.test.six is not None:
            yield steps_along(self.test.six, self.test.steps)
            return
        sides = [sorted((q for q in self.test.preload if sign * q > 0.0), key=abs) for sign in (1, -1)]
        for side in sides:
            if side:
                yield path(side, self.test.steps)
        if not any(sides):
            yield Program(np.zeros(1))

    def observe(self, solver: Equilibrium) -> None:
        """Compute the stiffness if the equilibrium is a preload."""
        number = self._number(solver)
        if number is None or number in self.curves or number in self.unstable:
            return
        begin = time.perf_counter()
        try:
            self.curves[number] = self._curves(solver)
        except Unstable:
            self.unstable[number] = solver.q
        finally:
            self.seconds += time.perf_counter() - begin

    def _number(self, solver: Equilibrium) -> int | None:
        """Return which preload an equilibrium is; None if it is none."""
        test = self.test
        if test.six is not None:
            return 0 if solver.q == test.six.time[-1] else None
        at, near = (solver.force, NEAR * max(map(abs, test.preload))) if test.by_force else (solver.q, 0.0)
        return next((i for i, one in enumerate(test.preload) if abs(at - one) <= near), None)

    def _curves(self, solver: Equilibrium) -> list[DynamicCurve]:
        test, frequency = self.test, np.array(self.test.frequency)
        metal = {name: DENSITY * one.density for name, one in self.model.mesh.sleeves.items()}
        pencil = Pencil(self.model, solver, metal)
        tolerance = CHOSEN_WITH_SLOPES if self._names else CHOSEN
        basis = basis_for(pencil, spread(frequency, self._branches), self._density, tolerance)
        found = basis.reduced()
        number = test.motion if test.six is not None else 0
        uneven_too = bool(test.amplitude) and self._thinned is not None
        even = bool(self._names) and not uneven_too
        slopes = changes(basis, solver, self._names, self.drive) if even else Changes()
        model = DynamicModel(found, number, test.transfer, slopes)
        pose, forces = solver.pose, solver.six
        small = DynamicCurve(
            self.name,
            test,
            solver.q if pose is None else float(pose[number]),
            solver.force if forces is None else float(forces[number]),
            frequency,
            model.stiffness(frequency, self._branches),
            model.error(frequency, self._branches),
            len(found.equilibrium),
            model,
            self._branches,
            None if pose is None else model.matrix(frequency, self._branches),
            _touching(self.model),
        )
        if not test.amplitude:
            return [small]
        if self._thinned is None:
            return [replace(small, amplitude=one) for one in test.amplitude]
        uneven = UnevenModel(basis, self._thinned, self._maxwell, number, test.transfer)
        # Where moduli differ most from point to point lies between: vectors for these amplitudes serve all others.
        chosen = sorted(test.amplitude)
        chosen = sorted({chosen[0], chosen[len(chosen) // 2], chosen[-1]})
        ends = [uneven.enrich(one, f) for one in chosen for f in sorted({frequency.min(), frequency.max()})]
        error = max(small.reduction_error, *ends)
        if self._names:
            # Over the vectors that were added.
            slopes = changes(basis, solver, self._names, self.drive)
            small = replace(small, model=DynamicModel(basis.reduced(), number, test.transfer, slopes))

        def curve(amplitude: float) -> DynamicCurve:
            balances = uneven.balances(np.full(len(frequency), amplitude), frequency)
            unsettled = [one.moved for one in balances if one.moved > SETTLED]
            return replace(
                small,
                stiffness=np.array([one.stiffness for one in balances]),
                vectors=uneven.vectors,
                matrix=None,
                reduction_error=max([error, *unsettled]),
                amplitude=amplitude,
                third_harmonic=np.array([one.third for one in balances]),
                uneven=uneven,
            )

        return list(map(curve, test.amplitude))


def _touching(model: FiniteElementModel) -> tuple[tuple[str, str], ...]:
    """Return which surfaces are in contact at the present state; a plate in front of the free ends is one of them."""
    contact = model.surfaces.contact
    met = () if contact is None else touches(contact, model.state.x.array)
    found = [one.surfaces for one in met]
    gap = model.parameters.constants.get(_GAP)
    if gap is not None:
        # The plates push if they have energy that they would not have further away.
        near, own = model.surfaces.energy(), float(gap.value)
        model.parameters.set({_GAP: _AWAY})
        away = model.surfaces.energy()
        model.parameters.set({_GAP: own})
        if summed(model.comm, near - away) > 0.0:
            found.append(("free end", "snubber"))
    return tuple(found)


def _shown(test: DynamicTest, q: float) -> str:
    if test.six is not None:
        return f"{q:.4g} s of the path"
    return f"{np.degrees(q):.4g} deg" if modes()[test.mode].rotational else f"{q:.4g} mm"


def _not_reached(name: str, test: DynamicTest, failure: NotConverged) -> Condition:
    if failure.largest is None:
        what = f"the preload {_shown(test, failure.target)} was not reached: no equilibrium beyond "
        what += f"{_shown(test, failure.last)} ({failure.reason})"
    else:
        q, force = failure.largest
        unit = "N mm" if modes()[test.mode].rotational else "N"
        what = (
            f"a preload was not reached: the largest force found is {force:.4g} {unit} at {_shown(test, q)} "
            f"({failure.reason})"
        )
    what = f"{name}: {what}; preloads up to there have their results"
    return Condition(
        "preload_not_reached", what, "set a smaller preload (in mm or N), more steps or a coarser mesh"
    )


def _unstable(name: str, test: DynamicTest, q: float) -> Condition:
    what = f"{name}: the preload {_shown(test, q)} is unstable: the stiffness has a negative eigenvalue there"
    remedy = "set a smaller preload, or a law that is stable there; the part buckles, or would jump to another state"
    return Condition("unstable_preload", what, remedy)


def effects_left_out(name: str, active: Sequence[ActiveEffect]) -> list[Condition]:
    """Return which effects the dynamic stiffness is without.

    Parameters
    ----------
    name : str
        Name of the channel.
    active : sequence of ActiveEffect
        Effects that act on it.
    """
    found = []
    sliding = [one for one in active if one.effect.slides]
    if sliding:
        names = " and ".join(readable_name(one.name) for one in sliding)
        what = f"{name}: {names} is left out: its stiffness depends on the amplitude"
        found.append(Condition("effect_left_out", what, "add a vibration in time to compare: bushcli direct"))
    rig = [one for one in active if one.effect.acts == "rig"]
    if rig:
        names = " and ".join(readable_name(one.name) for one in rig)
        what = f"{name}: the stiffness is that of the part, without {names} of the rig"
        remedy = "nothing to do, unless the part is compared with a rig's table: `bushcli direct` compares, with all "
        remedy += "effects of the rig but free play"
        found.append(Condition("effect_left_out", what, remedy))
    return found


def doubts(curve: DynamicCurve) -> list[Condition]:
    """Return what is doubtful about a curve: reduction, contact."""
    found = []
    if not curve.reduction_error <= PROMISED:
        what = f"{curve.name}: the reduction may be wrong by {100 * curve.reduction_error:.2g} %"
        remedy = "ask for lower frequencies: near resonances of the rubber the stiffness changes by orders"
        found.append(Condition("reduction_error", what, remedy))
    if curve.touching:
        surfaces = ", ".join(f"{a} and {b}" for a, b in curve.touching)
        what = (
            f"{curve.name} at {_shown(curve.test, curve.preload)}: {surfaces} touch under the preload, and the "
            "vibration neither opens nor closes the contact"
        )
        found.append(
            Condition("contact_frozen", what, "holds for amplitudes that leave the contact as it is")
        )
    return found
