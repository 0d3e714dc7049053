"""Names of effects in a model: an effect of the rig may occur in the rig of every channel, "offset@radial"."""

from __future__ import annotations

# Separates the name of an effect from the rig where the same effect occurs more than once.
_AT = "@"


def in_rig(effect: str, rig: str) -> str:
    """Return the name of an effect in the rig of a channel, "offset@radial"; without a rig the effect's own name."""
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
