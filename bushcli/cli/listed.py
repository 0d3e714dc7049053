"""Options that may be repeated, each a list with commas."""

from __future__ import annotations

from collections.abc import Sequence


def names_in(options: Sequence[str]) -> tuple[str, ...]:
    """Return the names that all uses of an option give, each once."""
    names = [name.strip() for option in options for name in option.split(",")]
    return tuple(dict.fromkeys(name for name in names if name))
