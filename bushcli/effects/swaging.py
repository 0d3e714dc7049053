"""Swaging: the outer sleeve is drawn in before the test, which leaves the rubber compressed.

In an extra step before the program the bond on the outer sleeve moves inwards by ``reduction`` everywhere. Radial
stiffness rises, axial stiffness mildly, torsional stiffness little. Amplitude the reduction of the radius.

References
----------
Hill (1975), The effect of precompression on the load-deflection relations of long rubber bush mountings, J. Appl.
Polym. Sci. 19; Hill (1977), Load-deflection relations of long cylindrical rubber bush mountings constructed from
rectangular blocks, J. Appl. Polym. Sci. 21, doi:10.1002/app.1977.070210602.
"""

from bushcli.effect import Effect, EffectParameter

EFFECT = Effect(
    name="swaging",
    summary="The outer sleeve was drawn in before the test and leaves the rubber compressed.",
    acts="assembly",
    parameters=(
        EffectParameter(
            "reduction", "mm", "by which the outer sleeve's radius shrank", 0.2, 0.0, 10.0, off=0.0
        ),
    ),
    needs="a radial channel beside an axial or a torsional one",
    rivals=("cure_shrinkage",),
    source="Hill (1977), Load-deflection relations of long cylindrical rubber bushes, doi:10.1002/app.1977.070210602",
)
