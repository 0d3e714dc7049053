"""Free play: the rig moves through a dead band about zero before the bushing does.

The bushing's displacement is q - clip(q, -half_width, half_width), with q the rig's. The amplitude is the half width.
At its off value 0 the derivative by it is minus the sign of q; at q = 0 and at the edges of the band, where there is
no derivative, that of the inside is used, which is zero.

References
----------
Nordin and Gutman (2002), Controlling mechanical systems with backlash - a survey, Automatica 38:1633-1649,
doi:10.1016/S0005-1098(02)00047-X.
"""

import numpy as np

from bushcli.effects.change import Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior


def drive(q: Signal, parameters: Given) -> Signal:
    """Return the part of the rig's displacement that lies beyond the dead band."""
    width = parameters["half_width"]
    sign = np.sign(q.value)
    edge = Signal(sign * width.value, sign[:, None] * width.slope)
    return (q - edge).where(np.abs(q.value) > width.value)


EFFECT = Effect(
    name="free_play",
    title="Free play in the rig",
    summary="A dead band about zero: the rig moves before the bushing does.",
    acts="rig",
    parameters=(
        Amplitude(
            "half_width",
            "mm",
            "of the dead band",
            (0.05, 0.0, 100.0),
            of_channel=True,
            prior=Prior(
                "half_t",
                0.02,
                of="travel",
                source="engineering judgement: clearance of pins and threads, some hundredths of a millimetre",
            ),
        ),
    ),
    how_often="occasional",
    families=("zero error of the rig",),
    needs="dense samples about zero, on both sides of it",
    rivals=("offset",),
    source="Nordin and Gutman (2002), Mechanical systems with backlash, doi:10.1016/S0005-1098(02)00047-X",
    rig=RigChange(drive=drive, order=1),
    shown=("axial", {"half_width": 0.4}),
)
