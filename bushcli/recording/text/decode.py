"""Bytes -> text: by byte-order mark, else by the bytes themselves.

UTF-16 without a mark has zeros in every second byte, because a table consists mostly of digits. Bytes that are not
valid UTF-8 are Latin-1 (as in Windows) or GBK: Chinese characters are pairs of bytes beyond 127, and the common ones
begin with 0xB0 to 0xD7, where Latin-1 has capital letters with accents; single letters with accents between others, as
in ``Prüfzeit``, are not pairs.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

from bushcli.errors import Problem, RecordingError
from bushcli.runtime.bounded import Endless, TooLarge, read_bounded

#: Bytes. Two million rows of three columns; reading them takes about a quarter of a minute.
LARGEST_FILE = 64_000_000
_BOMS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, because it begins with the mark of UTF-16
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
#: Bytes that are examined for UTF-16, and share of zeros in every second one of them; below, the number of runs of
#: bytes beyond 127 that are examined for Chinese, and the share of common characters.
_LOOKED_AT, _ZEROS = 65_536, 0.6
_MOST_RUNS, _COMMON = 10_000, 0.8
_BEYOND = re.compile(rb"[\x80-\xff]+")


@contextmanager
def refused_if_unreadable(path: Path, expected: str, too_large: str) -> Iterator[None]:
    """Refuse a file that cannot be read, or is too large; what is expected instead, and what to do if it is large."""
    try:
        yield
    except Endless as error:
        raise RecordingError(Problem(str(path), str(error), "", expected)) from None
    except TooLarge as error:
        raise RecordingError(Problem(str(path), str(error), "", too_large)) from None
    except FileNotFoundError:
        raise RecordingError(Problem(str(path), "no such file")) from None
    except IsADirectoryError:
        raise RecordingError(Problem(str(path), "is a directory", expected=expected)) from None
    except (OSError, ValueError) as error:
        raise RecordingError(Problem(str(path), f"cannot be read: {error}")) from None


def read_text(path: Path) -> str:
    """Return the text of a file, without byte-order mark, with line feeds between lines."""
    with refused_if_unreadable(path, "a CSV file", "every tenth row is enough for a fit"):
        content = read_bounded(path, LARGEST_FILE)
    text = text_of(content)
    if "\0" in text or (content and not text):
        expected = "CSV in UTF-8, UTF-16, Latin-1 or GBK"
        raise RecordingError(Problem(str(path), "is not a text file", expected=expected))
    if text.isspace() or not text:
        raise RecordingError(Problem(str(path), "is empty"))
    return text


def text_of(content: bytes) -> str:
    """Return the text that bytes stand for; empty, or with null characters, where they are no text."""
    encodings = [encoding for mark, encoding in _BOMS if content.startswith(mark)][:1]
    if not encodings:
        head = content[:_LOOKED_AT]
        half = max(len(head) // 2, 1)
        odd, even = head[1::2].count(0), head[::2].count(0)
        if odd > _ZEROS * half and even < 0.01 * half:
            encodings = ["utf-16-le"]
        elif even > _ZEROS * half and odd < 0.01 * half:
            encodings = ["utf-16-be"]
        else:
            encodings = (
                ["utf-8", "gb18030", "cp1252"] if _is_chinese(content) else ["utf-8", "cp1252", "latin-1"]
            )
    for encoding in encodings:
        try:
            # Ctrl-Z: the end of a file for DOS.
            return content.decode(encoding).rstrip("\x1a").replace("\r\n", "\n").replace("\r", "\n")
        except UnicodeDecodeError:
            continue
    return ""


def _is_chinese(content: bytes) -> bool:
    """Whether the bytes beyond 127 are pairs, most of which begin like common Chinese characters."""
    runs = [match[0] for match in islice(_BEYOND.finditer(content), _MOST_RUNS)]
    pairs = [run[i] for run in runs for i in range(0, len(run), 2)]
    if not pairs or any(len(run) % 2 for run in runs):
        return False
    common = sum(0xB0 <= lead <= 0xD7 for lead in pairs)
    # Full-width signs and letters, such as the brackets around a unit, begin with 0xA1 to 0xA3.
    signs = sum(0xA1 <= lead <= 0xA3 for lead in pairs)
    return common > 0 and common + signs >= _COMMON * len(pairs)
