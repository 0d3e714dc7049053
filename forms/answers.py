"""Point functions (`forms.point`) of laws, volumetric part and metal, and their derivatives by parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import ufl

from forms.kinematics import Kinematics, principal, strain_of
from forms.law import Law, Scalar
from forms.point import PointFunction, answer, by_name, variables
from forms.potential import sleeve_energy
from forms.setting import KinematicDescription
from forms.volumetric import guard_energy, mixed_energy, stabilising_energy

# Points per call: an axial march with Ogden's law of three terms takes a tenth less time, with Yeoh's a tenth more.
BATCH = 8


def law_answer(
    setting: KinematicDescription, law: Law, names: tuple[str, ...], moduli: bool
) -> PointFunction:
    """Answer of a law with these parameters; optional ones may be absent.

    Parameters
    ----------
    setting : KinematicDescription
        Kinematics, with its strain variables.
    law : Law
        The law.
    names : tuple[str, ...]
        Names of the parameters that are given, in their order.
    moduli : bool
        Whether second derivatives are included.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        y = variables(inputs["strain"])
        strain = strain_of(y[:-1])
        W = law.energy(strain, **by_name(names, inputs["parameters"]))
        return answer(W, strain.measures, y, inputs, moduli)

    return PointFunction(
        ("law", law.energy, *names, "moduli" if moduli else "stress", str(len(setting.names))),
        {"strain": len(setting.names) + 1, "parameters": len(names)},
        make,
        # Powers of stretches are computed by series, whose coefficients depend on the exponents alone.
        BATCH if law.basis == "stretches" else 1,
    )


def law_slopes(setting: KinematicDescription, law: Law, names: tuple[str, ...]) -> PointFunction:
    """Derivatives of [W, W_a] with respect to the law's parameters, one row after the other.

    Parameters
    ----------
    setting : KinematicDescription
        Kinematics, with its strain variables.
    law : Law
        The law.
    names : tuple[str, ...]
        Names of the parameters that are given, in their order.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        y = variables(inputs["strain"])
        strain = strain_of(y[:-1])
        marked = {name: ufl.variable(inputs["parameters"][i]) for i, name in enumerate(names)}
        W = law.energy(strain, **marked)
        slopes = [ufl.diff(W, variable) for variable in marked.values()]
        return [part for slope in slopes for part in answer(slope, strain.measures, y, inputs, moduli=False)]

    return PointFunction(
        ("law", law.energy, *names, "slopes", str(len(setting.names))),
        {"strain": len(setting.names) + 1, "parameters": len(names)},
        make,
    )


# Parameters of the volumetric part: compliance (1/MPa), swelling (1), initial shear modulus (MPa).
VOLUMETRIC = 3


def volumetric_answer(setting: KinematicDescription, moduli: bool) -> PointFunction:
    """Answer of the volumetric part, with the further energies of volumes that the pressures do not prescribe.

    The input ``guard`` has two numbers, each 1 at points that have such an energy and 0 at others: `stabilising_energy`
    and `guard_energy` of `forms.volumetric`.

    Parameters
    ----------
    setting : KinematicDescription
        Kinematics, with its strain variables.
    moduli : bool
        Whether second derivatives are included.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        y = variables(inputs["strain"])
        strain = strain_of(y[:-1])
        W = _volumetric_energy(strain, y[-1], list(inputs["parameters"]), inputs)
        return answer(W, (*strain.measures, y[-1]), y, inputs, moduli)

    key = ("volumetric", "moduli" if moduli else "stress", str(len(setting.names)))
    return PointFunction(key, _volumetric_blocks(setting), make)


