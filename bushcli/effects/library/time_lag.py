"""Time lag: the force is logged late against the displacement.

The force logged at time t is that of t - lag. Loading and unloading are then apart by lag times the rate of the force:
a false loop whose width is proportional to the rate, and which vanishes in a hold after the lag. The amplitude is the
lag. With a late force (lag > 0) the bushing seems to give energy in each cycle, which no rubber does, and a part of its
loss is hidden; with a late displacement (lag < 0) it seems to lose energy as a viscoelastic rubber does.

References
----------
Lakes (2004), Viscoelastic measurement techniques, Rev. Sci. Instrum. 75:797-810, doi:10.1063/1.1651639.
"""

import math

from bushcli.effects.change import RigChange
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior

EFFECT = Effect(
    name="time_lag",
    title="Time lag between the signals",
    summary="The force is logged later than the displacement: a false loop whose width grows with the rate.",
    acts="rig",
    parameters=(
        # A logger that reads its channels in turn is late by as much as a sample.
        Amplitude(
            "lag",
            "s",
            "of the force behind the displacement",
            (0.05, -100.0, 100.0),
            # 7 degrees at the highest frequency.
            in_tables=(0.02, -math.inf),
            prior=Prior(
                "t",
                2.0,
                of="interval",
                source="engineering judgement: a logger that reads its channels in turn delays them by up "
                "to a sample, a filter on one channel by a few",
            ),
        ),
    ),
    how_often="occasional",
    # Judgement: at 200 Hz a delay of 0.1 ms is 7 degrees, which many tables have not been corrected for.
    how_often_in_tables="usual",
    families=("dissipation",),
    needs="time, and two rates or a hold",
    rivals=("viscoelasticity",),
    source="Lakes (2004), Viscoelastic measurement techniques, doi:10.1063/1.1651639",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    needs_time=True,
    may_be_shared=True,
    rig=RigChange(clock="lag"),
    shown=("axial", {"lag": 1.0}),
)
