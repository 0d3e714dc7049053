"""Sleeve compliance: the sleeves deform with the rubber.

Sleeves of ``thickness`` and Young's modulus 1/compliance stand where the case has rigid ones. Steel has 4.8e-6 1/MPa,
aluminium 1.4e-5, polyamide 1e-4 to 1e-3. Formulas for bushings take the sleeves as rigid, which is compliance 0.

References
----------
Adkins and Gent (1954), Load-deflexion relations of rubber bush mountings, Br. J. Appl. Phys. 5:354-358,
doi:10.1088/0508-3443/5/10/303.
"""

from bushcli.effect import Effect, EffectParameter

EFFECT = Effect(
    name="sleeve_compliance",
    summary="The sleeves are not rigid: confined rubber pushes them out of shape.",
    acts="assembly",
    parameters=(
        EffectParameter(
            "compliance",
            "1/MPa",
            "1 / Young's modulus of the sleeves",
            1.4e-5,
            0.0,
            0.01,
            off=0.0,
            reciprocal=("youngs_modulus", "MPa"),
        ),
        EffectParameter("thickness", "mm", "of the sleeves", 2.0, 0.1, 50.0, scan=(1.0, 2.0, 4.0)),
    ),
    needs="a radial channel beside an axial or a torsional one",
    rivals=("compressibility", "rig_compliance"),
    source="Adkins and Gent (1954), Load-deflexion relations of rubber bushes, doi:10.1088/0508-3443/5/10/303",
)
