"""Compressibility: rubber changes its volume under pressure, which matters where it is confined.

The volumetric energy is kappa/2 (J - 1)^2 with 1/kappa = 1/kappa_case + compliance. Filled rubber has a bulk modulus of
50 to 200 times its shear modulus, unfilled rubber of 1000 to 10000 times. A long bushing loaded radially is confined
and loses stiffness; axial shear and torsion hardly change. The amplitude is the compliance.

References
----------
Gent and Lindley (1959), The compression of bonded rubber blocks, Proc. Inst. Mech. Eng. 173:111-122,
doi:10.1243/PIME_PROC_1959_173_022_02.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.exported import CardPart
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature


def feature() -> Feature:
    """Return the compliance that is added."""
    from cases.feature import Feature

    return Feature(compliance=lambda values: values["compliance"])


def card(values: Mapping[str, float]) -> CardPart:
    """Return what is added to 1 / bulk modulus."""
    return CardPart(compliance=values["compliance"])


EFFECT = Effect(
    name="compressibility",
    title="Compressibility of the rubber",
    summary="The rubber changes its volume under pressure: directions in which it is confined become softer.",
    acts="rubber",
    parameters=(
        Amplitude(
            "compliance",
            "1/MPa",
            "1 / bulk modulus, added to the case's",
            (5e-4, 0.0, 0.1),
            reciprocal=("bulk_modulus", "MPa"),
            adds_to="bulk_modulus",
            prior=Prior(
                "log_uniform",
                1e-4,
                0.02,
                of="1/shear",
                source="bulk over shear modulus of 1,000 to 10,000 for unfilled and 50 to 200 for filled rubber: "
                "Abaqus Analysis User's Guide, Hyperelastic behavior of rubberlike materials",
            ),
        ),
    ),
    how_often="occasional",
    families=("stiffness that differs between the channels",),
    in_force_law="curve",
    on_card=card,
    needs="a radial channel and an axial or torsional one",
    rivals=("debonding", "gain", "rig_compliance", "sleeve_compliance"),
    source="Gent and Lindley (1959), Compression of bonded rubber blocks, doi:10.1243/PIME_PROC_1959_173_022_02",
    specimens=frozenset({"bushing", "coupon"}),
    feature=feature,
    shown=("radial", {"compliance": 0.01}),
)
