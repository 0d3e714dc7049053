"""Shore A hardness and the moduli of a law.

A law's parameters in MPa are scaled by the ratio of Young's moduli at the two hardnesses; its dimensionless parameters
do not change, so that the energy is scaled as a whole. The relation is Gent's, from the indentation of a linear elastic
half-space; it is useful from about 30 to 80 Shore A, and its scatter between compounds exceeds that of a tolerance.

References
----------
Gent (1958), On the relation between indentation hardness and Young's modulus, Trans. Inst. Rubber Ind. 34:46-57;
Rubber Chem. Technol. 31:896-906, doi:10.5254/1.3542351.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from bushcli.case.case import Material
from bushcli.runtime.condition import Condition
from forms.law import laws

#: The name that takes a key's place in a study.
HARDNESS = "hardness"
#: Range of Shore A in which the relation is used.
LOWEST, HIGHEST = 20.0, 90.0
#: Shore A by which compounds of one nominal hardness differ: the usual tolerance of a hardness.
USUAL_TOLERANCE = 5.0


def youngs_modulus(shore_a: float) -> float:
    """Return Young's modulus, MPa: E = 0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S))."""
    return 0.0981 * (56.0 + 7.62336 * shore_a) / (0.137505 * (254.0 - 2.54 * shore_a))


def from_hardness(law: str, shore_a: float, bulk_modulus: float = math.inf) -> Material:
    """Return a law whose initial shear modulus is E/3 of a hardness, in the proportions of its start values."""
    model = laws()[law]
    factor = youngs_modulus(shore_a) / 3.0 / float(model.shear_modulus(**model.start))
    return Material(law, bulk_modulus, _scaled(law, model.start, factor), hardness=shore_a)


def _scaled(law: str, parameters: Mapping[str, float], factor: float) -> dict[str, float]:
    """Return a law's parameters with its moduli multiplied by a factor."""
    unit = {parameter.name: parameter.unit for parameter in laws()[law].parameters}
    return {name: value * factor if unit[name] == "MPa" else value for name, value in parameters.items()}


def known_from_hardness(material: Material) -> tuple[Condition, ...]:
    """Return the condition that the stiffness of the rubber is known from its hardness alone, if it is."""
    if material.hardness is None:
        return ()
    nominal = material.hardness
    E = youngs_modulus(nominal)
    softer, stiffer = (
        100.0 * abs(youngs_modulus(nominal + side * USUAL_TOLERANCE) / E - 1.0) for side in (-1.0, 1.0)
    )
    what = (
        f"the law's parameters follow from material.hardness = {nominal:g} Shore A alone: E = {E:.3g} MPa by Gent's "
        f"relation, the curve's shape from the law's start values; within {USUAL_TOLERANCE:g} Shore A the stiffness is "
        f"{softer:.0f} % lower to {stiffer:.0f} % higher, and compounds of one hardness scatter besides"
    )
    remedy = "identify the law from a recording (bushcli inverse) or from coupons (bushcli fit)"
    return (Condition("from_hardness", what, remedy),)


def scaled_to_hardness(material: Material, nominal: float, shore_a: float) -> Material:
    """Return a material with its moduli scaled to another hardness.

    Parameters
    ----------
    material : Material
        With its parameters at the nominal hardness.
    nominal, shore_a : float
        Shore A hardness, a number without a unit: of the given material, and of the returned one.

    Raises
    ------
    ValueError
        A hardness is outside the range of the relation.
    """
    for value in (nominal, shore_a):
        if not LOWEST <= value <= HIGHEST:
            raise ValueError(
                f"hardness {value:g} Shore A is outside {LOWEST:g} to {HIGHEST:g}, where Gent's relation holds"
            )
    factor = youngs_modulus(shore_a) / youngs_modulus(nominal)
    return replace(material, parameters=_scaled(material.law, material.parameters, factor))
