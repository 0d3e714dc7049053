"""Friction inside filled rubber: a rate-independent branch beside the law.

An elastic-plastic branch of modulus g times the law's initial shear modulus follows the deformation until it slips at
the strain ``slip``; after a reversal it is stiff again until it slips the other way. In one dimension, with s the
stress of the branch over the law's modulus and e the strain: s' = g e' while |s| < g slip, else s stays at its bound.
The loop is the same at every rate; its area per cycle is 4 g slip (e_max - slip) times the modulus. Amplitude g.

References
----------
Garcia Tarrago, Kari, Vinolas and Gil-Negrete (2007), Torsion stiffness of a rubber bushing: a simple engineering
design formula including the amplitude dependence, J. Strain Anal. Eng. Des. 42:13-21, doi:10.1243/03093247JSA246.
"""

from bushcli.effect import Effect, EffectParameter

EFFECT = Effect(
    name="friction",
    summary="Filled rubber slips inside: the same loop at every rate, stiff just after each reversal.",
    acts="rubber",
    parameters=(
        EffectParameter("g", "1", "modulus of the branch over the law's", 0.2, 0.0, 10.0, off=0.0),
        EffectParameter(
            "slip", "1", "strain at which it slips", 0.05, 1e-4, 1.0, scan=(0.01, 0.03, 0.1, 0.3)
        ),
    ),
    needs="reversals at two amplitudes; a second rate or a hold tells it from viscoelasticity",
    rivals=("mullins", "viscoelasticity"),
    source="Garcia Tarrago et al. (2007), Torsion stiffness of a rubber bushing, doi:10.1243/03093247JSA246",
    specimens=frozenset({"bushing", "coupon"}),
)
