"""Drift: the zero of the force moves with time, whatever the displacement.

The force is logged as Q + rate (1 - exp(-settling t)) / settling, with t the time since the recording began; without
settling that is Q + rate t. A bridge that warms up after it was switched on, or a cell beside a warm specimen, drifts
like this: first evenly, then, in a long recording, less and less, as its temperature settles. The amplitude is the rate
at the beginning.

References
----------
Stefanescu (2011), Handbook of Force Transducers, Springer, doi:10.1007/978-3-642-18296-9.
"""

import numpy as np

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior

# Below this, three terms of the series are exact to 1e-13.
SERIES = 1e-4


def read(force: Signal, time: Array | None, parameters: Given) -> Signal:
    """Add the drift since the recording began to the force."""
    if time is None:
        raise ValueError("a drift needs time")
    if "settling" not in parameters:
        return force + parameters["rate"] * Signal(time, np.zeros((len(time), force.slope.shape[1])))
    settling = parameters["settling"]
    # (1 - exp(-x)) / x and its derivative, both without cancellation where x is small.
    x = float(settling.value) * time
    small = np.abs(x) < SERIES
    safe = np.where(small, 1.0, x)
    share = np.where(small, 1.0 - x / 2.0 + x**2 / 6.0, -np.expm1(-x) / safe)
    slope = np.where(small, -0.5 + x / 3.0 - x**2 / 8.0, (np.exp(-x) - share) / safe)
    elapsed = Signal(time * share, (time**2 * slope)[:, None] * settling.slope)
    return force + parameters["rate"] * elapsed


EFFECT = Effect(
    name="drift",
    title="Zero drift of the force",
    summary="The zero of the force moves with time, whatever the displacement.",
    acts="rig",
    parameters=(
        Amplitude(
            "rate",
            "N/s",
            "rate at which the zero moves",
            (0.1, -1e7, 1e7),
            of_channel=True,
            prior=Prior(
                "t",
                0.01,
                of="force/duration",
                source="engineering judgement: over a recording a zero drifts by about as much as its initial error",
            ),
        ),
        Amplitude(
            "settling",
            "1/s",
            "1 / time constant with which the drift comes to rest; 0 for an even drift",
            (1e-3, 0.0, 1e6),
            optional=True,
            prior=Prior(
                "half_t",
                2.0,
                of="1/duration",
                source="engineering judgement: electronics and specimens settle thermally in minutes to an hour, as "
                "long as many recordings take",
            ),
        ),
    ),
    families=("softening in use", "zero error of the rig"),
    needs="time, and equal cycles or returns to zero at times far apart",
    rivals=("offset", "viscoelasticity", "warming"),
    source="Stefanescu (2011), Handbook of Force Transducers, doi:10.1007/978-3-642-18296-9",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    needs_time=True,
    rig=RigChange(read=read, order=1),
    shown=("axial", {"rate": 2.0}),
)
