"""Whether an identified effect is one that real bushings have."""

from __future__ import annotations

from collections.abc import Sequence

from bushcli.diagnosis.usual import usual_value
from bushcli.effect import ActiveEffect
from bushcli.recording import Recording

# An amplitude beyond this many times an ordinary one is remarkable, and so is a parameter at its bound.
REMARKABLE = 20.0
AT_BOUND = 1e-3


def plausibility(active: ActiveEffect, recordings: Sequence[Recording]) -> tuple[bool, str]:
    """Whether an effect's identified values are those of a real bushing, and why not."""
    for parameter in active.effect.amplitudes:
        if parameter.name not in active.values:
            continue
        value, off = active.values[parameter.name], float(parameter.off or 0.0)
        usual = usual_value(active.effect, parameter, recordings)
        if abs(value - off) > REMARKABLE * abs(usual - off):
            return False, (
                f"{parameter.name} = {value:.3g} {parameter.unit} is more than {REMARKABLE:g} times what is usual "
                f"({usual:.3g})"
            )
    for parameter in active.parameters:
        value = active.values[parameter.name]
        near = AT_BOUND * max(abs(value), 1e-9)
        if parameter.off is None and parameter.scan:
            if value <= parameter.lower + near or value >= parameter.upper - near:
                return False, f"{parameter.name} = {value:.3g} {parameter.unit} lies at its bound"
        elif value >= parameter.upper - near:
            return False, f"{parameter.name} = {value:.3g} {parameter.unit} lies at its bound"
    return True, "its parameters are of a size that real bushings have"
