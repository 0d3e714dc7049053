"""Names of effects in a model: an effect of the rig may occur in the rig of every channel, "offset@radial"."""

from __future__ import annotations

# Separates the name of an effect from the rig where the same effect occurs more than once.
_AT = "@"
# Names of people, which keep their capital within a sentence.
PEOPLE = frozenset({"Mullins"})


def in_rig(effect: str, rig: str) -> str:
    """Return the name of an effect in the rig of a channel, "offset@radial"; without a rig the effect's own name.

    Parameters
    ----------
    effect : str
        Name of an effect as registered.
    rig : str
        Name of a channel; empty for the first use of the effect.
    """
    return f"{effect}{_AT}{rig}" if rig else effect


def effect_name(name: str) -> str:
    """Return the name of an effect without its rig: "offset" for "offset@radial"."""
    return name.partition(_AT)[0]


def rig_of(name: str) -> str:
    """Return the rig in the name of an effect, "radial" for "offset@radial"; empty without a rig."""
    return name.partition(_AT)[2]


def readable_name(name: str) -> str:
    """Return the name of an effect for a sentence: "offset (radial)" for "offset@radial"."""
    rig = rig_of(name)
    return f"{effect_name(name)} ({rig})" if rig else name


def within(words: str) -> str:
    """Return the title of an effect as part of a sentence: "internal friction", but "Mullins softening"."""
    first = words.split(maxsplit=1)[0] if words else ""
    capital = first in PEOPLE or not first[1:].islower()
    return words if capital else words[:1].lower() + words[1:]
