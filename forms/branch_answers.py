"""Point functions (`forms.point`) of a path-dependent branch, its memory after a step, and derivatives of both."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import ufl

from forms.branch import Branch, Contribution, Internal, Step
from forms.kinematics import Kinematics, strain_of
from forms.law import Scalar
from forms.point import PointFunction, answer, by_name, variables
from forms.setting import KinematicDescription
from forms.symmetric import Symmetric, unpack

#: Inputs that follow a branch's own parameters: the law's initial shear modulus (MPa), and the step's duration (s).
GIVEN = ("shear modulus", "duration")


@dataclass(frozen=True)
class BranchFunctions:
    """Functions of a branch, to be compiled.

    Attributes
    ----------
    memory : int
        Count of the numbers in a point's memory.
    virgin : tuple of float
        Their values in virgin rubber.
    needs_energy : bool
        Whether the branch's answer has the part for the law's energy.
    stress, moduli : PointFunction
        Answer, without and with moduli (and part for the law's energy).
    end : PointFunction
        [stored energy, memory at the end of the step].
    stress_rate : callable
        Number of directions -> function of the derivatives of [V_a, V_e if needed], one row after the other, along
        changes of all inputs but the strains ("d0 memory", ..., "d1 memory", ...).
    end_rate : callable
        The same for the memory at the end, along changes of all inputs.
    """

    memory: int
    virgin: tuple[float, ...]
    needs_energy: bool
    stress: PointFunction
    moduli: PointFunction
    end: PointFunction
    stress_rate: Callable[[int], PointFunction]
    end_rate: Callable[[int], PointFunction]


def branch_functions(setting: KinematicDescription, branch: Branch) -> BranchFunctions:
    """Functions of a branch in the kinematics of a setting.

    Parameters
    ----------
    setting : KinematicDescription
        Kinematics, with its strain variables.
    branch : Branch
        The branch.
    """
    places = memory_places(strain_of([ufl.variable(ufl.as_ufl(1.0)) for _ in setting.names]))
    virgin = [value for kind in branch.internal.values() for value in _virgin(kind, places)]
    blocks = {
        "strain": len(setting.names) + 1,
        "law energy": 1,
        "memory": len(virgin),
        "parameters": len(branch.parameters) + len(GIVEN),
    }

    def build(inputs: Mapping[str, Scalar]) -> _Made:
        return _Made.of(branch, places, inputs)

    def key(what: str) -> tuple[Hashable, ...]:
        return ("branch", branch.contribution, branch.update, what, str(len(setting.names)))

    def end(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        built = build(inputs)
        return [built.contribution.stored, *built.end]

    def rates(
        what: str, names: Sequence[str], vector: Callable[[_Made], list[Scalar]]
    ) -> Callable[[int], PointFunction]:
        # A march asks for the same in every step.
        known: dict[int, PointFunction] = {}

        def function(directions: int) -> PointFunction:
            if directions in known:
                return known[directions]
            changes = {f"d{i} {name}": blocks[name] for i in range(directions) for name in names}

            def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
                whole = ufl.as_vector(vector(build(inputs)))
                rows = [
                    sum(ufl.derivative(whole, inputs[name], inputs[f"d{i} {name}"]) for name in names)
                    for i in range(directions)
                ]
                return [row[j] for row in rows for j in range(len(whole))]

            known[directions] = PointFunction(key(f"{what} {directions}"), blocks | changes, make)
            return known[directions]

        return function

    others = [name for name in blocks if name != "strain"]
    return BranchFunctions(
        len(virgin),
        tuple(virgin),
        _needs_energy(branch, places, blocks),
        PointFunction(key("stress"), blocks, lambda inputs: build(inputs).answer(moduli=False)),
        PointFunction(key("moduli"), blocks, lambda inputs: build(inputs).answer(moduli=True)),
        PointFunction(key("end"), blocks, end),
        rates("stress rate", others, _Made.slopes),
        rates("end rate", list(blocks), lambda built: built.end),
    )


def _needs_energy(branch: Branch, places: Sequence[int], blocks: Mapping[str, int]) -> bool:
    # Marked as variables, so that UFL does not evaluate them.
    numbers = {
        name: ufl.as_vector([ufl.variable(ufl.as_ufl(1.0)) for _ in range(n)]) for name, n in blocks.items()
    }
    return _Made.of(branch, places, numbers).contribution.measures is None


def memory_places(strain: Kinematics) -> tuple[int, ...]:
    """Components of a symmetric tensor that do not vanish in these kinematics."""
    assert strain.metric is not None
    return tuple(i for i, c in enumerate(strain.metric.components) if not isinstance(c, int))


@dataclass(frozen=True)
class _Made:
    """A branch evaluated at a point: contribution, memory at the end of the step, and variables of the derivatives."""

    contribution: Contribution
    end: list[Scalar]
    y: list[Scalar]
    energy: Scalar
    measures: tuple[Scalar, ...]
    given: Mapping[str, Scalar]

    @classmethod
    def of(cls, branch: Branch, places: Sequence[int], inputs: Mapping[str, Scalar]) -> _Made:
        y = variables(inputs["strain"])
        strain, energy = strain_of(y[:-1]), ufl.variable(inputs["law energy"][0])
        parameters = by_name(branch.parameters, inputs["parameters"])
        shear, duration = (inputs["parameters"][len(parameters) + i] for i in range(len(GIVEN)))
        step = Step(strain, energy, shear, _unpack_internal(branch, places, inputs["memory"]), duration)
        contribution = branch.contribution(step, **parameters)
        ends = branch.update(step, **parameters)
        end = [part for name in branch.internal for part in _components(ends[name])]
        measures = (*strain.measures, energy) if contribution.measures is None else contribution.measures
        return cls(contribution, end, y, energy, measures, inputs)

    def slopes(self) -> list[Scalar]:
        """V_a, and V_e where it is needed."""
        row = self.answer(moduli=False)
        n = len(self.y)
        return [*row[1 : 1 + n], *row[1 + n : 2 + n]]

    def answer(self, moduli: bool) -> list[Scalar]:
        """The answer, with the part for the law's energy where the branch needs it."""
        entries = answer(self.contribution.incremental, self.measures, self.y, self.given, moduli)
        entries[0] = ufl.as_ufl(0)
        if self.contribution.measures is not None:
            return entries
        both = [*self.y, self.energy]
        n = len(self.y)
        row = answer(self.contribution.incremental, self.measures, both, self.given, moduli=True)
        second = dict(zip(combinations_with_replacement(range(n + 1), 2), row[2 + n :], strict=True))
        tail = [row[1 + n], second[n, n], *(second[a, n] for a in range(n))]
        return [*entries, *tail] if moduli else [*entries, tail[0]]


def _virgin(kind: str, places: Sequence[int]) -> list[float]:
    return [0.0] if kind == "scalar" else [1.0 if place < 3 else 0.0 for place in places]


def _unpack_internal(branch: Branch, places: Sequence[int], values: Scalar) -> Internal:
    start, internal = 0, dict[str, Scalar | Symmetric]()
    for name, kind in branch.internal.items():
        size = 1 if kind == "scalar" else len(places)
        parts = [values[start + i] for i in range(size)]
        internal[name] = parts[0] if kind == "scalar" else unpack(parts, places)
        start += size
    return internal


def _components(value: Scalar | Symmetric) -> list[Scalar]:
    if isinstance(value, Symmetric):
        return [c for c in value.components if not isinstance(c, int)]
    return [value]
