"""The bushing's rubber and metal at their quadrature points: energy, forces and stiffness at a state.

Each part (the rubber, each elastic sleeve) is evaluated in the same order: unknowns -> gradients -> strain variables ->
answer of the material -> forces and stiffness by the gradients -> unknowns. Only the material differs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cases.drawn_in import DrawnIn
from cases.kernels import Call, kernel, loops, pointer
from cases.material import RubberAtPoints
from cases.metal import MetalAtPoints
from cases.parameters import Numbers
from cases.points import Moving, Points
from cases.stress_free import MovedPoints
from forms import answers, gradients
from forms.setting import SETTINGS

Array = NDArray[np.float64]
Index = NDArray[np.int32]


class MaterialCells:
    """Cells of one material.

    Parameters
    ----------
    kinematics
        Name of the setting.
    points
        Their quadrature points.
    material
        Material of the cells.
    moved
        Position of the stress-free body at the points; None where it is the mesh.
    drawn_in
        Displacement at which a sleeve is free of stress; None in rubber.

    Attributes
    ----------
    g : shape (points, rows)
        Gradients and pressure at the state of the last `look`.
    P : shape (points, rows)
        Derivatives of the energy by the entries of `g`, as the last `answer` computed them.
    A : shape (points, upper triangle)
        Second derivatives of the energy by the entries of `g`, as the last `stiffen` computed them.
    skew : shape (clocks, 2, points, rows), or None where the tangent is symmetric
        Vectors s and z of its skew part, the sum of (s_k z_l - z_k s_l) / 2; `A` is then its symmetric part.
    """

    def __init__(
        self,
        kinematics: str,
        points: Points,
        material: RubberAtPoints | MetalAtPoints,
        moved: MovedPoints | None,
        drawn_in: DrawnIn | None,
    ) -> None:
        self.points, self.material, self._moved, self._drawn_in = points, material, moved, drawn_in
        self._name, self._setting = kinematics, SETTINGS[kinematics]
        self.g, self.P = np.zeros((points.number, points.rows)), np.zeros((points.number, points.rows))
        self._strains = kernel(gradients.strains(kinematics, self._setting)).bind(
            material.strain, {"gradients": self.g}, clear=True
        )
        self.skew: Array | None = None
        self._forces: tuple[Array, Call] | None = None
        # `g` several times over, at the state of the last `look`; empty until it is needed.
        self._tiled = self.g[:0]
        # Unknowns of the last `look`, whose gradients and strains need not be computed again.
        self._seen: Array | None = None

    def place(self, swelling: float, anew: bool) -> None:
        """Update the position of the stress-free body.

        Parameters
        ----------
        swelling : float
            Volume of the stress-free body over that of its shape, a ratio.
        anew : bool
            Whether parameters may have moved the stress-free body.
        """
        if anew:
            self._seen = None
        if self._moved is not None and anew:
            self.points.move(self._moved.now(), swelling)
        else:
            self.points.rescale(swelling)

    def change_of_points(self, name: str) -> Moving | None:
        """Return how the points change with a parameter; None if they do not."""
        rate = None if self._moved is None else self._moved.rate(name)
        return None if rate is None else self.points.change_of_points(rate)

    def change_of_gradients(self, name: str) -> Array | None:
        """Return the change of the gradients with a parameter that draws the cells in; None if it does not."""
        rate = None if self._drawn_in is None else self._drawn_in.rate(name)
        return None if rate is None else self.points.gradients(-rate)

    def strained(self, x: Array) -> Array:
        """Return the displacement beyond the one at which the cells are free of stress, over this rank's unknowns."""
        return x if self._drawn_in is None else self._drawn_in.beyond(x)

    def look(self, x: Array) -> None:
        """Compute gradients and strains at a state, given by this rank's unknowns."""
        self.points.gradients(self.strained(x), self.g)
        self._strains()
        self._seen, self._tiled = x.copy(), self.g[:0]

    def look_again(self, x: Array) -> None:
        """Do the same as `look`, unless the state is that of the last call."""
        if self._seen is None or not np.array_equal(self._seen, x):
            self.look(x)

    def answer(self) -> Array:
        """Return `P`, the derivatives of the energy by the gradients at the state of `look`."""
        row = self.material.answer(moduli=False)
        if self._forces is None or self._forces[0] is not row:
            inputs = {"gradients": self.g, "answer": row}
            function = kernel(gradients.forces(self._name, self._setting))
            self._forces = (row, function.bind(self.P, inputs, clear=True))
        self._forces[1]()
        return self.P

    def by_gradients(self, answers: Array) -> Array:
        """Convert derivatives by the strains to those by the gradients, in a new array (k, points, rows).

        The derivatives are answers without moduli, (k, points, 1 + variables), whose energy is not read.
        """
        count, points, length = answers.shape
        function = kernel(gradients.forces(self._name, self._setting))
        # All in one call: in the half-plane a call takes longer than the work at the points.
        inputs = {"gradients": self._repeated_gradients(count), "answer": answers.reshape(-1, length)}
        found = function(count * points, inputs)
        # A rank may have no points of a part.
        return found.reshape(count, points, found.shape[-1])

    def strain_rates(self, changes: Array) -> Array:
        """Return the changes of the strain variables due to changes of the gradients, (k, points, rows)."""
        count, points, rows = changes.shape
        function = kernel(gradients.strain_rates(self._name, self._setting))
        inputs = {"gradients": self._repeated_gradients(count), "change": changes.reshape(-1, rows)}
        found = function(count * points, inputs)
        return found.reshape(count, points, found.shape[-1])

    def _repeated_gradients(self, count: int) -> Array:
        if count == 1:
            return self.g
        if len(self._tiled) != count * len(self.g):
            self._tiled = np.tile(self.g, (count, 1))
        return self._tiled

    @cached_property
    def A(self) -> Array:
        """Second derivatives of the energy by the gradients; see the class."""
        return np.zeros((self.points.number, self.points.rows * (self.points.rows + 1) // 2))

    @cached_property
    def _moduli(self) -> Call:
        inputs = {"gradients": self.g, "answer": self.material.answer(moduli=True)}
        return kernel(gradients.moduli(self._name, self._setting)).bind(self.A, inputs, clear=True)

    def stiffen(self) -> None:
        """Compute `A`, and `skew`, at the state of `look`."""
        self.material.answer(moduli=True)
        self._moduli()
        if isinstance(self.material, RubberAtPoints) and self.material.skew is not None:
            skew = self.material.skew
            # Not -1: a rank may have no points of the rubber.
            rows = self.by_gradients(skew.reshape(2 * len(skew), *skew.shape[2:]))
            self.skew = rows.reshape(*skew.shape[:2], *rows.shape[1:])

    def resting_moduli(self) -> Array:
        """Return what `A` is of a spring of unit modulus that is at rest at the state of `look` (`resting_answer`)."""
        strain = self.material.strain
        spring = kernel(answers.resting_answer(self._setting))(
            len(strain), {"strain": strain, "rest": strain}
        )
        return kernel(gradients.moduli(self._name, self._setting))(
            len(strain), {"gradients": self.g, "answer": spring}
        )

    def contract(self, change: Array) -> Array:
        """Return the product of the second derivatives and a change of the gradients."""
        P = np.empty_like(change)
        loops().lib.contract(len(change), change.shape[1], pointer(self.A), pointer(change), pointer(P))
        for s, z in () if self.skew is None else self.skew:
            P += (s * np.einsum("pk,pk->p", z, change)[:, None]) / 2
            P -= (z * np.einsum("pk,pk->p", s, change)[:, None]) / 2
        return P


class Body:
    """Rubber and elastic sleeves of a model.

    Parameters
    ----------
    rubber, metals
        Parts; the sleeves in the order of `cases.parameters.Numbers.metals`.

    Attributes
    ----------
    parts : list of MaterialCells
        Rubber first.
    material : RubberAtPoints
    """

    def __init__(self, rubber: MaterialCells, metals: Mapping[str, MaterialCells]) -> None:
        assert isinstance(rubber.material, RubberAtPoints)
        self.rubber, self.material = rubber, rubber.material
        self._metals = list(metals.values())
        self.parts = [rubber, *self._metals]
        self.numbers: Numbers | None = None

    def take(self, numbers: Numbers, anew: bool) -> None:
        """Use these material numbers from now on.

        Parameters
        ----------
        numbers : Numbers
            Input of the kernels, computed from the parameters.
        anew : bool
            Whether parameters may have moved the stress-free body.
        """
        self.numbers = numbers
        self.material.take(numbers)
        self.rubber.place(float(numbers.volumetric[1]), anew)
        for part, moduli in zip(self._metals, numbers.metals, strict=True):
            assert isinstance(part.material, MetalAtPoints)
            part.material.take(moduli)
            part.place(1.0, anew)

    @property
    def symmetric(self) -> bool:
        """Whether the stiffness is symmetric; if not, `add_stiffness` adds its symmetric part."""
        return self.material.skew is None

    @property
    def swelling(self) -> float:
        """Volume ratio of the stress-free rubber to its shape."""
        assert self.numbers is not None
        return float(self.numbers.volumetric[1])

    def add_forces(self, x: Array, forces: Array) -> None:
        """Add the derivative of the energy with respect to the unknowns x, on this rank.

        Parameters
        ----------
        x : Array
            This rank's unknowns, shape (m,).
        forces : Array
            Vector over this rank's unknowns, shape (m,); changed in place.
        """
        for part in self.parts:
            part.look(x)
            part.points.add_forces(part.answer(), forces)

    def stiffen(self, x: Array) -> None:
        """Compute the second derivatives at the points, for `add_stiffness` and `add_action`."""
        for part in self.parts:
            part.look_again(x)
            part.stiffen()

    def add_stiffness(self, places: Sequence[Index], values: Array) -> None:
        """Add the stiffness at the state of `stiffen` (`cases.matrix.Pattern`).

        Parameters
        ----------
        places : Sequence[Index]
            Positions of the entries of element matrices, part by part.
        values : Array
            Entries, shape (entries,); changed in place.
        """
        for part, place in zip(self.parts, places, strict=True):
            part.points.add_stiffness(part.A, place, values)

    def add_action(self, direction: Array, forces: Array) -> None:
        """Add the product of the stiffness at the state of `stiffen` and a direction, or several.

        Parameters
        ----------
        direction : Array
            Vector over this rank's unknowns, shape (m,), or several, (k, m); contiguous.
        forces : Array
            Of the same shape, contiguous; changed in place.
        """
        size = direction.shape[-1]
        for part in self.parts:
            part.points.add_action(part.A, direction.reshape(-1, size), forces.reshape(-1, size), part.skew)

    def energy(self, x: Array) -> float:
        """Stored energy on this rank, N mm."""
        total = 0.0
        for part in self.parts:
            part.look_again(x)
            if isinstance(part.material, RubberAtPoints):
                total += part.points.integral(part.material.energy())
            else:
                total += part.points.integral(part.material.answer(moduli=False)[:, 0])
        return total

    @property
    def volume(self) -> float:
        """Volume of the stress-free body on this rank without swelling, mm^3, metal included."""
        metal_volume = sum(float(part.points.weight.sum()) for part in self._metals)
        return metal_volume + float(self.rubber.points.weight.sum()) / self.swelling
