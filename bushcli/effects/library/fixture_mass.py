"""Mass of the fixture: the load cell also carries the inertia of what moves between it and the bushing.

In a table of dynamic stiffness K* becomes K* - mass omega^2; in a rotational mode the mass is a moment of inertia. The
storage stiffness falls with the square of the frequency, the loss stiffness stays, and so the loss angle grows. Rigs
compensate the mass by an accelerometer or by a run without a specimen; what is left has either sign. The amplitude is
the mass. Curves of displacement and force are recorded slowly, and are not changed.

References
----------
ISO 10846-2:2008, Acoustics and vibration - Laboratory measurement of vibro-acoustic transfer properties of resilient
elements - Part 2: Direct method.
Lakes (2004), Viscoelastic measurement techniques, Rev. Sci. Instrum. 75:797-810, doi:10.1063/1.1651639.
"""

import numpy as np

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior

# N/mm per kg/s^2; N mm/rad per kg mm^2/s^2.
_PER_MM = 1e-3


def vibrate(omega: Array, parameters: Given) -> tuple[Signal, Signal]:
    """Return the factor of K* (n,), 1, and what is added to it, -mass omega^2, N/mm or N mm/rad."""
    mass, inertia = parameters["mass"], -_PER_MM * omega**2
    same = Signal(np.ones(len(omega)), np.zeros((len(omega), len(mass.slope))))
    return same, Signal(inertia * mass.value, inertia[:, None] * mass.slope)


EFFECT = Effect(
    name="fixture_mass",
    title="Mass of the fixture",
    summary="The force of a vibration contains the inertia of the fixture: the stiffness falls with frequency squared.",
    acts="rig",
    parameters=(
        Amplitude(
            "mass",
            "kg",
            "between bushing and load cell, as far as the rig does not compensate it",
            (0.1, -1e6, 1e6),
            of_channel=True,
            prior=Prior(
                "t",
                0.3,
                of="squared arm",
                source="engineering judgement: an adapter has some tenths of a kilogram to a few, and rigs "
                "compensate most of it; about an axis as if it were at the bushing's outer radius, 1 otherwise",
            ),
        ),
    ),
    # Judgement: every fixture has a mass, and many tables are not, or not quite, corrected for it.
    how_often="usual",
    families=("stiffness that depends on the frequency",),
    needs="a table of dynamic stiffness to frequencies at which it falls",
    rivals=("rig_resonance",),
    source="Lakes (2004), Viscoelastic measurement techniques, doi:10.1063/1.1651639",
    kinds=frozenset({"dynamic"}),
    shown=("axial", {"mass": 0.05}),
    rig=RigChange(vibrate=vibrate),
)
