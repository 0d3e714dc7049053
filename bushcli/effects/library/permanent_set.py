"""Permanent set: the rubber's rest position follows the largest excursions.

The rubber is deformed by q - set (M+ + M-), with M+ and M- the largest positive and negative displacement of the path
so far, the present included (M+ >= 0 >= M-). On a first loading M+ = q: the virgin curve is stretched by 1 / (1 - set),
which the law's parameters absorb. Unloading from M+ ends at zero force at q = set M+; equal excursions to both sides
cancel. The excursions are those of the sleeve, after the rig's free play but before its springs are subtracted.
The amplitude is ``set``; derivatives hold as long as the same sample has the largest excursion.

References
----------
Dorfmann and Ogden (2004), A constitutive model for the Mullins effect with permanent set in particle-reinforced
rubber, Int. J. Solids Struct. 41:1855-1878, doi:10.1016/j.ijsolstr.2003.11.014.
Diani, Fayolle and Gilormini (2009), A review on the Mullins effect, Eur. Polym. J. 45:601-612,
doi:10.1016/j.eurpolymj.2008.11.017.
"""

import numpy as np

from bushcli.effects.change import Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior


def drive(q: Signal, parameters: Given) -> Signal:
    """Return q - set (M+ + M-)."""
    return q - parameters["set"] * (_running_maximum(q, 1) + _running_maximum(q, -1))


def _running_maximum(q: Signal, sign: int) -> Signal:
    """Return M+ (sign 1) or M- (sign -1) at every sample, with the derivatives of the sample that set it."""
    excursion = np.maximum(sign * q.value, 0.0)
    farthest = np.maximum.accumulate(excursion)
    news = np.where(excursion == farthest, np.arange(len(excursion)), 0)
    holder = np.maximum.accumulate(news)
    return q.at_samples(holder).where(farthest > 0.0)


EFFECT = Effect(
    name="permanent_set",
    title="Permanent set",
    summary="After unloading the bushing stays displaced by a share of its largest excursion.",
    acts="rubber",
    parameters=(
        Amplitude(
            "set",
            "1",
            "displacement that stays, over the largest excursion",
            (0.02, 0.0, 0.9),
            prior=Prior(
                "half_t",
                0.05,
                source="engineering judgement: set of some per cent after stretching in the tests reviewed "
                "by Diani, Fayolle and Gilormini (2009), doi:10.1016/j.eurpolymj.2008.11.017",
            ),
        ),
    ),
    how_often="occasional",
    families=("softening in use",),
    in_force_law="set",
    needs="unloading through zero force from at least two amplitudes, more to one side than to the other",
    rivals=("offset",),
    source="Dorfmann and Ogden (2004), Mullins effect with permanent set, doi:10.1016/j.ijsolstr.2003.11.014",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    rig=RigChange(drive=drive, order=2),
    shown=("axial", {"set": 0.1}),
)