def volumetric_slopes(setting: KinematicDescription) -> PointFunction:
    """Derivatives of [W, W_a] with respect to the parameters of `volumetric_answer`.

    Parameters
    ----------
    setting : KinematicDescription
        Kinematics, with its strain variables.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        y = variables(inputs["strain"])
        strain = strain_of(y[:-1])
        marked = [ufl.variable(value) for value in inputs["parameters"]]
        slopes = [ufl.diff(_volumetric_energy(strain, y[-1], marked, inputs), value) for value in marked]
        measures = (*strain.measures, y[-1])
        return [part for slope in slopes for part in answer(slope, measures, y, inputs, moduli=False)]

    return PointFunction(("volumetric", "slopes", str(len(setting.names))), _volumetric_blocks(setting), make)


def _volumetric_blocks(setting: KinematicDescription) -> dict[str, int]:
    return {"strain": len(setting.names) + 1, "parameters": VOLUMETRIC, "guard": 2}


def _volumetric_energy(
    strain: Kinematics, p: Scalar, parameters: Sequence[Scalar], inputs: Mapping[str, Scalar]
) -> Scalar:
    compliance, swelling, shear_modulus = parameters
    J = strain.J / swelling
    stabilising = stabilising_energy(J, p, strain.I1, compliance, shear_modulus)
    folding = guard_energy(J, shear_modulus)
    return mixed_energy(J, p, compliance) + inputs["guard"][0] * stabilising + inputs["guard"][1] * folding


def work_slopes(function: PointFunction, rows: int) -> PointFunction:
    """Derivatives of the work W_a dy_a on a change dy of the strain variables, by the parameters of a function.

    Parameters
    ----------
    function
        Rows [W, W_a] of derivatives by parameters, such as `law_slopes`.
    rows
        Number of rows.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        parts, change = function.make(inputs), inputs["change"]
        width = len(parts) // rows
        return [
            sum((parts[i * width + 1 + a] * change[a] for a in range(width - 1)), ufl.as_ufl(0))
            for i in range(rows)
        ]

    blocks = dict(function.blocks) | {"change": function.blocks["strain"]}
    return PointFunction(("work", *function.key), blocks, make)


def metal_answer(setting: KinematicDescription) -> PointFunction:
    """Answer of a metal sleeve; parameters shear and bulk modulus (MPa), in both of which it is linear."""

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        y = variables(inputs["strain"])
        strain = strain_of(y[:-1])
        return answer(sleeve_energy(strain, *inputs["parameters"]), strain.measures, y, inputs, moduli=True)

    return PointFunction(
        ("metal", str(len(setting.names))), {"strain": len(setting.names) + 1, "parameters": 2}, make
    )


def resting_answer(setting: KinematicDescription) -> PointFunction:
    """Answer of a Maxwell branch's spring of unit modulus (MPa) that is at rest at the strains ``rest``.

    The energy is 1/2 (tr(C' Ci^-1) - 3), Ci the isochoric C' of ``rest``. Where both strains are the same, its slopes
    vanish, and its second derivative along a displacement v is 2 dev eps : dev eps, eps = sym(grad v F^-1).
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        y, rest = variables(inputs["strain"]), strain_of(variables(inputs["rest"])[:-1])
        strain = strain_of(y[:-1])
        assert strain.metric is not None
        assert rest.metric is not None
        stretch = ufl.variable(rest.metric.adjugate().dot(strain.metric))
        # The isochoric C is J^(-2/3) C, and its inverse is its adjugate.
        volumes = ufl.exp(-2 / 3 * ufl.ln(strain.J) - 4 / 3 * ufl.ln(rest.J))
        W = (volumes * stretch - 3) / 2
        return answer(W, (*strain.volume_measures, stretch), y, inputs, moduli=True)

    n = len(setting.names) + 1
    return PointFunction(("at rest", "moduli", str(len(setting.names))), {"strain": n, "rest": n}, make)


def principal_moduli(law: Law, names: tuple[str, ...]) -> PointFunction:
    """[W_1, W_2, W_11, W_12, W_22] by the principal log strains e1 and e2 at constant volume, MPa.

    Parameters
    ----------
    law : Law
    names : tuple of str
        Those of its parameters that are given.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        state = principal(inputs["strain"][0], inputs["strain"][1])
        e1, e2 = state.measures
        W = law.energy(state, **by_name(names, inputs["parameters"]))
        W1, W2 = ufl.diff(W, e1), ufl.diff(W, e2)
        return [W1, W2, ufl.diff(W1, e1), ufl.diff(W1, e2), ufl.diff(W2, e2)]

    return PointFunction(
        ("law", law.energy, *names, "principal"), {"strain": 2, "parameters": len(names)}, make
    )
