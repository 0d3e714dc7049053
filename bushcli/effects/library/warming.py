"""Warming: the rubber heats itself in the test and becomes softer, whatever the displacement.

Every force of the rubber is multiplied by 1 - amount (1 - exp(-t / tau)), with t the time since the recording began:
the temperature rises until as much heat is lost as the cycles make, and the modulus falls with it. The amplitude is the
share of the force that is lost in the end. Heat from elsewhere is not modelled, nor is entropy elasticity, by which a
gum becomes stiffer.

References
----------
Lion (1997), A physically based method to represent the thermo-mechanical behaviour of elastomers, Acta Mech. 123:1-25,
doi:10.1007/BF01178397.
"""

import numpy as np

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior


def parallel(q: Signal, force: Signal, time: Array | None, parameters: Given) -> Signal:
    """Multiply the force by 1 - amount (1 - exp(-t / tau))."""
    if time is None:
        raise ValueError("warming needs time")
    amount, tau = parameters["amount"], parameters["tau"]
    decay = np.exp(-time / tau.value)
    rise = Signal(1.0 - decay, (-decay * time / tau.value**2)[:, None] * tau.slope)
    softening = rise * amount
    return force * Signal(1.0 - softening.value, -softening.slope)


EFFECT = Effect(
    name="warming",
    title="Warming of the rubber",
    summary="The rubber heats itself and becomes softer with time, whatever the displacement.",
    acts="rubber",
    parameters=(
        Amplitude(
            "amount",
            "1",
            "share of the force that is lost after a long time",
            (0.05, 0.0, 0.9),
            prior=Prior(
                "half_t",
                0.07,
                source="engineering judgement: filled rubber loses about 1 % of its modulus per kelvin near room "
                "temperature, and tests in the laboratory heat it by some kelvin",
            ),
        ),
        EffectParameter(
            "tau",
            "s",
            "time constant of the warming",
            (50.0, 1e-3, 1e6),
            scan=(0.1, 0.3, 1.0),
            scale="duration",
            prior=Prior(
                "log_uniform",
                0.05,
                5.0,
                of="duration",
                source="a rubber that warms much faster than the recording is warm from its beginning, one much slower "
                "drifts evenly",
            ),
        ),
    ),
    families=("softening in use",),
    in_force_law="warming",
    needs="time, and equal cycles or holds at times far apart",
    rivals=("drift", "mullins", "viscoelasticity"),
    source="Lion (1997), Thermo-mechanical behaviour of elastomers, doi:10.1007/BF01178397",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    needs_time=True,
    rig=RigChange(parallel=parallel, order=0),
    shown=("axial", {"amount": 0.3, "tau": 30.0}),
)
