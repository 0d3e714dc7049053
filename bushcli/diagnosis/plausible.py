"""Whether an identified effect is one that real bushings have."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from bushcli.active import ActiveEffect
from bushcli.diagnosis.usual import admitted, in_words, usual_value
from bushcli.recording import Recording

# An amplitude beyond this many times an ordinary one is remarkable, and so is a parameter at its bound.
REMARKABLE = 20.0
AT_BOUND = 1e-3
# Of a normal distribution.
CONFIDENCE = 1.96


def plausibility(
    active: ActiveEffect, recordings: Sequence[Recording], std: Mapping[str, float] | None = None
) -> tuple[bool, str]:
    """Whether an effect's identified values are those of a real bushing on its channels, and why not.

    Parameters
    ----------
    active, recordings
    std
        Standard errors by parameter: a value that is hardly known does not say that it is not what is usual.
    """
    remark = ""
    recordings = [one for one in recordings if active.acts_on(one.name, one.mode)]
    for parameter in active.effect.amplitudes:
        if parameter.name not in active.values:
            continue
        value, off = active.values[parameter.name], float(parameter.off or 0.0)
        usual = usual_value(active.effect, parameter, recordings)
        if abs(value - off) > REMARKABLE * abs(usual - off):
            found, often = (in_words(parameter, v, recordings) for v in (value, usual))
            much = f"{found} is more than {REMARKABLE:g} times what is usual ({often.partition(' = ')[2]})"
            nearest = abs(value - off) - CONFIDENCE * (std or {}).get(parameter.name, 0.0)
            if nearest > REMARKABLE * abs(usual - off):
                return False, much
            remark = f"{much}, but so uncertain that it may be usual"
    for parameter in active.parameters:
        value = active.values[parameter.name]
        lower, upper = admitted(active.effect, parameter, recordings)
        near = AT_BOUND * max(abs(value), abs(parameter.start))
        both = math.isfinite(parameter.most) or (parameter.off is None and bool(parameter.scan))
        if (both and value <= lower + near) or value >= upper - near:
            return False, f"{in_words(parameter, value, recordings)} lies at its bound"
    return True, remark or "its parameters are of a size that real bushings have"
