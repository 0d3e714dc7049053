"""Bytes -> text: UTF-8, UTF-16 or UTF-32 by byte-order mark, else UTF-8, else Latin."""

from __future__ import annotations

import codecs
from pathlib import Path

from bushcli.errors import Problem, RecordingError
from bushcli.runtime.bounded import TooLarge, read_bounded

#: Bytes. Two million rows of three columns; reading them takes about a quarter of a minute.
LARGEST_FILE = 64_000_000
_BOMS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, whose mark it begins with
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def decoded(path: Path) -> str:
    """Return the text of a file, without byte-order mark.

    Raises
    ------
    RecordingError
        When there is no such file, it cannot be read, is no text, or is empty.
    """
    try:
        content = read_bounded(path, LARGEST_FILE)
    except FileNotFoundError:
        raise RecordingError(Problem(str(path), "no such file")) from None
    except IsADirectoryError:
        raise RecordingError(Problem(str(path), "is a directory", expected="a CSV file")) from None
    except TooLarge as error:
        raise RecordingError(
            Problem(str(path), str(error), "", "every tenth row will do for a fit")
        ) from None
    except (OSError, ValueError) as error:
        raise RecordingError(Problem(str(path), f"cannot be read: {error}")) from None
    encodings = [encoding for mark, encoding in _BOMS if content.startswith(mark)][:1] or [
        "utf-8",
        "cp1252",
        "latin-1",
    ]
    text = ""
    for encoding in encodings:
        try:
            text = content.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    if "\0" in text or (content and not text):
        raise RecordingError(
            Problem(str(path), "is not a text file", expected="CSV in UTF-8, Latin-1, or UTF-16 with BOM")
        )
    if not text.strip():
        raise RecordingError(Problem(str(path), "is empty"))
    return text
