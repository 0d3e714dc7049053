"""Find the faults of a case's recordings, the fatal ones first."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.curve.segment import per_sample
from bushcli.faults.fault import DataFault, Mask, places
from bushcli.faults.repeats import clipped_samples, stuck_displacement, stuck_force, stuck_rows
from bushcli.faults.scale import scales
from bushcli.faults.sense import extremes, magnitude, no_signal, positions, reversed_sign
from bushcli.faults.signal import abscissa, slope
from bushcli.faults.spikes import spikes
from bushcli.recording import Recording

Array = NDArray[np.float64]

# With a larger share of clipped samples a recording lacks the forces that it was made for.
_MOST_CLIPPED = 0.1
# With a larger share of bad samples the search has misunderstood the signal: no sample is left out.
_MOST_BAD = 0.5
# A sudden motion makes a peak of force, for example at a step that relaxes. It explains a peak of up to this many times
# the stiffness of the whole recording, which a bump stop or the corner of a friction loop exceeds some threefold.
_BESIDE = 3.0

_LEFT_OUT = "fits and diagnosis leave these samples out; for `bushcli direct` delete their rows"


def find_faults(
    case: Case,
    recordings: Sequence[Recording],
    of_samples: Callable[[Recording], Iterable[DataFault]] | None = None,
) -> tuple[DataFault, ...]:
    """Return the faults of recordings, the fatal ones first.

    Parameters
    ----------
    case : Case
        Its shape determines how stiff a bushing of rubber can be.
    recordings : sequence of Recording
        As they were read, of bushing or coupons.
    of_samples : callable or None
        Called instead of `sample_faults`, where some of its results are known.

    Returns
    -------
    tuple of DataFault
        Faults of single samples list them; `bushcli.faults.masks` combines the lists.
    """
    accepted = {(recording.name, kind) for recording in recordings for kind in recording.accepted_faults}
    faults: list[DataFault] = []
    left_out: list[Mask] = []
    sound: list[bool] = []
    for recording in recordings:
        bad = np.zeros(len(recording.force), dtype=bool)
        for fault in (of_samples or sample_faults)(recording):
            if fault.kind not in recording.accepted_faults:
                faults.append(fault)
                bad |= fault.samples
        left_out.append(bad if bad.mean() < _MOST_BAD else np.zeros_like(bad))
        turned = [*reversed_sign(recording, left_out[-1])]
        senses = [
            *extremes(recording),
            *([] if turned else magnitude(recording, left_out[-1])),
            *no_signal(recording, left_out[-1]),
            *positions(case.geometry, recording, left_out[-1]),
        ]
        faults += [fault for fault in (*turned, *senses) if fault.kind not in recording.accepted_faults]
        # A modulus from a magnitude, or from a travel with another zero, says nothing about units. That from a force of
        # the other sign does.
        sound.append(not any(fault.fatal for fault in senses))
    faults += scales(
        case.geometry,
        [recording for recording, usable in zip(recordings, sound, strict=True) if usable],
        [mask for mask, usable in zip(left_out, sound, strict=True) if usable],
    )
    faults = [fault for fault in faults if (fault.channel, fault.kind) not in accepted]
    return tuple(sorted(faults, key=lambda fault: not fault.fatal))


def bad_samples(recording: Recording, faults: Iterable[DataFault] | None = None) -> Mask:
    """Return which samples (n,) of a recording a fit must not use; none if they are most of it.

    Parameters
    ----------
    recording : Recording
    faults : iterable of DataFault, optional
        Its `sample_faults`, where they are known.
    """
    bad = np.zeros(len(recording.force), dtype=bool)
    for fault in sample_faults(recording) if faults is None else faults:
        if fault.kind not in recording.accepted_faults:
            bad |= fault.samples
    return bad if bad.mean() < _MOST_BAD else np.zeros_like(bad)


def sample_faults(recording: Recording) -> Iterator[DataFault]:
    """Yield the faults of single samples, for which no case is needed."""
    if recording.repeated:
        lines = ", ".join(map(str, recording.repeated[:3]))
        rest = len(recording.repeated) - 3
        yield DataFault(
            recording.name,
            "time",
            (
                f"{len(recording.repeated)} rows repeat the row before them"
                if len(recording.repeated) > 1
                else "a row repeats the row before it"
            )
            + f", including its time stamp (line {lines}"
            + (f" and {rest} more)" if rest > 0 else ")"),
            "repeated rows are left out; find out why the logger writes rows twice",
            False,
        )
    for repair in recording.repairs:
        if repair.kind != "columns":
            remedy = "the recording is repaired; find out why the logger writes it this way"
            yield DataFault(recording.name, repair.kind, repair.text, remedy, False)
    noise = recording.force_noise
    clip = clipped_samples(recording.force, recording.displacement, noise)
    if clip.any():
        fatal = bool(clip.mean() > _MOST_CLIPPED)
        at = places(recording, np.flatnonzero(clip))
        yield DataFault(
            recording.name,
            "clipped",
            f"{clip.sum()} of {len(clip)} samples repeat the same extreme force while the displacement changes "
            f"({at})",
            "record it again with a larger range of the load cell or its amplifier, or with a smaller travel"
            + ("" if fatal else f"; {_LEFT_OUT}"),
            fatal,
            clip,
        )
    q, force = recording.displacement, recording.force
    rows = stuck_rows(force, q, noise, recording.displacement_noise)
    held_force = stuck_force(force, q, slope(q, force), noise, clip) & ~rows
    held_displacement = stuck_displacement(q, force, abscissa(recording)) & ~rows
    for held, what in (
        (held_force, "force"),
        (held_displacement, "displacement"),
        (rows, "force and the displacement"),
    ):
        if held.any():
            # Where most samples only repeat others, leaving them out leaves no recording.
            fatal = bool(held.mean() > _MOST_BAD)
            yield DataFault(
                recording.name,
                "stuck",
                f"{held.sum()} of {len(held)} samples repeat the {what} before them while the test goes on "
                f"({places(recording, np.flatnonzero(held))})",
                "look for lost messages between sensor and logger"
                + ("; record it again" if fatal else f"; {_LEFT_OUT}"),
                fatal,
                held,
            )
    yield from _spikes(recording, clip | held_force | held_displacement | rows)


def _spikes(recording: Recording, excluded: Mask) -> Iterator[DataFault]:
    """Yield spikes of the displacement and of the force, among samples that have no other fault."""
    x, sound = abscissa(recording), np.flatnonzero(~excluded)
    n = len(recording.force)
    jumps, spiked = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    # The displacement follows a program of ramps: any sample may be a corner.
    jumps[sound] = spikes(recording.displacement[sound], x[sound], np.zeros(len(sound), dtype=int))
    still = recording.displacement.copy()
    still[jumps] = np.interp(x[jumps], x[~jumps], still[~jumps])
    whole = Recording(recording.mode, still, recording.force, recording.time) if jumps.any() else recording
    branch = per_sample(whole.branches, range(len(whole.branches)))
    # A way through zero load is two branches, unloading and loading, but has no kink there.
    directions = per_sample(whole.branches, [branch.direction for branch in whole.branches])
    way = np.cumsum(np.diff(directions, prepend=directions[0]) != 0)
    # The range of the four steps around each sample: two before and two after it.
    steps = sliding_window_view(np.pad(np.diff(still[sound]), 2, mode="edge"), 4)
    explained = np.zeros(n)
    explained[sound] = _BESIDE * abs(slope(still[sound], recording.force[sound])) * np.ptp(steps, axis=1)
    # The longer ones show a spike between a turning point and zero, the shorter ones two that are close to each other.
    for group in (way, branch):
        left = sound[~spiked[sound]]
        spiked[left] = spikes(recording.force[left], x[left], group[left], explained[left], ends=True)
    # Where both jump together the bushing was moved: that is not a fault of a sensor.
    both = jumps & spiked
    for bad, what in ((spiked & ~both, "force"), (jumps & ~both, "displacement")):
        if bad.any():
            yield DataFault(
                recording.name,
                "spikes",
                f"in {bad.sum()} of {n} samples the {what} lies far from the curve through its neighbours "
                f"({places(recording, np.flatnonzero(bad))})",
                f"look for a loose contact or a disturbed cable; {_LEFT_OUT}",
                False,
                bad,
            )
