"""Gain: the force of one channel reads high or low by a factor.

The force is logged as (1 + error) times what the load cell carries. The amplitude is the error. Each channel has its
own factor: a common factor could not be distinguished from the law's moduli, unless the law is held to coupons.

References
----------
ASTM E4-21, Standard practices for force calibration and verification of testing machines, doi:10.1520/E0004-21.
ISO 7500-1:2018, Metallic materials - Calibration and verification of static uniaxial testing machines - Part 1.
"""

import numpy as np

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior


def read(force: Signal, time: Array | None, parameters: Given) -> Signal:
    """Multiply the force by 1 + error."""
    error = parameters["error"]
    return force * Signal(np.asarray(1.0 + error.value), error.slope)


EFFECT = Effect(
    name="gain",
    title="Gain error of one channel's force",
    summary="The force of one channel reads high or low by a factor.",
    acts="rig",
    parameters=(
        Amplitude(
            "error",
            "1",
            "relative error of the force",
            (0.03, -0.9, 9.0),
            of_channel=True,
            prior=Prior(
                "t",
                0.03,
                source="limits of 0.5 to 3 % of the classes of ISO 7500-1, and engineering judgement: cells that were "
                "not calibrated, wrong lever arms",
            ),
        ),
    ),
    is_factor=True,
    how_often="occasional",
    families=("stiffness that differs between the channels",),
    needs="two channels, one of them without it, or coupon tests that fix the law",
    rivals=("compressibility", "cure_shrinkage", "dimension", "swaging"),
    source="ASTM E4-21, Force calibration and verification of testing machines, doi:10.1520/E0004-21",
    specimens=frozenset({"bushing", "coupon"}),
    needs_free_channel=True,
    # The factor of the load cell acts before anything is added to its reading.
    rig=RigChange(read=read, order=-1),
    shown=("axial", {"error": 0.15}),
)
