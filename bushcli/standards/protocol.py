"""The protocol of a case's tests: their contents, the requirements of standards, and open questions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bushcli.case import Case
from bushcli.recording import RecordedProgram, Recording
from bushcli.standards.observed import Observed, observe
from bushcli.standards.questions import Lack, open_questions
from bushcli.standards.standard import Clause, clauses


@dataclass(frozen=True)
class Protocol:
    """Protocol of the tests of a case.

    Attributes
    ----------
    recordings, coupons : tuple of Observed
        In the order of the case.
    judged : tuple of (str, str, tuple of Clause)
        Channel, standard and its requirements, for each recording and coupon that names a standard.
    lacks : tuple of Lack
        Questions that the recordings leave open.
    files : tuple of Recording or RecordedProgram
        Recordings, coupons and programs of load cases that were read from a file, with the columns that were used.
    remarks : tuple of (str, str)
        Channel, and how its file was read where that is not obvious.
    """

    recordings: tuple[Observed, ...]
    coupons: tuple[Observed, ...]
    judged: tuple[tuple[str, str, tuple[Clause, ...]], ...]
    lacks: tuple[Lack, ...]
    files: tuple[Recording | RecordedProgram, ...]
    remarks: tuple[tuple[str, str], ...]

    @property
    def is_violated(self) -> bool:
        """Whether a recording does not meet a standard that it names; good practice does not count."""
        return any(
            clause.met is False and not clause.practice for _, _, clauses in self.judged for clause in clauses
        )


def protocol(
    case: Case,
    curves: Sequence[Recording],
    coupons: Sequence[Recording],
    programs: Sequence[RecordedProgram] = (),
) -> Protocol:
    """Return the protocol of a case's tests.

    Parameters
    ----------
    case : Case
    curves, coupons : sequence of Recording
        As read from the files, in the order of the case; parts of a batch follow the other curves.
    programs : sequence of RecordedProgram
        Programs of load cases that were read from files.
    """
    bushings, tested = tuple(map(observe, curves)), tuple(map(observe, coupons))
    sources = (*case.recordings, *case.specimens, *case.coupons)
    judged = tuple(
        (observed.channel, source.standard, clauses(observed, source))
        for observed, source in zip((*bushings, *tested), sources, strict=True)
        if source.standard is not None
    )
    read: tuple[Recording | RecordedProgram, ...] = (*curves, *coupons, *programs)
    files = tuple(file for file in read if file.columns)
    remarks = tuple(
        (file.name, repair.text) for file in read for repair in file.repairs if repair.kind == "columns"
    )
    return Protocol(bushings, tested, judged, open_questions(bushings, tested), files, remarks)
