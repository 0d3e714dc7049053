"""Functions of a few numbers at a point, in UFL, from which kernels for stresses and moduli are compiled.

An energy W is a function of the strain variables y of its `forms.setting.KinematicDescription` and of the pressure,
which comes last. Law, volumetric part, metal and branches each have functions of their own (`forms.answers`,
`forms.branch_answers`), so that each is compiled once and serves every mesh, every element and every combination: their
answers are added where they are evaluated (`cases.material`). Parameters, memory and time step are inputs like the
strains.

An *answer* is the row [W, W_a, W_ab], b >= a. A branch that depends on the law's energy e has the row
[V_e, V_ee, V_ae] after it, with V its incremental energy; to add such a branch, the law's own W_a and W_ab are needed.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import ufl

from forms.chain import collapse
from forms.law import Scalar


@dataclass(frozen=True)
class PointFunction:
    """A function of blocks of numbers at a point.

    Attributes
    ----------
    key : tuple
        Identity of the function, under which its kernel is stored and found again.
    blocks : mapping
        Name of an input -> count of its numbers.
    make : callable
        The inputs by name, each a UFL vector -> list of UFL scalars.
    batch : int
        Number of points that a kernel takes at once: more than one pays only where much of the work depends on
        parameters alone.
    """

    key: tuple[Hashable, ...]
    blocks: Mapping[str, int]
    make: Callable[[Mapping[str, Scalar]], Sequence[Scalar]]
    batch: int = 1

    @staticmethod
    def is_single(name: str) -> bool:
        """Whether an input is the same for all points: parameters, and changes of them."""
        return name.endswith("parameters")


def length(n: int, moduli: bool) -> int:
    """Return the count of energy, stresses and moduli with n variables.

    Parameters
    ----------
    n : int
        Number of variables.
    moduli : bool
        Whether second derivatives are included.
    """
    return 1 + n + (n * (n + 1) // 2 if moduli else 0)


def answer(
    W: Scalar, measures: Sequence[Scalar], y: Sequence[Scalar], inputs: Mapping[str, Scalar], moduli: bool
) -> list[Scalar]:
    """[W, W_a, W_ab]; zero by variables that W does not depend on.

    Parameters
    ----------
    W : Scalar
        Energy per volume, MPa.
    measures : Sequence[Scalar]
        UFL variables that the energy is a function of.
    y : Sequence[Scalar]
        Strain variables and pressure, each a ufl.variable.
    inputs : Mapping[str, Scalar]
        Inputs of the function by name, UFL vectors.
    moduli : bool
        Whether second derivatives are included.
    """
    collapsed = collapse(W, measures, inputs["strain"])
    place = {variable.label(): a for a, variable in enumerate(collapsed.y)}
    slopes = dict(enumerate(slope for _, slope in collapsed.slopes()))
    positions = [place.get(variable.label()) for variable in y]
    zero = ufl.as_ufl(0)
    row = [W, *(zero if a is None else slopes[a] for a in positions)]
    if moduli:
        row += [
            zero if a is None or b is None else collapsed.curvature(a, b)
            for a, b in combinations_with_replacement(positions, 2)
        ]
    return row


def variables(values: Scalar) -> list[Scalar]:
    """The numbers of an input as ufl.variable."""
    return [ufl.variable(values[i]) for i in range(len(values))]


def by_name(names: Iterable[str], values: Scalar) -> dict[str, Scalar]:
    """The numbers of an input by name.

    Parameters
    ----------
    names : Iterable[str]
        Names of the parameters that are given, in their order.
    values : Scalar
        UFL vector of numbers.
    """
    return {name: values[i] for i, name in enumerate(names)}
