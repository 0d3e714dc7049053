"""The bushing's rubber and metal at their quadrature points: energy, forces and stiffness at a state.

Each part (the rubber, each elastic sleeve) goes the same way: unknowns -> gradients -> strain variables -> answer of the
material -> forces and stiffness by the gradients -> unknowns. Only the material differs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from cases.kernels import kernel, loops, pointer
from cases.material import Metal, Rubber
from cases.moved import MovedPoints
from cases.parameters import Numbers
from cases.points import Points
from forms import answers
from forms.kinematics import SETTINGS, Setting

Array = NDArray[np.float64]
Index = NDArray[np.int32]

#: Answer (points, length) of a part at strains, with or without moduli.
Answer = Callable[[Array, bool], Array]


class Part:
    """Cells of one material.

    Parameters
    ----------
    kinematics
        Name of the setting.
    points
        Their quadrature points.
    moved
        The stress-free body there, where it is not the mesh.

    Attributes
    ----------
    A : shape (points, upper triangle)
        Energy's second derivatives by gradients, as `stiffen` left them.
    """

    def __init__(self, kinematics: str, points: Points, moved: MovedPoints | None) -> None:
        setting = SETTINGS[kinematics]
        self.points, self._moved = points, moved
        self._strains = kernel(answers.strains(kinematics, setting))
        self._forces = kernel(answers.forces(kinematics, setting))
        self._functions = (answers.moduli(kinematics, setting), answers.strain_rates(kinematics, setting))
        self._strain = np.empty((points.number, len(setting.names) + 1))
        self._P = np.empty((points.number, points.rows))
        self.A = np.zeros((0, 0))

    def place(self, swelling: float, anew: bool) -> None:
        """Bring the stress-free body to its place; ``anew`` where parameters may have moved it."""
        if self._moved is not None and anew:
            self.points.move(self._moved.now(), swelling)
        else:
            self.points.rescale(swelling)

    def moving(self, name: str) -> object:
        """Change of the points with a parameter (`Points.moving`); None where there is none."""
        rate = None if self._moved is None else self._moved.rate(name)
        return None if rate is None else self.points.moving(rate)

    def strains(self, g: Array) -> Array:
        """Strain variables and pressure; the next call writes into the same array."""
        self._strain[:] = 0.0
        self._strains.add(self._strain, {"gradients": g})
        return self._strain

    def strain_rates(self, g: Array, change: Array) -> Array:
        """Change of the strain variables along a change of the gradients."""
        return kernel(self._functions[1])(self.points.number, {"gradients": g, "change": change})

    def by_gradients(self, g: Array, answer: Array) -> Array:
        """Energy's derivatives by the gradients, from those by the strains; the same array each time."""
        self._P[:] = 0.0
        self._forces.add(self._P, {"gradients": g, "answer": answer})
        return self._P

    def stiffen(self, g: Array, answer: Array) -> None:
        """Second derivatives by the gradients, kept in `A`."""
        if not self.A.size:
            self.A = np.empty((self.points.number, self.points.rows * (self.points.rows + 1) // 2))
        self.A[:] = 0.0
        kernel(self._functions[0]).add(self.A, {"gradients": g, "answer": answer})

    def contracted(self, change: Array) -> Array:
        """A applied to a change of the gradients."""
        P = np.empty_like(change)
        loops().lib.contract(len(change), change.shape[1], pointer(self.A), pointer(change), pointer(P))
        return P


class Body:
    """Rubber and elastic sleeves of a model.

    Parameters
    ----------
    rubber, metals
        Parts with their materials; the sleeves in the order of `Numbers.metals`.
    """

    def __init__(self, rubber: tuple[Part, Rubber], metals: Mapping[str, tuple[Part, Metal]]) -> None:
        self.rubber, self.material = rubber
        self.metals = dict(metals)
        self.numbers: Numbers | None = None

    @property
    def parts(self) -> list[Part]:
        """Rubber first."""
        return [self.rubber, *(part for part, _ in self.metals.values())]

    def take(self, numbers: Numbers, anew: bool) -> None:
        """Be made of this from now on; ``anew`` where parameters may have moved the stress-free body."""
        if numbers is self.numbers:
            return
        self.numbers = numbers
        for part in self.parts:
            part.place(float(numbers.volumetric[1]) if part is self.rubber else 1.0, anew)

    @property
    def given(self) -> Numbers:
        """What it is made of."""
        assert self.numbers is not None
        return self.numbers

    def answers(self) -> list[tuple[Part, Answer]]:
        """Each part with the answer of its material."""
        found: list[tuple[Part, Answer]] = [
            (self.rubber, lambda strain, moduli: self.material.answer(strain, self.given, moduli))
        ]
        for (part, metal), moduli in zip(self.metals.values(), self.given.metals, strict=True):
            found.append((part, lambda strain, _, metal=metal, own=moduli: metal.answer(strain, own)))
        return found

    def add_forces(self, x: Array, forces: Array) -> None:
        """Add the derivative of the energy with respect to the unknowns x, on this rank."""
        for part, answer in self.answers():
            g = part.points.gradients(x)
            part.points.add_forces(part.by_gradients(g, answer(part.strains(g), False)), forces)

    def stiffen(self, x: Array) -> None:
        """Compute the second derivatives at the points, for the two functions below."""
        for part, answer in self.answers():
            g = part.points.gradients(x)
            part.stiffen(g, answer(part.strains(g), True))

    def add_stiffness(self, places: list[Index], values: Array) -> None:
        """Add the stiffness at the state of `stiffen` (`cases.matrix.Places`)."""
        for part, place in zip(self.parts, places, strict=True):
            part.points.add_stiffness(part.A, place, values)

    def add_action(self, direction: Array, forces: Array) -> None:
        """Add the stiffness at the state of `stiffen`, applied to a direction."""
        for part in self.parts:
            part.points.add_forces(part.contracted(part.points.gradients(direction)), forces)

    def energy(self, x: Array) -> float:
        """Stored energy on this rank, N mm."""
        strain = self.rubber.strains(self.rubber.points.gradients(x))
        total = self.rubber.points.integral(self.material.energy(strain, self.given))
        for part, answer in self.answers()[1:]:
            density = answer(part.strains(part.points.gradients(x)), False)[:, 0]
            total += part.points.integral(density)
        return total

    @property
    def volume(self) -> float:
        """Of the stress-free body on this rank without swelling, mm^3, metal included."""
        swelling = float(self.given.volumetric[1])
        return float(self.rubber.points.weight.sum()) / swelling + sum(
            float(part.points.weight.sum()) for part, _ in self.metals.values()
        )


def setting_of(kinematics: str) -> Setting:
    """The gradients and strains of a kinematics."""
    return SETTINGS[kinematics]
