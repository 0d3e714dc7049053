"""Marks that `bushcli init --from` leaves in a case file where only the user knows the value."""

from __future__ import annotations

import re
from pathlib import Path

from bushcli.recording.text.decode import text_of
from bushcli.runtime.condition import Condition

_MARK = re.compile(r"#\s*<--")


def unedited(path: Path) -> tuple[Condition, ...]:
    """Return a condition if a case file still has lines that its user was asked to complete.

    Parameters
    ----------
    path : Path
    """
    if path.suffix != ".toml" or not path.is_file():
        return ()
    lines = [
        i for i, line in enumerate(text_of(path.read_bytes()).splitlines(), start=1) if _MARK.search(line)
    ]
    if not lines:
        return ()
    places = f"{'line' if len(lines) == 1 else 'lines'} {', '.join(map(str, lines))}"
    return (
        Condition(
            "unedited_case",
            f"{path.name}: `bushcli init` marked {places} with <--: it cannot know these values",
            "compare these lines with your bushing and files, and delete the marks",
        ),
    )
