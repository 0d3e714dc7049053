"""Dynamic stiffness of a case: for each preload the static march, then small vibrations about it at any frequency."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

from mpi4py import MPI

from bushcli.case import Case, DynamicTest, Material
from bushcli.effects.active import ActiveEffect, effects_on_channel, in_state, require_values
from bushcli.effects.assembly import features_of
from bushcli.effects.effect import effect_in_force_law
from bushcli.effects.names import readable_name
from bushcli.errors import InputError, Problem
from bushcli.runtime.condition import Condition
from bushcli.runtime.interrupt import meet
from bushcli.simulate.admissible import check_material
from bushcli.simulate.contact import processes_sharing_mesh
from bushcli.simulate.extent import Extent, of_test, outside_measured
from bushcli.simulate.predict import rubber_of
from bushcli.simulate.response import Progress
from bushcli.simulate.vibrations import PROMISED, DynamicCurve, Vibrations, branches_of, thinned_of
from cases.history import Interrupted
from cases.march import NotConverged, march
from cases.mode import modes
from cases.simulate import prepare


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
    material, where = material or case.material, case.path.name
    if not case.vibrations:
        expected = (
            "add a table [load_cases.dynamic] with frequency = [1, 10, 100] (and preload) to a load case "
        )
        expected += "without amplitude"
        raise InputError(Problem(where, "no load case has vibrations", "", expected))
    require_values(case.effects, where)
    problems: list[Problem] = []
    for test in case.vibrations:
        problems += effects_without_stiffness(where, test.label, _acting(case, test))
    if problems:
        raise InputError(*problems)
    check_material(case, material)
    run = _Run(case, material, processes_sharing_mesh(case, comm), progress)
    try:
        for test in case.vibrations:
            run.test(test, tested)
    except (KeyboardInterrupt, Interrupted) as stopped:
        if not run.curves:
            raise KeyboardInterrupt from stopped
        raise DynamicInterrupted(run.response(interrupted=True)) from stopped
    return run.response()


def _acting(case: Case, test: DynamicTest) -> tuple[ActiveEffect, ...]:
    return effects_on_channel(case.effects, test.label, test.mode, "dynamic", test.temperature)


def is_in_vibrations(active: ActiveEffect) -> bool:
    """Whether an effect that stays in a relaxed state has a dynamic stiffness, and not a force along a path alone."""
    still = active.effect.feature is None or active.effect.has_memory
    return active.effect.acts == "rig" or not still or thinned_of([active]) is not None


def effects_without_stiffness(where: str, name: str, active: Sequence[ActiveEffect]) -> list[Problem]:
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
    for effect in active:
        for parameter in (p.name for p in effect.parameters if p.along_path):
            what = f"{name}: with {parameter}, {readable_name(effect.name)} has no dynamic stiffness"
            expected = f"leave {parameter} out; several branches relax over decades of time, too"
            problems.append(Problem(where, what, "", expected))
    if not problems and not branches_of(active) and thinned_of(active) is None:
        what = f"{name}: no viscoelastic branch acts, so that there is no loss angle"
        branch = effect_in_force_law("maxwell")
        parameters = ", ".join(f"{p.name} = ..." for p in branch.parameters if not p.optional)
        expected = f'add [[effects]] name = "{branch.name}" with parameters = {{{parameters}}}; '
        expected += f"{branch.amplitudes[0].name} = 0 says that the rubber has no loss"
        problems.append(Problem(where, what, "", expected))
    for effect in in_state(active, unrelaxed=False):
        if not is_in_vibrations(effect):
            what = f"{name}: {readable_name(effect.name)} changes the force along a path, and a vibration has none"
            expected = f'give the effect "{effect.name}" channels = [...] without {name}, or leave it out'
            problems.append(Problem(where, what, "", expected))
    return problems


class _Run:
    """The load cases of a case, one after the other."""

    def __init__(self, case: Case, material: Material, comm: MPI.Comm, progress: Progress | None) -> None:
        self._case, self._material, self._comm, self._progress = case, material, comm, progress
        self.curves: list[DynamicCurve] = []
        self._conditions: list[Condition] = []
        self._complete, self._seconds = True, {"static": 0.0, "dynamic": 0.0}

    def response(self, interrupted: bool = False) -> DynamicResponse:
        """Return the result so far."""
        curves = tuple(self.curves)
        conditions = [*self._conditions, *(condition for curve in curves for condition in doubts(curve))]
        if interrupted:
            total = sum(len(test.preload) for test in self._case.vibrations)
            what = f"interrupted after {len(curves)} of {total} preloads"
            conditions.append(Condition("interrupted", what, "run it again"))
        complete = self._complete and not interrupted
        return DynamicResponse(self._case, self._material, curves, tuple(conditions), complete, self._seconds)

    def test(self, test: DynamicTest, tested: Sequence[Extent]) -> None:
        """Reach the preloads of a load case, and compute the stiffness about each."""
        name, active = test.label, _acting(self._case, test)
        self._conditions += outside_measured(name, of_test(test), tested, active)
        self._conditions += effects_left_out(name, active)
        features = features_of(in_state(active, unrelaxed=False))
        mesh, mode = self._case.mesh.refinement, test.simulated_mode
        model = prepare(self._case.geometry, mode, rubber_of(self._material), mesh, self._comm, features)
        density, thinned = self._material.density, thinned_of(active)
        vibrations = Vibrations(name, test, model, branches_of(active), density, thinned)

        def report(step: int, steps: int, newton: int, q: float) -> None:
            meet(self._comm)
            if self._progress is not None:
                self._progress(name, step, steps, newton, q)

        follow = partial(march, drive=vibrations.drive, progress=report, observer=vibrations.observe)
        start = time.perf_counter()
        try:
            for program in test.programs():
                try:
                    follow(model, program)
                except NotConverged as failure:
                    self._complete = False
                    self._conditions.append(_not_reached(name, test, failure))
        finally:
            # Also of a march that was interrupted.
            self.curves += [curve for i in sorted(vibrations.curves) for curve in vibrations.curves[i]]
            self._complete = self._complete and not vibrations.unstable
            for q in vibrations.unstable.values():
                what = f"{name}: the preload {test.place(q)} is unstable: the stiffness has a negative eigenvalue there"
                remedy = "set a smaller preload, or a law that is stable there; the part buckles, or would jump to "
                self._conditions.append(Condition("unstable_preload", what, f"{remedy}another state"))
            self._seconds["dynamic"] += vibrations.seconds
            self._seconds["static"] += time.perf_counter() - start - vibrations.seconds


def _not_reached(name: str, test: DynamicTest, failure: NotConverged) -> Condition:
    what = f"the preload {test.place(failure.target)} was not reached: no equilibrium beyond {test.place(failure.last)}"
    if failure.largest is not None:
        (q, force), unit = failure.largest, "N mm" if modes()[test.mode].rotational else "N"
        what = f"a preload was not reached: the largest force found is {force:.4g} {unit} at {test.place(q)}"
    what = f"{name}: {what} ({failure.reason}); preloads up to there have their results"
    remedy = "set a smaller preload (in mm or N), more steps or a coarser mesh"
    return Condition("preload_not_reached", what, remedy)


def effects_left_out(name: str, active: Sequence[ActiveEffect]) -> list[Condition]:
    """Return which effects the dynamic stiffness is without.

    Parameters
    ----------
    name : str
        Name of the channel.
    active : sequence of ActiveEffect
        Effects that act on it.
    """
    conditions = []
    sliding = " and ".join(readable_name(effect.name) for effect in active if effect.effect.slides)
    if sliding:
        what = f"{name}: {sliding} is left out: its stiffness depends on the amplitude"
        remedy = "add a vibration in time to compare: bushcli direct"
        conditions.append(Condition("effect_left_out", what, remedy))
    rig = " and ".join(readable_name(effect.name) for effect in active if effect.effect.acts == "rig")
    if rig:
        what = f"{name}: the stiffness is that of the part, without {rig} of the rig"
        remedy = "nothing to do, unless the part is compared with a rig's table: `bushcli direct` compares, with all "
        remedy += "effects of the rig but free play"
        conditions.append(Condition("effect_left_out", what, remedy))
    return conditions


def doubts(curve: DynamicCurve) -> list[Condition]:
    """Return what is doubtful about a curve: reduction, contact."""
    conditions = []
    if not curve.reduction_error <= PROMISED:
        what = f"{curve.name}: the reduction may be wrong by {100 * curve.reduction_error:.2g} %"
        remedy = "ask for lower frequencies: near resonances of the rubber the stiffness changes by orders"
        conditions.append(Condition("reduction_error", what, remedy))
    if curve.touching:
        surfaces = ", ".join(f"{a} and {b}" for a, b in curve.touching)
        what = (
            f"{curve.name} at {curve.test.place(curve.preload)}: {surfaces} touch under the preload, and the "
        )
        what += "vibration neither opens nor closes the contact"
        remedy = "holds for amplitudes that leave the contact as it is"
        conditions.append(Condition("contact_frozen", what, remedy))
    return conditions
