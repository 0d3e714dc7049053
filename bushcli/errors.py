"""Errors that a user can act on: what is wrong, where, what was expected, the nearest valid thing.

They are raised anywhere in `bushcli` and shown by the command line alone, which ends with exit code 2.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

# C0 without tab and line feed, DEL, C1, the signs that reverse or hide what follows them (Unicode TR 9), surrogates:
# they represent bytes of arguments and file names that are not UTF-8, and Python may print them as these bytes.
_CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)


@dataclass(frozen=True)
class Problem:
    """An error in the input.

    Attributes
    ----------
    where : str
        File, and line or key where there is one: ``case.toml``, ``axial.csv:12:3``.
    what : str
        The finding: ``material.law = "yeho" is not a law``.
    nearest : str
        The nearest valid thing, or empty.
    expected : str
        What would be valid, or empty.
    """

    where: str
    what: str
    nearest: str = ""
    expected: str = ""

    def __str__(self) -> str:
        """Return ``where: what; did you mean "nearest"? (expected)``."""
        text = f"{self.where}: {self.what}"
        if self.nearest:
            text += f'; did you mean "{self.nearest}"?'
        if self.expected:
            text += f" ({self.expected})"
        return printable(text)


def printable(text: str) -> str:
    r"""Return a text with its control characters written out, such as ``\x1b``: they would act on a terminal.

    The same is done with bytes that are not UTF-8, such as the byte 0x9b, which is a control character of terminals.
    """
    return _CONTROL.sub(lambda found: _escaped(ord(found[0])), text)


def count_of(number: int, noun: str) -> str:
    """Return a number of things in words: "1 sample", "12 samples".

    Parameters
    ----------
    number : int
    noun : str
        Of one thing; its plural ends in s.
    """
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _escaped(code: int) -> str:
    byte = code - 0xDC00 if 0xDC80 <= code <= 0xDCFF else code
    return f"\\x{byte:02x}" if byte < 0x100 else f"\\u{byte:04x}"


class InputError(Exception):
    """A case file, an option or a recording that cannot be used.

    Parameters
    ----------
    *problems : Problem
        All findings, in the order in which they should be read; at least one.
    """

    exit_code = 2

    def __init__(self, *problems: Problem) -> None:
        self.problems = problems
        super().__init__("\n".join(str(problem) for problem in problems))


class CaseError(InputError):
    """A case file or an override that cannot be used."""


class RecordingError(InputError):
    """A recording that cannot be read or makes no sense."""


def nearest(name: str, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return the member of ``known`` that is spelled most like ``name``, or an empty string.

    Upper and lower case count as equal.

    Parameters
    ----------
    name : str
        As the user wrote it.
    known : iterable of str
        Valid names.
    cutoff : float
        Smallest ratio of `difflib.SequenceMatcher`, from 0 to 1, at which a name is suggested.
    """
    import difflib  # 4 ms at start-up, needed only for names that are wrong

    folded = {other.casefold(): other for other in known}
    found = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=cutoff)
    return folded[found[0]] if found else ""
