"""Rig compliance: the displacement that is recorded is shared between the bushing and the rig.

A spring in series: the bushing's displacement q solves q + u(F(q)) = q_rig, with F the whole force that the rig carries
and u the spring's extension, u = compliance F g(curvature |F|). The rig is linear with curvature 0; with g(x) = 1 + x
above zero it grows softer under load, with g(x) = 1 / (1 - x) below zero stiffer, as joints that close, and u never
falls. The error is worst in the stiffest channel. The spring acts on the modes that are translations, with one
compliance for all of them; ``channels`` selects those of one rig. The amplitude is 1 / stiffness at small forces.

References
----------
Oliver and Pharr (1992), An improved technique for determining hardness and elastic modulus, J. Mater. Res.
7:1564-1583, doi:10.1557/JMR.1992.1564: the compliance of the load frame in series with that of the specimen.
"""

import numpy as np

from bushcli.effects.change import Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior
from cases.mode import modes


def spring(force: Signal, parameters: Given) -> Signal:
    """Return the extension of the rig (n,), mm."""
    if "curvature" not in parameters:
        return parameters["compliance"] * force
    sign = np.sign(force.value)
    bend = parameters["curvature"] * Signal(np.abs(force.value), sign[:, None] * force.slope)
    x = bend.value
    stiffer = 1.0 / (1.0 - np.minimum(x, 0.0))
    factor = np.where(x > 0.0, 1.0 + x, stiffer)
    rate = np.where(x > 0.0, 1.0, stiffer**2)
    return parameters["compliance"] * force * Signal(factor, rate[:, None] * bend.slope)


EFFECT = Effect(
    name="rig_compliance",
    title="Compliance of the rig",
    summary="The rig deforms too: a spring in series with the bushing.",
    acts="rig",
    parameters=(
        Amplitude(
            "compliance",
            "mm/N",
            "1 / stiffness of rig and clamping",
            (2e-5, 0.0, 0.1),
            reciprocal=("stiffness", "N/mm"),
            prior=Prior(
                "half_t",
                0.2,
                of="compliance",
                source="engineering judgement: half of all rigs are more than ten times as stiff as the "
                "stiffest specimen",
            ),
        ),
        Amplitude(
            "curvature",
            "1/N",
            "relative change of the compliance with the force: above 0 softer, below 0 stiffer under load",
            (1e-5, -1.0, 1.0),
            optional=True,
            prior=Prior(
                "t",
                0.3,
                of="1/force",
                source="engineering judgement: clamped joints close, and brackets bend, by some tenths of their "
                "stiffness over the range of a test",
            ),
        ),
    ),
    how_often="occasional",
    families=("stiffness that differs between the channels",),
    needs="two channels of different stiffness, or one that stiffens strongly",
    rivals=("compressibility", "sleeve_compliance"),
    source="Oliver and Pharr (1992), Improved technique for hardness and modulus, doi:10.1557/JMR.1992.1564",
    modes=frozenset(
        mode.name
        for mode in modes().values()
        if mode.specimen == "bushing" and not mode.rotational and mode.follow is None
    ),
    may_be_shared=True,
    rig=RigChange(spring=spring),
    shown=("radial", {"compliance": 0.00015}),
)
