"""What a material answers at a point, as UFL of a few numbers: energy, stresses and moduli by the strain variables.

An energy W is a function of the strain variables y of its `forms.kinematics.Setting` and of the pressure, which stands
last. Law, volumetric part, metal and branches each have functions of their own here, so that each is compiled once and
serves every mesh, every element and every combination: their answers are added where they are evaluated
(`cases.material`). Parameters, memory and time step are inputs like the strains.

An *answer* is the row [W, W_a, W_ab], b >= a. A branch that depends on the law's energy e has the row
[V_e, V_ee, V_ae] after it, V its incremental energy; for such a branch the law's own W_a and W_ab are needed to add it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import ufl

from forms.branch import Branch, Contribution, Internal, Step
from forms.chain import collapse
from forms.kinematics import Kinematics, Setting, strain_of
from forms.law import Law, Scalar
from forms.potential import sleeve_energy
from forms.symmetric import Symmetric, unpacked
from forms.volumetric import mixed_energy

#: Parts of a branch's parameters that are not its own: the law's initial shear modulus (MPa), and the step (s).
GIVEN = ("shear modulus", "duration")


@dataclass(frozen=True)
class PointFunction:
    """A function of blocks of numbers at a point.

    Attributes
    ----------
    key : tuple
        What it is: one that has been made need not be made again.
    blocks : mapping
        Name of an input -> how many numbers it has.
    make : callable
        The inputs by name, each a UFL vector -> list of UFL scalars.
    """

    key: tuple[Hashable, ...]
    blocks: Mapping[str, int]
    make: Callable[[Mapping[str, Scalar]], Sequence[Scalar]]


def length(n: int, moduli: bool) -> int:
    """Numbers in an answer with n variables."""
    return 1 + n + (n * (n + 1) // 2 if moduli else 0)


def law_answer(setting: Setting, law: Law, names: tuple[str, ...], moduli: bool) -> PointFunction:
    """Answer of a law with these parameters, of which some may be absent."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        y = _variables(given["strain"])
        strain = strain_of(y[:-1])
        W = law.energy(strain, **_named(names, given["parameters"]))
        return _answer(W, strain.measures, y, given, moduli)

    return PointFunction(
        ("law", law.energy, *names, "moduli" if moduli else "stress", str(len(setting.names))),
        {"strain": len(setting.names) + 1, "parameters": len(names)},
        make,
    )


def law_slopes(setting: Setting, law: Law, names: tuple[str, ...]) -> PointFunction:
    """Derivatives of [W, W_a] with respect to the law's parameters, one row after the other."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        y = _variables(given["strain"])
        strain = strain_of(y[:-1])
        marked = {name: ufl.variable(given["parameters"][i]) for i, name in enumerate(names)}
        W = law.energy(strain, **marked)
        slopes = [ufl.diff(W, variable) for variable in marked.values()]
        return [part for slope in slopes for part in _answer(slope, strain.measures, y, given, moduli=False)]

    return PointFunction(
        ("law", law.energy, *names, "slopes", str(len(setting.names))),
        {"strain": len(setting.names) + 1, "parameters": len(names)},
        make,
    )


def volumetric_answer(setting: Setting, moduli: bool) -> PointFunction:
    """Answer of the mixed volumetric part; parameters compliance (1/MPa) and swelling (1)."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        y = _variables(given["strain"])
        J = strain_of(y[:-1]).J
        compliance, swelling = given["parameters"]
        W = mixed_energy(J / swelling, y[-1], compliance)
        return _answer(W, (J, y[-1]), y, given, moduli)

    return PointFunction(
        ("volumetric", "moduli" if moduli else "stress", str(len(setting.names))),
        {"strain": len(setting.names) + 1, "parameters": 2},
        make,
    )


