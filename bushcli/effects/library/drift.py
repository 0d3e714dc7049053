"""Drift: the zero of the force moves with time, whatever the displacement.

The force is logged as Q + rate t, with t the time since the recording began. The amplitude is the rate. A bridge that
warms up after it was switched on, or a cell beside a warm specimen, drifts roughly like this.

References
----------
Stefanescu (2011), Handbook of Force Transducers, Springer, doi:10.1007/978-3-642-18296-9.
"""

import numpy as np

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Effect, EffectParameter
from bushcli.effects.prior import Prior


def read(force: Signal, time: Array | None, given: Given) -> Signal:
    """Add rate times time to the force.

    Parameters
    ----------
    force : Signal
        Force that the rig carries (n,), N or N mm.
    time : (n,) array or None
        Seconds since the recording began.
    given : Given
        Value of `rate` (N/s or N mm/s) with its derivatives.
    """
    if time is None:
        raise ValueError("a drift needs time")
    return force + given["rate"] * Signal(time, np.zeros((len(time), given["rate"].slope.shape[-1])))


EFFECT = Effect(
    name="drift",
    title="Drift of the force's zero",
    summary="The zero of the force moves evenly with time, whatever the displacement.",
    acts="rig",
    parameters=(
        EffectParameter(
            "rate",
            "N/s",
            "by which the zero moves",
            0.1,
            -1e7,
            1e7,
            off=0.0,
            of_channel=True,
            prior=Prior(
                "t",
                0.01,
                of="force/duration",
                source="engineering judgement: over a recording a zero drifts by as much as it is off at the beginning",
            ),
        ),
    ),
    needs="time, and equal cycles or returns to zero at times far apart",
    rivals=("offset", "viscoelasticity", "warming"),
    source="Stefanescu (2011), Handbook of Force Transducers, doi:10.1007/978-3-642-18296-9",
    specimens=frozenset({"bushing", "coupon"}),
    needs_time=True,
    rig=RigChange(read=read, order=1),
)
