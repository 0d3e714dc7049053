"""Swaging: the outer sleeve is drawn in before the test, which leaves the rubber compressed.

In an extra step before the program the outer sleeve moves inwards by ``reduction`` everywhere; an elastic one is free
of stress afterwards, since swaging bends it for good. Radial stiffness rises; axial and torsional stiffness fall, as
rubber is squeezed out at the ends: the axial one by 9 % at a reduction of a twentieth of the thickness, by a quarter
at a ninth, where the model ends. Far from the ends the reduction does not affect axial shear (the deformation of
Klingbeil and Shield, with which Hill solves the problem, leaves the axial stiffness as it is); the bond is held along
the axis here, while a real sleeve grows longer as it shrinks, so that the loss is an upper bound. The amplitude is
the reduction of the radius. With ``slope`` the sleeve was drawn in to a cone, as by a die from one end: the reduction
grows by it along the axis, from z = 0, where the case has the bushing's centre, and the rubber at rest pushes the outer
sleeve towards its wide end.

References
----------
Hill (1975), The effect of precompression on the load-deflection relations of long rubber bush mountings, J. Appl.
Polym. Sci. 19; Hill (1977), Load-deflection relations of long cylindrical rubber bush mountings constructed from
rectangular blocks, J. Appl. Polym. Sci. 21, doi:10.1002/app.1977.070210602.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature

Array = NDArray[np.float64]


def _inwards(x: Array, kinematics: str) -> Array:
    """Return the displacement of the outer sleeve per unit of the reduction: radial, inwards."""
    if kinematics == "cartesian":
        u = np.zeros((3, x.shape[1]))
        u[:2] = -x[:2] / np.maximum(np.hypot(x[0], x[1]), 1e-12)
        return u
    u = np.zeros((2 if kinematics == "axisymmetric" else 3, x.shape[1]))
    u[0] = -1.0
    return u


def _to_a_cone(x: Array, kinematics: str) -> Array:
    """Return the same per unit of the slope, which changes the reduction with the axial coordinate."""
    return _inwards(x, kinematics) * x[-1]


def feature() -> Feature:
    """Return the motion of the outer sleeve before the test."""
    from cases.feature import Feature

    return Feature(
        reductions={"reduction": _inwards, "slope": _to_a_cone},
        reduced="outer",
        breaks_with=(("slope", frozenset({"z"})),),
        assembled=True,
    )


EFFECT = Effect(
    name="swaging",
    title="Swaging of the outer sleeve",
    summary="The outer sleeve was drawn in before the test and leaves the rubber compressed.",
    acts="assembly",
    parameters=(
        Amplitude(
            "reduction",
            "mm",
            "reduction of the outer sleeve's radius",
            (0.2, 0.0, 10.0),
            # At a ninth two formulations on six meshes agree within 4 % (tests/verification/test_assembly.py).
            # Beyond an eighth the rubber folds at the bond's edges: FElupe's fine meshes find no equilibrium from
            # 0.12 to 0.16 on, its coarse ones a stiffness that falls below zero and depends on the mesh.
            within=("thickness", 0.12),
            prior=Prior(
                "half_t",
                0.03,
                of="thickness",
                source="engineering judgement: reductions are commonly 2 to 5 % of the rubber's wall, enough "
                "to undo the tension of cooling",
            ),
        ),
        Amplitude(
            "slope",
            "1",
            "growth of the reduction along the axis, of a sleeve drawn in to a cone",
            (0.005, -1.0, 1.0),
            optional=True,
            # At the ends it changes the reduction by as much as this may be.
            within=("thickness/length", 0.24),
            prior=Prior(
                "t",
                0.01,
                source="engineering judgement: ends of a sleeve differ by some tenths of a millimetre, or by "
                "the reduction itself",
            ),
        ),
    ),
    how_often="occasional",
    families=("prestress",),
    needs="a radial channel and an axial or torsional one",
    rivals=("cure_shrinkage", "dimension", "gain"),
    source="Hill (1977), Load-deflection relations of long cylindrical rubber bushes, doi:10.1002/app.1977.070210602",
    needs_sleeves=True,
    feature=feature,
    shown=("radial", {"reduction": 0.5}),
)
