"""Compliance of the rig in rotation: the angle that is recorded is shared between the bushing and its clamping.

A torsional spring in series: shaft, adapter and grips turn with the moment, so that the bushing's angle q solves
q + compliance M(q) = q_rig. It belongs to the rig of one rotational mode, as another mode has other grips; that of the
modes that are translations is `rig_compliance`. The amplitude is 1 / stiffness.

References
----------
Oliver and Pharr (1992), An improved technique for determining hardness and elastic modulus, J. Mater. Res.
7:1564-1583, doi:10.1557/JMR.1992.1564: the compliance of the load frame in series with that of the specimen.
"""

import math

from bushcli.effects.change import Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior
from cases.mode import modes


def spring(moment: Signal, parameters: Given) -> Signal:
    """Return the angle by which the rig turns (n,), rad."""
    return parameters["compliance"] * moment


EFFECT = Effect(
    name="rig_twist",
    title="Compliance of the rig in rotation",
    summary="Shaft, adapter and grips turn with the moment: a torsional spring in series with the bushing.",
    acts="rig",
    parameters=(
        Amplitude(
            "compliance",
            "rad/(N mm)",
            "1 / stiffness of shaft, adapter and grips",
            (1e-7, 0.0, 1e-3),
            of_channel=True,
            reciprocal=("stiffness", "N mm/rad"),
            prior=Prior(
                "half_t",
                0.2,
                of="compliance",
                source="engineering judgement: half of all rigs are more than ten times as stiff as the specimen",
            ),
        ),
    ),
    how_often="occasional",
    families=("stiffness that differs between the channels",),
    needs="a channel of the same rubber in another mode, or a torque that stiffens strongly",
    rivals=("debonding", "gain", "sleeve_compliance"),
    source="Oliver and Pharr (1992), Improved technique for hardness and modulus, doi:10.1557/JMR.1992.1564",
    modes=frozenset(mode.name for mode in modes().values() if mode.specimen == "bushing" and mode.rotational),
    rig=RigChange(spring=spring),
    shown=("torsional", {"compliance": math.radians(2e-4)}),
)
