"""Why a part is an outlier, as far as its recording shows: a fault of its data, another travel, an effect.

What remains of a part's force after its own stiffness factor is compared with what each effect of a rig would add to
the curve of the batch: the derivative of the logged force by the effect's amplitude where that is off. Friction, which
changes the rubber and not the curve, is compared by its loop.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.case.unit import case_file_number, case_file_unit
from bushcli.effects import rig
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects
from bushcli.effects.names import readable_name
from bushcli.recording import Recording
from cases.mode import modes

Array = NDArray[np.float64]

# An effect is named if it removes at least this share of the mean square that a part's misfit has beyond the batch's,
# as a single factor has to remove half of the rms misfit of a prediction (`bushcli.report.verdict`).
EXPLAINS = 0.75


@dataclass(frozen=True)
class Cause:
    """A cause that a recording shows."""

    kind: str  # of a data fault, "travel", or the name of an effect
    text: str  # the observation, with numbers


def travel_cause(part: Recording, common: Recording) -> Cause:
    """Return in which way the program of a part differs from that of the batch."""
    rotational = modes()[part.mode].rotational
    per, name = (180.0 / np.pi, "deg") if rotational else (1.0, "mm")
    of_part, of_batch = (
        f"from {per * float(q.min()):.4g} to {per * float(q.max()):.4g} {name}"
        for q in (part.displacement, common.displacement)
    )
    reach = f"moves {of_part}, the batch {of_batch}"
    share = float(np.ptp(part.displacement) / np.ptp(common.displacement))
    same_travel = abs(share - 1.0) < 0.02
    difference = "other steps in between" if same_travel else f"{share:.3g} times the travel"
    at_end, batch_at_end = (
        np.isclose(q, q.max(), atol=1e-3 * np.ptp(q)).mean() for q in (part.displacement, common.displacement)
    )
    clamped = not same_travel and share < 1.0 and at_end > 2.0 * batch_at_end + 0.02
    return Cause("travel", f"{reach}: {difference}" + (", clamped at its end" if clamped else ""))


def effect_cause(part: Recording, batch: Array, residual: Array, usual: float) -> Cause | None:
    """Return the effect that explains most of what remains of a part's force; None if none explains enough."""
    excess = float(residual @ residual) - len(residual) * usual**2
    if excess <= 0.0:
        return None
    best: tuple[float, str, str] | None = None
    for name, words, column in _columns(part, batch):
        # Perpendicular to the factor that the part has already.
        across = column - (column @ batch) / (batch @ batch) * batch
        size = float(across @ across)
        if not size > 1e-12 * float(column @ column):
            continue
        amplitude = float(across @ residual) / size
        explained = amplitude**2 * size / excess
        if best is None or explained > best[0]:
            best = explained, name, words.format(amplitude)
    if best is None or best[0] < EXPLAINS:
        return None
    share = min(100.0 * best[0], 100.0)
    return Cause(best[1], f"{readable_name(best[1])}: {best[2]} explains {share:.0f} % of what sets it apart")


def _columns(part: Recording, batch: Array) -> Iterator[tuple[str, str, Array]]:
    """Yield the name of an effect, its amplitude as a format, and what a unit of it adds to the force (n,)."""
    rotational = modes()[part.mode].rotational
    order = np.argsort(part.displacement, kind="stable")
    q, index = np.unique(part.displacement[order], return_index=True)
    force = batch[order][index]
    # Slopes over a twentieth of the range: noise of the displacement makes those between neighbours meaningless.
    wide = 0.025 * float(np.ptp(q))
    stiffness = (np.interp(q + wide, q, force) - np.interp(q - wide, q, force)) / (
        np.minimum(q + wide, q[-1]) - np.maximum(q - wide, q[0])
    )

    def response(at: Array) -> tuple[Array, Array, Array]:
        return np.interp(at, q, force), np.interp(at, q, stiffness), np.zeros((len(at), 1))

    for effect in effects().values():
        # Every part has a factor already.
        if effect.rig is None or effect.is_factor or not effect.acts_on(part.mode):
            continue
        if effect.needs_time and part.time is None:
            continue
        for amplitude in [parameter for parameter in effect.parameters if parameter.off is not None]:
            values = {
                parameter.name: parameter.start if parameter.off is None else parameter.off
                for parameter in effect.parameters
            }
            active = ActiveEffect(effect, values)
            try:
                names = (active.full_name(amplitude),)
                logged = rig.elastic_response([active], part.displacement, part.time, response, names)
                added = logged.slope[:, 0]
            except (ArithmeticError, ValueError):
                continue
            if np.isfinite(added).all() and added.any():
                scale = case_file_number(amplitude, 1.0, rotational)
                words = f"{amplitude.name} of about {{0:.3g}} {case_file_unit(amplitude, rotational)}".strip()
                yield effect.name, words, np.asarray(added / scale, dtype=np.float64)
    sliding = [effect.name for effect in effects().values() if effect.slides]
    if sliding and (part.time is not None or len(part.displacement) > 2):
        # A loop: half of it on the way up, half on the way down.
        width = max(len(part.displacement) // 200, 1)
        padded = np.pad(part.displacement, width, mode="edge")
        smooth = np.convolve(padded, np.ones(2 * width + 1) / (2 * width + 1), mode="valid")
        direction = np.asarray(np.sign(np.gradient(smooth)), dtype=np.float64)
        yield (
            " or ".join(sliding),
            f"a loop of about {{0:.3g}} {'N mm' if rotational else 'N'} to either side",
            direction,
        )


def join_causes(causes: Sequence[Cause]) -> str:
    """Return the texts of causes in one line."""
    return "; ".join(cause.text for cause in causes)
