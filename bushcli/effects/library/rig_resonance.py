"""Resonance of the rig: its frame or actuator vibrates with the specimen, and the stiffness seems to grow.

In a table of dynamic stiffness K* is multiplied by 1 / (1 - (period / T)^2), where T is the period of the vibration and
`period` that of the rig's resonance: below the resonance storage and loss grow alike, and the loss angle stays; above
it the sign is turned. Damping of the rig is left out: next to the resonance the factor is not to be trusted. The
amplitude is the period, the reciprocal of the frequency that is given. Curves of displacement and force are recorded
slowly, and are not changed.

References
----------
Lakes (2004), Viscoelastic measurement techniques, Rev. Sci. Instrum. 75:797-810, doi:10.1063/1.1651639.
"""

import numpy as np

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior


def vibrate(omega: Array, parameters: Given) -> tuple[Signal, Signal]:
    """Return the factor of K* (n,), and what is added to it, nothing."""
    period, cycles = parameters["period"], omega / (2.0 * np.pi)
    factor = np.asarray(1.0 / (1.0 - (cycles * period.value) ** 2), dtype=np.float64)
    slope = (2.0 * cycles**2 * period.value * factor**2)[:, None] * period.slope
    return Signal(factor, slope), Signal(np.zeros(len(omega)), np.zeros_like(slope))


EFFECT = Effect(
    name="rig_resonance",
    title="Resonance of the rig",
    summary="The frame vibrates with the specimen: the stiffness grows towards the rig's resonance.",
    acts="rig",
    parameters=(
        Amplitude(
            "period",
            "s",
            "1 / frequency of the resonance",
            (1e-3, 0.0, 1.0),
            # Most tables end below the resonance.
            in_tables=(0.5, 0.0),
            reciprocal=("frequency", "Hz"),
            prior=Prior(
                "half_t",
                1e-3,
                source="engineering judgement: first resonances of servo-hydraulic rigs with a specimen are between "
                "some hundred Hz and some kHz",
            ),
        ),
    ),
    # Judgement: every rig has one, and many tables go on to where it shows.
    how_often="usual",
    families=("stiffness that depends on the frequency",),
    needs="a table of dynamic stiffness to some tenths of the resonance",
    rivals=("fixture_mass",),
    source="Lakes (2004), Viscoelastic measurement techniques, doi:10.1063/1.1651639",
    may_be_shared=True,
    kinds=frozenset({"dynamic"}),
    shown=("axial", {"period": 1 / 500}),
    rig=RigChange(vibrate=vibrate),
)
