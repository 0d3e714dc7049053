"""Whether an identified effect is one that real bushings have."""

from __future__ import annotations

from collections.abc import Sequence

from bushcli.diagnosis.usual import in_words, usual_value
from bushcli.effect import ActiveEffect
from bushcli.recording import Recording

# An amplitude beyond this many times an ordinary one is remarkable, and so is a parameter at its bound.
REMARKABLE = 20.0
AT_BOUND = 1e-3


def plausibility(active: ActiveEffect, recordings: Sequence[Recording]) -> tuple[bool, str]:
    """Whether an effect's identified values are those of a real bushing on its channels, and why not."""
    recordings = [one for one in recordings if active.acts_on(one.name, one.mode)]
    for parameter in active.effect.amplitudes:
        if parameter.name not in active.values:
            continue
        value, off = active.values[parameter.name], float(parameter.off or 0.0)
        usual = usual_value(active.effect, parameter, recordings)
        if abs(value - off) > REMARKABLE * abs(usual - off):
            found, often = (in_words(parameter, v, recordings) for v in (value, usual))
            return False, (
                f"{found} is more than {REMARKABLE:g} times what is usual ({often.partition(' = ')[2]})"
            )
    for parameter in active.parameters:
        value = active.values[parameter.name]
        near = AT_BOUND * max(abs(value), abs(parameter.start))
        low = parameter.off is None and bool(parameter.scan) and value <= parameter.lower + near
        if low or value >= parameter.upper - near:
            return False, f"{in_words(parameter, value, recordings)} lies at its bound"
    return True, "its parameters are of a size that real bushings have"
