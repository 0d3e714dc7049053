"""Vibrations of one load case: at each preload of a march the body is reduced, and gives stiffness at any frequency."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case import DynamicTest
from bushcli.case.case import DENSITY
from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from cases.contact.touch import touches
from cases.dynamic.amplitude import SETTLED, UnevenModel
from cases.dynamic.model import Branches, DynamicModel, spread
from cases.dynamic.pencil import Pencil, Unstable
from cases.dynamic.reduction import basis_for
from cases.dynamic.slopes import Changes, changes
from cases.equilibrium import Equilibrium
from cases.load import PrescribedForce
from cases.model import FiniteElementModel
from cases.ranks import sum_over_ranks
from cases.sine import ThinnedSpectrum

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

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
        return self.test.vibrating_mode

    @property
    def loss_angle(self) -> Array:
        """Phase by which the force leads the displacement, rad, shape (f,)."""
        return np.asarray(np.angle(self.stiffness), dtype=np.float64)


def branches_of(effects: Sequence[ActiveEffect]) -> Branches:
    """Return the Maxwell branches of effects: g and tau (s) of each, at the temperature of the channel."""
    bonded, slower = _factors_of_temperature(effects)
    return [
        (bonded * float(part.parameters["g"]), slower * float(part.parameters["tau"]))
        for item in features_of(effects)
        if item.feature.branches is not None
        for part in item.feature.branches(item.values)
        if part.branch.name == "maxwell" and part.branch.clock == ""
    ]


def thinned_of(effects: Sequence[ActiveEffect]) -> ThinnedSpectrum | None:
    """Return the relaxation of effects that amplitude thins, at the temperature of the channel; None without one."""
    bonded, slower = _factors_of_temperature(effects)
    for item in features_of(effects):
        if item.feature.thinned is not None:
            spectrum = item.feature.thinned(item.values)
            # In the time of the reference temperature: the path counts as at that.
            moduli, times, path = bonded * spectrum.moduli, slower * spectrum.times, slower * spectrum.path
            return replace(spectrum, moduli=moduli, times=times, path=path)
    return None


def _factors_of_temperature(effects: Sequence[ActiveEffect]) -> tuple[float, float]:
    """Return the factors on the branches' moduli and on all relaxation times at the temperature of the channel."""
    for item in features_of(effects):
        if item.feature.heated is not None:
            _, bonded, slower = item.feature.heated(item.values, item.temperature)
            return float(bonded), float(slower)
    return 1.0, 1.0


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

    def observe(self, solver: Equilibrium) -> None:
        """Compute the stiffness if the equilibrium is a preload."""
        number = self.test.preload_number(solver.q, solver.force)
        if number is None or number in self.curves or number in self.unstable:
            return
        start = time.perf_counter()
        try:
            self.curves[number] = self._curves(solver)
        except Unstable:
            self.unstable[number] = solver.q
        finally:
            self.seconds += time.perf_counter() - start

    def _curves(self, solver: Equilibrium) -> list[DynamicCurve]:
        test, frequency = self.test, np.array(self.test.frequency)
        metal = {name: DENSITY * sleeve.density for name, sleeve in self.model.mesh.sleeves.items()}
        pencil = Pencil(self.model, solver, metal)
        tolerance = CHOSEN_WITH_SLOPES if self._names else CHOSEN
        basis = basis_for(pencil, spread(frequency, self._branches), self._density, tolerance)
        reduced = basis.reduced_pencil()
        number = test.motion
        uneven_too = bool(test.amplitude) and self._thinned is not None
        even = bool(self._names) and not uneven_too
        slopes = changes(basis, solver, self._names, self.drive) if even else Changes()
        model = DynamicModel(reduced, number, test.transfer, slopes)
        pose, forces = solver.pose, solver.six
        small = DynamicCurve(
            self.name,
            test,
            solver.q if pose is None else float(pose[number]),
            solver.force if forces is None else float(forces[number]),
            frequency,
            model.stiffness(frequency, self._branches),
            model.error(frequency, self._branches),
            len(reduced.equilibrium),
            model,
            self._branches,
            None if pose is None else model.matrix(frequency, self._branches),
            _surfaces_in_contact(self.model),
        )
        if not test.amplitude:
            return [small]
        if self._thinned is None:
            return [replace(small, amplitude=amplitude) for amplitude in test.amplitude]
        uneven = UnevenModel(basis, self._thinned, self._maxwell, number, test.transfer)
        # Where moduli differ most from point to point lies between: vectors for these amplitudes serve all others.
        rising = sorted(test.amplitude)
        rising = sorted({rising[0], rising[len(rising) // 2], rising[-1]})
        limits = sorted({frequency.min(), frequency.max()})
        error = max(small.reduction_error, *(uneven.enrich(a, f) for a in rising for f in limits))
        if self._names:
            # Over the vectors that were added.
            slopes = changes(basis, solver, self._names, self.drive)
            small = replace(small, model=DynamicModel(basis.reduced_pencil(), number, test.transfer, slopes))

        def curve(amplitude: float) -> DynamicCurve:
            balances = uneven.balances(np.full(len(frequency), amplitude), frequency, third=True)
            unsettled = [balance.moved for balance in balances if balance.moved > SETTLED]
            return replace(
                small,
                stiffness=np.array([balance.stiffness for balance in balances]),
                vectors=uneven.vectors,
                matrix=None,
                reduction_error=max([error, *unsettled]),
                amplitude=amplitude,
                third_harmonic=np.array([balance.third for balance in balances]),
                uneven=uneven,
            )

        return list(map(curve, test.amplitude))


def _surfaces_in_contact(model: FiniteElementModel) -> tuple[tuple[str, str], ...]:
    """Return which surfaces are in contact at the present state; a plate in front of the free ends is one of them."""
    contact = model.surfaces.contact
    met = () if contact is None else touches(contact, model.state.x.array)
    surfaces = [contact.surfaces for contact in met]
    gap = model.parameters.constants.get(_GAP)
    if gap is not None:
        # The plates push if they have energy that they would not have further away.
        near, width = model.surfaces.energy(), float(gap.value)
        model.parameters.set({_GAP: _AWAY})
        away = model.surfaces.energy()
        model.parameters.set({_GAP: width})
        if sum_over_ranks(model.comm, near - away) > 0.0:
            surfaces.append(("free end", "snubber"))
    return tuple(surfaces)
