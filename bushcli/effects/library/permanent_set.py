"""Permanent set: the rubber's rest position follows the largest excursions.

The rubber is deformed by q - set (M+ + M-), with M+ and M- the largest positive and negative displacement of the path
so far, the present included (M+ >= 0 >= M-). On a first loading M+ = q: the virgin curve is stretched by 1 / (1 - set),
which the law's parameters absorb. Unloading from M+ ends at zero force at q = set M+; equal excursions to both sides
cancel. The excursions are those of the sleeve, after the rig's free play but before its springs are subtracted.
The amplitude is ``set``; derivatives hold as long as the same sample has the largest excursion.

With ``cycles`` the set grows as the rubber is worked. It lags behind S = set (M+ + M-) by l, which fades with the path
s: dl = dS - l ds / (2 cycles (M+ - M-)). A cycle over the whole range so far has the path 2 (M+ - M-).

References
----------
Dorfmann and Ogden (2004), A constitutive model for the Mullins effect with permanent set in particle-reinforced
rubber, Int. J. Solids Struct. 41:1855-1878, doi:10.1016/j.ijsolstr.2003.11.014.
Diani, Fayolle and Gilormini (2009), A review on the Mullins effect, Eur. Polym. J. 45:601-612,
doi:10.1016/j.eurpolymj.2008.11.017.
"""

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.change import Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior

# Imaginary part of a complex step, as in `cases.parameters`, which loads DOLFINx: so small that nothing but the first
# derivative is left in double precision.
STEP = 1e-30


def drive(q: Signal, parameters: Given) -> Signal:
    """Return q - set (M+ + M-), with ``cycles`` plus what the set lags behind."""
    up, down = _running_maximum(q, 1), _running_maximum(q, -1)
    full = parameters["set"] * (up + down)
    if "cycles" not in parameters:
        return q - full
    return q - full + _lag(q, full, up - down, parameters["cycles"])


def _lag(q: Signal, full: Signal, reach: Signal, cycles: Signal) -> Signal:
    """Return what the set lags behind its full value; exact for steps in one direction.

    Within a range it fades by a factor of e on a path of `way` times the range.
    """

    def complex_steps(signal: Signal) -> NDArray[np.complex128]:
        slope = signal.slope if signal.slope.shape[-1] else np.zeros((*signal.slope.shape[:-1], 1))
        return np.asarray(signal.value)[..., None] + 1j * STEP * slope

    way, final, reached = 2.0 * complex_steps(cycles), complex_steps(full), complex_steps(reach)
    path, rise = np.diff(complex_steps(q), axis=0), np.diff(final, axis=0)
    path *= np.sign(path.real)
    lag = np.zeros_like(reached)
    # The first sample was reached in one motion.
    lag[0] = way / (1.0 + way) * final[0]
    for i, (s, grown, before, after) in enumerate(zip(path, rise, reached[:-1], reached[1:], strict=True)):
        wider, fades = after - before, before[0].real > 0.0
        # Within the range so far it fades, and beyond it tends to a share of the range.
        if fades:
            lag[i + 1] = lag[i] * np.exp(-(s - wider) / (way * before))
        if wider[0].real > 0.0:
            steady = way / (1.0 + way) * grown / wider
            rest = (lag[i + 1] - steady * before) * np.exp(np.log(before / after) / way) if fades else 0.0
            lag[i + 1] = steady * after + rest
    value, slope = lag[:, 0].real, lag.imag[:, : q.slope.shape[1]] / STEP
    return Signal(np.asarray(value, dtype=np.float64), np.asarray(slope, dtype=np.float64))


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
        EffectParameter(
            "cycles",
            "1",
            "cycles over the range so far in which what the set lacks falls by a factor of e; without it the set is "
            "there at once",
            (0.5, 0.02, 100.0),
            optional=True,
            variant=True,
            scan=(0.2, 1.0, 5.0),
            prior=Prior(
                "log_uniform",
                0.1,
                10.0,
                source="engineering judgement: a set that grows in a tenth of a cycle is there at once, and most of it "
                "appears in the first cycles of a test (Diani, Fayolle and Gilormini, 2009, "
                "doi:10.1016/j.eurpolymj.2008.11.017)",
            ),
        ),
    ),
    how_often="occasional",
    families=("softening in use",),
    of_fillers="set",
    in_force_law="set",
    needs="unloading through zero force from at least two amplitudes, more to one side than to the other; for its "
    "growth several cycles over the same range",
    rivals=("drift", "offset", "viscoelasticity"),
    source="Dorfmann and Ogden (2004), Mullins effect with permanent set, doi:10.1016/j.ijsolstr.2003.11.014",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    rig=RigChange(drive=drive, order=2),
    shown=("axial", {"set": 0.1}),
)
