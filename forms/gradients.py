"""From gradients to strains, and from stresses and moduli (`forms.point`) back to forces and stiffness by gradients."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations_with_replacement

import ufl

from forms.law import Scalar
from forms.point import PointFunction, length
from forms.setting import KinematicDescription


def strains(name: str, setting: KinematicDescription) -> PointFunction:
    """Strain variables and pressure, from the gradients followed by the pressure.

    Parameters
    ----------
    name : str
        Name of the kinematics in `SETTINGS`.
    setting : KinematicDescription
        Kinematics, with its strain variables.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        g = inputs["gradients"]
        return [*_strains(setting, g), g[len(setting.gradients)]]

    return PointFunction(("strains", name), {"gradients": len(setting.gradients) + 1}, make)


def strain_rates(name: str, setting: KinematicDescription) -> PointFunction:
    """Derivative of `strains` along a change of the gradients.

    Parameters
    ----------
    name : str
        Name of the kinematics in `SETTINGS`.
    setting : KinematicDescription
        Kinematics, with its strain variables.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        g, n = inputs["gradients"], len(setting.gradients)
        vector = ufl.as_vector([*_strains(setting, g), g[n]])
        change = ufl.derivative(vector, g, inputs["change"])
        return [change[i] for i in range(len(vector))]

    n = len(setting.gradients) + 1
    return PointFunction(("strain rates", name), {"gradients": n, "change": n}, make)


def forces(name: str, setting: KinematicDescription) -> PointFunction:
    """P_k = sum_a S_a y_a,k from an answer's slopes S, followed by the slope by the pressure.

    Parameters
    ----------
    name : str
        Name of the kinematics in `SETTINGS`.
    setting : KinematicDescription
        Kinematics, with its strain variables.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        g, S = inputs["gradients"], inputs["answer"]
        slopes = _by_gradients(setting, g)
        forces = [sum((S[1 + a] * row[k] for a, row in enumerate(slopes)), 0) for k in range(len(slopes[0]))]
        return [*forces, S[1 + len(slopes)]]

    n = len(setting.names) + 1
    blocks = {"gradients": len(setting.gradients) + 1, "answer": length(n, moduli=False)}
    return PointFunction(("forces", name), blocks, make)


def moduli(name: str, setting: KinematicDescription) -> PointFunction:
    """A_kl = sum_ab D_ab y_a,k y_b,l + sum_a S_a y_a,kl, l >= k, from an answer's S and D; the pressure last.

    Parameters
    ----------
    name : str
        Name of the kinematics in `SETTINGS`.
    setting : KinematicDescription
        Kinematics, with its strain variables.
    """

    def make(inputs: Mapping[str, Scalar]) -> list[Scalar]:
        g, answer = inputs["gradients"], inputs["answer"]
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
                material = sum((first[a][k] * turned[a][m] for a in range(ny)), 0)
                bent = sum((answer[1 + a] * ufl.diff(first[a][k], marked[m]) for a in range(ny)), 0)
                row.append(material + bent)
            row.append(sum((first[a][k] * D[a, ny] for a in range(ny)), 0))
        return [*row, D[ny, ny]]

    n = len(setting.names) + 1
    blocks = {"gradients": len(setting.gradients) + 1, "answer": length(n, moduli=True)}
    return PointFunction(("moduli", name), blocks, make)


def _strains(setting: KinematicDescription, g: Scalar) -> tuple[Scalar, ...]:
    return setting.strain(setting.deformation([g[k] for k in range(len(setting.gradients))]))


def _by_gradients(setting: KinematicDescription, g: Scalar) -> list[list[Scalar]]:
    marked = [ufl.variable(g[k]) for k in range(len(setting.gradients))]
    return [
        [ufl.diff(component, k) for k in marked] for component in setting.strain(setting.deformation(marked))
    ]
