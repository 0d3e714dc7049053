"""How surely the words of a column's name mean a quantity."""

from __future__ import annotations

import re

from bushcli.recording.header.vocabulary import (
    ACROSS,
    ALL_ENDINGS,
    ENDINGS,
    FOREIGN_BEGINNINGS,
    SPECIAL,
    WEAK,
    WORDS,
)
from cases.mode import modes


def name_quality(name: str, kind: str) -> int:
    """Return how surely a name means a quantity; see `bushcli.recording.header.header.match_quality`.

    The name of a mode does not count: "axial displacement" means as surely a length as "displacement".
    """
    if kind in SPECIAL:
        # "Volume ratio J", "Pressure p": the name and its symbol.
        known, symbols = SPECIAL[kind], {word for word in SPECIAL[kind] if len(word) == 1}
        plain = " ".join(word for word in name.split() if word not in symbols)
        at = min((i for i, word in enumerate(known) if word in (name, plain)), default=-1)
        return (
            4
            if at == 0
            else 3
            if at > 0
            else 2 * any(f" {word} " in f" {name} " for word in known if len(word) > 1)
        )
    words, known = [word for word in name.split() if word not in modes()], WORDS[kind]
    name = " ".join(words)
    if kind in ("strain", "stretch") and ACROSS & set(words):
        return 0
    if len(words) > 1 and words[-1] in ("no", "nr"):
        return 0  # "Force no" counts something; "Force no 2" is a channel
    if name == known[0]:
        return 4
    if name in known:
        return 3
    if any(len(word) > 1 and word in words for word in known):
        # "extension ratio" contains a word for a length but is a stretch; any other ratio is none.
        phrase = any(" " in word and f" {word} " in f" {name} " for word in known)
        other_ratio = "ratio" in words and not phrase
        return 0 if other_ratio or any(name in WORDS[other] for other in WORDS if other != kind) else 2
    if any(word in words for word in WEAK.get(kind, ())):
        return 1
    if kind not in ENDINGS or name.startswith(FOREIGN_BEGINNINGS):
        return 0
    longest = max((end for end in ALL_ENDINGS if name.endswith(end)), key=len, default="")
    return 1 if longest in ENDINGS[kind] else 0


def plain_name(name: str) -> str:
    """Return a name in lower case, with single blanks between its words."""
    return " ".join(re.sub(r"[\W_]+", " ", name.lower()).split())
