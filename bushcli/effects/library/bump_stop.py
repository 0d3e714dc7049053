"""Bump stop: a one-sided stop beside the rubber, which engages after a gap.

With q the bushing's displacement, the force stiffness max(0, q - gap) is added if gap >= 0, and the force
stiffness min(0, q - gap) if gap < 0, a stop on the negative side. The curve has a knee at the gap. The amplitude is the
stiffness. At the knee itself the force has no derivative by the gap; that of free travel is used.

With ``onset`` the stop's stiffness rises in proportion to the travel beyond the gap until this has the length of the
onset, as a rounded or conical rubber stop is met little by little; its force is smooth there.

References
----------
Shaw and Holmes (1983), A periodically forced piecewise linear oscillator, J. Sound Vib. 90:129-155,
doi:10.1016/0022-460X(83)90407-8.
"""

import numpy as np

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior


def parallel(q: Signal, force: Signal, time: Array | None, parameters: Given) -> Signal:
    """Add the force of the stop to the force of the bushing."""
    over = q - parameters["gap"]
    side = 1.0 if parameters["gap"].value >= 0.0 else -1.0
    engaged = side * over.value > 0.0
    if "onset" not in parameters:
        return force + parameters["stiffness"] * over.where(engaged)
    onset, travel = parameters["onset"], side * over.value
    half = Signal(np.asarray(0.5 * side), np.zeros_like(onset.slope))
    inverse = Signal(np.float64(1.0) / onset.value, -onset.slope / onset.value**2)
    rising, risen = half * inverse * over * over, over - half * onset
    gradual = engaged & (travel < onset.value)
    return force + parameters["stiffness"] * (rising.where(gradual) + risen.where(engaged & ~gradual))


_GAPS = tuple(round(0.05 * i, 2) for i in range(8, 20))

EFFECT = Effect(
    name="bump_stop",
    title="Bump stop",
    summary="A one-sided stop engages after a gap: a knee in the curve.",
    acts="rig",
    parameters=(
        Amplitude(
            "stiffness",
            "N/mm",
            "of the stop",
            (100.0, 0.0, 1e10),
            of_channel=True,
            prior=Prior(
                "log_normal",
                1.0,
                1.0,
                of="stiffness",
                source="engineering judgement: a rubber stop is about as stiff as the bushing that it "
                "protects, one of metal many times as stiff",
            ),
        ),
        EffectParameter(
            "gap",
            "mm",
            "travel to the stop; negative = on the negative side",
            (1.0, -1000.0, 1000.0),
            # The law absorbs a faint stop except near the knee: between points further apart the stop would be missed.
            scan=(*(-g for g in reversed(_GAPS)), *_GAPS),
            scale="amplitude",
            of_channel=True,
            prior=Prior(
                "log_uniform",
                0.2,
                1.0,
                of="travel",
                signed=True,
                source="engineering judgement: a stop beyond the travel is not met, one near rest is part "
                "of the bushing",
            ),
        ),
        EffectParameter(
            "onset",
            "mm",
            "travel in which the stop engages fully; without it at once",
            (0.5, 1e-3, 1000.0),
            optional=True,
            variant=True,
            scan=(0.2,),
            scale="amplitude",
            of_channel=True,
            prior=Prior(
                "log_normal",
                0.15,
                0.8,
                of="travel",
                source="engineering judgement: rubber stops are rounded or conical",
            ),
        ),
    ),
    how_often="occasional",
    needs="travel to both sides of the knee",
    rivals=("misalignment",),
    source="Shaw and Holmes (1983), Periodically forced piecewise linear oscillator, doi:10.1016/0022-460X(83)90407-8",
    rig=RigChange(parallel=parallel, order=1),
    shown=("axial", {"stiffness": 400.0, "gap": 4.0}),
)
