"""Debonding: part of the bond to the inner sleeve is free, from one end on.

Over ``length`` from the end at the largest z the rubber no longer follows the inner sleeve. The bond is softer, and
local strain rises at its new end. Amplitude the free length, along which the model is continuous.

References
----------
Energy release rates of cracks near bonds of rubber to metal: Rubber Chem. Technol. (2023), doi:10.5254/rct-23.611182.
"""

from bushcli.effect import Effect, EffectParameter

EFFECT = Effect(
    name="debonding",
    summary="Part of the bond between rubber and inner sleeve is free, from one end on.",
    acts="assembly",
    parameters=(EffectParameter("length", "mm", "of the free bond", 1.0, 0.0, 1000.0, off=0.0),),
    needs="two channels: it softens torsion as its share of the length, radial more",
    rivals=("batch_stiffness",),
    source="Stress concentrations at bonds of rubber to metal (2023), doi:10.5254/rct-23.611182",
)
