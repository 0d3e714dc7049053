"""Batch: the bushing's rubber is stiffer or softer than that of the coupons which the law was fitted to.

Every force of the bushing is multiplied by exp(log_factor). With a law that is identified from the bushing itself the
factor cannot be distinguished from the law's moduli; it has a meaning where the law is held to its coupons. The
amplitude is the logarithm, for which twice as stiff and half as stiff are equally far from 0.

References
----------
Robertson and Hardman (2021), Nature of carbon black reinforcement of rubber, Polymers 13:538,
doi:10.3390/polym13040538: the modulus of one recipe depends on mixing and dispersion.
"""

import math
from collections.abc import Mapping

import numpy as np

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.exported import CardPart
from bushcli.effects.prior import Prior


def parallel(q: Signal, force: Signal, time: Array | None, parameters: Given) -> Signal:
    """Multiply the force by exp(log_factor)."""
    factor = np.exp(parameters["log_factor"].value)
    return force * Signal(factor, factor * parameters["log_factor"].slope)


def card(values: Mapping[str, float]) -> CardPart:
    """Return the factor on the energy."""
    return CardPart(factor=math.exp(values["log_factor"]))


EFFECT = Effect(
    name="batch_stiffness",
    title="Another batch of rubber",
    summary="The bushing is from another batch than the coupons: one factor scales all its curves.",
    acts="rubber",
    parameters=(
        Amplitude(
            "log_factor",
            "1",
            "natural logarithm of the factor on the force",
            (0.1, -3.0, 3.0),
            exponential="factor",
            prior=Prior(
                "t",
                0.25,
                source="the usual tolerance of 5 IRHD changes the shear modulus by a quarter (0.64, 0.81, 1.06 MPa "
                "at 50, 55, 60 IRHD: Lindley, Engineering design with natural rubber, MRPRA)",
            ),
        ),
    ),
    is_factor=True,
    how_often="usual",
    in_force_law="curve",
    on_card=card,
    needs="coupon tests that fix the law",
    rivals=("debonding", "dimension"),
    needs_fixed_law=True,
    source="Robertson and Hardman (2021), Nature of carbon black reinforcement, doi:10.3390/polym13040538",
    rig=RigChange(parallel=parallel, order=0),
    shown=("axial", {"log_factor": -0.3}),
)