def volumetric_slopes(setting: Setting) -> PointFunction:
    """Derivatives of [W, W_a] with respect to compliance and swelling."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        y = _variables(given["strain"])
        J = strain_of(y[:-1]).J
        marked = [ufl.variable(value) for value in given["parameters"]]
        slopes = [ufl.diff(mixed_energy(J / marked[1], y[-1], marked[0]), value) for value in marked]
        return [part for slope in slopes for part in _answer(slope, (J, y[-1]), y, given, moduli=False)]

    return PointFunction(
        ("volumetric", "slopes", str(len(setting.names))),
        {"strain": len(setting.names) + 1, "parameters": 2},
        make,
    )


def work_slopes(function: PointFunction, rows: int) -> PointFunction:
    """Derivatives by parameters as `law_slopes` has them, of the work W_a dy_a on a change dy of the strain variables.

    Parameters
    ----------
    function
        Of rows [W, W_a].
    rows
        How many.
    """

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        parts, change = function.make(given), given["change"]
        width = len(parts) // rows
        return [
            sum((parts[i * width + 1 + a] * change[a] for a in range(width - 1)), ufl.as_ufl(0))
            for i in range(rows)
        ]

    blocks = dict(function.blocks) | {"change": function.blocks["strain"]}
    return PointFunction(("work", *function.key), blocks, make)


def metal_answer(setting: Setting) -> PointFunction:
    """Answer of a metal sleeve; parameters shear and bulk modulus (MPa), in both of which it is linear."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        y = _variables(given["strain"])
        strain = strain_of(y[:-1])
        return _answer(sleeve_energy(strain, *given["parameters"]), strain.measures, y, given, moduli=True)

    return PointFunction(
        ("metal", str(len(setting.names))), {"strain": len(setting.names) + 1, "parameters": 2}, make
    )


@dataclass(frozen=True)
class BranchFunctions:
    """What is compiled of a branch.

    Attributes
    ----------
    memory : int
        Numbers that a point remembers.
    virgin : tuple of float
        What they are in virgin rubber.
    needs_energy : bool
        Whether its answer has the part for the law's energy.
    stress, moduli : PointFunction
        Answer, without and with moduli (and part for the law's energy).
    end : PointFunction
        [stored energy, memory at the end of the step].
    stress_rate : PointFunction
        Derivative of [V_a, V_e if needed] along changes of all inputs but the strains ("d memory", ...).
    end_rate : PointFunction
        Derivative of the memory at the end along changes of all inputs.
    """

    memory: int
    virgin: tuple[float, ...]
    needs_energy: bool
    stress: PointFunction
    moduli: PointFunction
    end: PointFunction
    stress_rate: PointFunction
    end_rate: PointFunction


def branch_functions(setting: Setting, branch: Branch) -> BranchFunctions:
    """Functions of a branch in the kinematics of a setting."""
    places = memory_places(strain_of([ufl.variable(ufl.as_ufl(1.0)) for _ in setting.names]))
    virgin = [value for kind in branch.internal.values() for value in _virgin(kind, places)]
    blocks = {
        "strain": len(setting.names) + 1,
        "law energy": 1,
        "memory": len(virgin),
        "parameters": len(branch.parameters) + len(GIVEN),
    }

    def made(given: Mapping[str, Scalar]) -> _Made:
        return _Made.of(branch, places, given)

    def key(what: str) -> tuple[Hashable, ...]:
        return ("branch", branch.contribution, branch.update, what, str(len(setting.names)))

    def end(given: Mapping[str, Scalar]) -> list[Scalar]:
        one = made(given)
        return [one.contribution.stored, *one.end]

    def rate(vector: Sequence[Scalar], given: Mapping[str, Scalar], names: Iterable[str]) -> list[Scalar]:
        whole = ufl.as_vector(list(vector))
        change = sum(ufl.derivative(whole, given[name], given[f"d {name}"]) for name in names)
        return [change[i] for i in range(len(vector))]

    changes = {f"d {name}": n for name, n in blocks.items()}
    others = [name for name in blocks if name != "strain"]
    return BranchFunctions(
        len(virgin),
        tuple(virgin),
        _needs_energy(branch, places, blocks),
        PointFunction(key("stress"), blocks, lambda given: made(given).answer(moduli=False)),
        PointFunction(key("moduli"), blocks, lambda given: made(given).answer(moduli=True)),
        PointFunction(key("end"), blocks, end),
        PointFunction(
            key("stress rate"), blocks | changes, lambda given: rate(made(given).slopes(), given, others)
        ),
        PointFunction(key("end rate"), blocks | changes, lambda given: rate(made(given).end, given, blocks)),
    )


