"""The type of a data fault, and the samples that a fit has to leave out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bushcli.recording import Recording
from bushcli.recording.source import FaultKind
from bushcli.runtime.condition import Condition

Mask = NDArray[np.bool_]

# Places that a message lists before it counts the rest.
_LISTED = 3

#: Probability that a file means something else than is read (a unit, an angle, amplitudes) before its values are looked
#: at, and that from which it is mentioned, more probable than not: judgement.
WRONG, MENTIONED = 0.02, 0.5
#: The first where a unit is not written but assumed. Judgement: rigs that write no unit log N and mm mostly, but kN, m,
#: pounds and inches as well.
WRONG_UNWRITTEN = 0.3


@dataclass(frozen=True)
class DataFault:
    """A defect of a recording that has no physical cause.

    Attributes
    ----------
    channel : str
        Name of the recording's channel.
    kind : FaultKind
        The keys of the table in ``docs/recordings.md``.
    where : str
        The observation and the samples concerned, with numbers.
    remedy : str
        How to correct it.
    fatal : bool
        Whether two statements of case and recordings contradict each other, so that every fit to the recording is
        meaningless until the fault is corrected.
    samples : (n,) array of bool
        Samples of the recording that a fit has to leave out; one False, for all, where the whole channel is at fault.
    probability : float
        That it is a fault and not an unusual specimen.
    """

    channel: str
    kind: FaultKind
    where: str
    remedy: str
    fatal: bool
    samples: Mask = field(default_factory=lambda: np.zeros(1, dtype=bool), repr=False, compare=False)
    probability: float = 1.0

    @property
    def is_doubtful(self) -> bool:
        """Whether an unusual specimen may explain it."""
        return self.probability < 1.0


def chance_in_words(probability: float) -> str:
    """Return the probability of a fault in words; one that nothing contradicts is never certain."""
    return "more than 99 %" if probability > 0.99 else f"{100.0 * probability:.0f} %"


def masks(faults: Iterable[DataFault], recording: Recording) -> Mask:
    """Return which samples (n,) of a recording a fit must not use.

    Parameters
    ----------
    faults : iterable of DataFault
        As `find_faults` returned them; those of other channels do not count.
    recording : Recording
        The recording that the faults were found in.
    """
    bad = np.zeros(len(recording.force), dtype=bool)
    for fault in faults:
        if fault.channel == recording.name and len(fault.samples) == len(bad):
            bad |= fault.samples
    return bad


def condition(fault: DataFault) -> Condition:
    """Return a fault as a condition of a result.

    Its name is "faulty_data" where it is fatal, "doubtful_data" where it is one only with some probability, and
    "bad_samples" otherwise.
    """
    return Condition(
        "faulty_data" if fault.fatal else "doubtful_data" if fault.is_doubtful else "bad_samples",
        f"{fault.channel}: {fault.where}",
        fault.remedy,
    )


def places(recording: Recording, samples: Sequence[int] | NDArray[np.intp]) -> str:
    """Return the times of samples, or their numbers from 1 without time: ``at 12.5 s, 40.1 s and 3 more``."""
    shown = [
        f"{recording.time[i]:.6g} s" if recording.time is not None else f"sample {i + 1}"
        for i in list(samples)[:_LISTED]
    ]
    rest = len(samples) - len(shown)
    if rest:
        return f"at {', '.join(shown)} and {rest} more"
    return "at " + (f"{', '.join(shown[:-1])} and {shown[-1]}" if len(shown) > 1 else shown[0])
