"""Rig compliance: the displacement that is recorded is shared between the bushing and the rig.

A spring in series: the bushing's displacement q solves q + compliance F(q) = q_rig, with F the whole force that the rig
carries. The error is worst in the stiffest channel. The spring acts on the modes that are translations, with one
compliance for all of them; ``channels`` selects those of one rig. The amplitude is 1 / stiffness.

References
----------
Oliver and Pharr (1992), An improved technique for determining hardness and elastic modulus, J. Mater. Res.
7:1564-1583, doi:10.1557/JMR.1992.1564: the compliance of the load frame in series with that of the specimen.
"""

from bushcli.effects.change import RigChange
from bushcli.effects.effect import Effect, EffectParameter
from bushcli.effects.prior import Prior
from cases.mode import modes

EFFECT = Effect(
    name="rig_compliance",
    title="Compliance of the rig",
    summary="The rig deforms too: a spring in series with the bushing.",
    acts="rig",
    parameters=(
        EffectParameter(
            "compliance",
            "mm/N",
            "1 / stiffness of rig and clamping",
            2e-5,
            0.0,
            0.1,
            off=0.0,
            reciprocal=("stiffness", "N/mm"),
            prior=Prior(
                "half_t",
                0.05,
                of="compliance",
                source="engineering judgement: rigs are chosen an order of magnitude stiffer than the "
                "stiffest specimen",
            ),
        ),
    ),
    needs="two channels of different stiffness, or one that stiffens strongly",
    rivals=("compressibility", "sleeve_compliance"),
    source="Oliver and Pharr (1992), Improved technique for hardness and modulus, doi:10.1557/JMR.1992.1564",
    modes=frozenset(
        mode.name
        for mode in modes().values()
        if mode.specimen == "bushing" and not mode.rotational and mode.follow is None
    ),
    rig=RigChange(spring="compliance"),
)