def _needs_energy(branch: Branch, places: Sequence[int], blocks: Mapping[str, int]) -> bool:
    # Marked, so that UFL does not compute with them.
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
    """A branch at a point: contribution, memory at the end, variables."""

    contribution: Contribution
    end: list[Scalar]
    y: list[Scalar]
    energy: Scalar
    measures: tuple[Scalar, ...]
    given: Mapping[str, Scalar]

    @classmethod
    def of(cls, branch: Branch, places: Sequence[int], given: Mapping[str, Scalar]) -> _Made:
        y = _variables(given["strain"])
        strain, energy = strain_of(y[:-1]), ufl.variable(given["law energy"][0])
        own = _named(branch.parameters, given["parameters"])
        shear, duration = (given["parameters"][len(own) + i] for i in range(len(GIVEN)))
        step = Step(strain, energy, shear, _unpacked(branch, places, given["memory"]), duration)
        made = branch.contribution(step, **own)
        ends = branch.update(step, **own)
        end = [part for name in branch.internal for part in _components(ends[name])]
        measures = (*strain.measures, energy) if made.measures is None else made.measures
        return cls(made, end, y, energy, measures, given)

    def slopes(self) -> list[Scalar]:
        """V_a, and V_e where it is needed."""
        row = self.answer(moduli=False)
        n = len(self.y)
        return [*row[1 : 1 + n], *row[1 + n : 2 + n]]

    def answer(self, moduli: bool) -> list[Scalar]:
        """The answer, with the part for the law's energy where the branch asks for it."""
        own = _answer(self.contribution.incremental, self.measures, self.y, self.given, moduli)
        own[0] = ufl.as_ufl(0)
        if self.contribution.measures is not None:
            return own
        both = [*self.y, self.energy]
        n = len(self.y)
        row = _answer(self.contribution.incremental, self.measures, both, self.given, moduli=True)
        second = dict(zip(combinations_with_replacement(range(n + 1), 2), row[2 + n :], strict=True))
        tail = [row[1 + n], second[n, n], *(second[a, n] for a in range(n))]
        return [*own, *tail] if moduli else [*own, tail[0]]


def _answer(
    W: Scalar, measures: Sequence[Scalar], y: Sequence[Scalar], given: Mapping[str, Scalar], moduli: bool
) -> list[Scalar]:
    """[W, W_a, W_ab]; zero by variables that W does not depend on."""
    collapsed = collapse(W, measures, given["strain"])
    place = {variable.label(): a for a, variable in enumerate(collapsed.y)}
    slopes = dict(enumerate(slope for _, slope in collapsed.slopes()))
    at = [place.get(variable.label()) for variable in y]
    zero = ufl.as_ufl(0)
    row = [W, *(zero if a is None else slopes[a] for a in at)]
    if moduli:
        row += [
            zero if a is None or b is None else collapsed.curvature(a, b)
            for a, b in combinations_with_replacement(at, 2)
        ]
    return row


def _variables(values: Scalar) -> list[Scalar]:
    return [ufl.variable(values[i]) for i in range(len(values))]


def _named(names: Iterable[str], values: Scalar) -> dict[str, Scalar]:
    return {name: values[i] for i, name in enumerate(names)}


def _virgin(kind: str, places: Sequence[int]) -> list[float]:
    return [0.0] if kind == "scalar" else [1.0 if place < 3 else 0.0 for place in places]


