"""Cure shrinkage: the rubber cooled between sleeves that hold it, and is left in tension.

The deformation gradient is F = (1 - shrinkage) F_e, and the energy is that of F_e: the stress-free rubber is smaller by
``shrinkage`` in all directions. For natural rubber cured at 150 degrees C some 0.02 is typical. The amplitude is the
linear shrinkage.

References
----------
Vujosevic and Lubarda (2002), Finite-strain thermoelasticity based on multiplicative decomposition of deformation
gradient, Theor. Appl. Mech. 28-29:379-399, doi:10.2298/TAM0229379V.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature


def feature() -> Feature:
    """Return the volume of the stress-free rubber."""
    from cases.feature import Feature

    return Feature(swelling=lambda values: (1 - values["shrinkage"]) ** 3, assembled=True)


EFFECT = Effect(
    name="cure_shrinkage",
    title="Cure shrinkage",
    summary="The rubber shrank between bonded sleeves when it cooled and is left in tension.",
    acts="assembly",
    parameters=(
        Amplitude(
            "shrinkage",
            "1",
            "linear strain by which free rubber would have shrunk",
            (0.01, 0.0, 0.1),
            prior=Prior(
                "half_t",
                0.015,
                source="engineering judgement: mould shrinkage of 1.5 to 3 %, reduced in part by that of metal, "
                "and more by swaging",
            ),
        ),
    ),
    how_often="occasional",
    families=("prestress",),
    needs="a radial channel and an axial or torsional one",
    rivals=("gain", "swaging"),
    source="Vujosevic and Lubarda (2002), Finite-strain thermoelasticity, doi:10.2298/TAM0229379V",
    feature=feature,
    shown=("radial", {"shrinkage": 0.02}),
)