def _unpacked(branch: Branch, places: Sequence[int], values: Scalar) -> Internal:
    first, found = 0, dict[str, Scalar | Symmetric]()
    for name, kind in branch.internal.items():
        size = 1 if kind == "scalar" else len(places)
        parts = [values[first + i] for i in range(size)]
        found[name] = parts[0] if kind == "scalar" else unpacked(parts, places)
        first += size
    return found


def _components(value: Scalar | Symmetric) -> list[Scalar]:
    if isinstance(value, Symmetric):
        return [c for c in value.components if not isinstance(c, int)]
    return [value]


# -- kinematics ------------------------------------------------------------------------------------------------------


def strains(name: str, setting: Setting) -> PointFunction:
    """Strain variables and pressure, of the gradients and the pressure after them."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        g = given["gradients"]
        return [*_strains(setting, g), g[len(setting.gradients)]]

    return PointFunction(("strains", name), {"gradients": len(setting.gradients) + 1}, make)


def strain_rates(name: str, setting: Setting) -> PointFunction:
    """Their derivative along a change of the gradients."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        g, n = given["gradients"], len(setting.gradients)
        vector = ufl.as_vector([*_strains(setting, g), g[n]])
        change = ufl.derivative(vector, g, given["change"])
        return [change[i] for i in range(len(vector))]

    n = len(setting.gradients) + 1
    return PointFunction(("strain rates", name), {"gradients": n, "change": n}, make)


def forces(name: str, setting: Setting) -> PointFunction:
    """P_k = sum_a S_a y_a,k of an answer's slopes S, and the pressure's own slope after them."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        g, S = given["gradients"], given["answer"]
        slopes = _by_gradients(setting, g)
        own = [sum((S[1 + a] * row[k] for a, row in enumerate(slopes)), 0) for k in range(len(slopes[0]))]
        return [*own, S[1 + len(slopes)]]

    n = len(setting.names) + 1
    blocks = {"gradients": len(setting.gradients) + 1, "answer": length(n, moduli=False)}
    return PointFunction(("forces", name), blocks, make)


def moduli(name: str, setting: Setting) -> PointFunction:
    """A_kl = sum_ab D_ab y_a,k y_b,l + sum_a S_a y_a,kl, l >= k, of an answer's S and D; the pressure last."""

    def make(given: Mapping[str, Scalar]) -> list[Scalar]:
        g, answer = given["gradients"], given["answer"]
        ny, ng = len(setting.names), len(setting.gradients)
        pairs = combinations_with_replacement(range(ny + 1), 2)
        D = {pair: answer[2 + ny + i] for i, pair in enumerate(pairs)}
        marked = [ufl.variable(g[k]) for k in range(ng)]
        y = setting.strain(setting.deformation(marked))
        first = [[ufl.diff(component, k) for k in marked] for component in y]
        turned = [
            [sum((D[min(a, b), max(a, b)] * first[b][k] for b in range(ny)), 0) for k in range(ng)]
            for a in range(ny)
        ]
        row = []
        for k in range(ng):
            for m in range(k, ng):
                own = sum((first[a][k] * turned[a][m] for a in range(ny)), 0)
                bent = sum((answer[1 + a] * ufl.diff(first[a][k], marked[m]) for a in range(ny)), 0)
                row.append(own + bent)
            row.append(sum((first[a][k] * D[a, ny] for a in range(ny)), 0))
        return [*row, D[ny, ny]]

    n = len(setting.names) + 1
    blocks = {"gradients": len(setting.gradients) + 1, "answer": length(n, moduli=True)}
    return PointFunction(("moduli", name), blocks, make)


def _strains(setting: Setting, g: Scalar) -> tuple[Scalar, ...]:
    return setting.strain(setting.deformation([g[k] for k in range(len(setting.gradients))]))


def _by_gradients(setting: Setting, g: Scalar) -> list[list[Scalar]]:
    marked = [ufl.variable(g[k]) for k in range(len(setting.gradients))]
    return [
        [ufl.diff(component, k) for k in marked] for component in setting.strain(setting.deformation(marked))
    ]
