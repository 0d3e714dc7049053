"""Effects in words for people: "Mullins softening" for "mullins", "offset (radial)" for "offset@radial"."""

from __future__ import annotations

from bushcli.effects.effect import effects
from bushcli.effects.names import PEOPLE, effect_name, rig_of, within

UNKNOWN, NOTHING, FREE_LAW = "unknown", "nothing", "free_law"
_TITLES = {
    UNKNOWN: "Unknown physics",
    NOTHING: "Nothing missing",
    FREE_LAW: "A law other than the coupons'",
}


def title(name: str) -> str:
    """Return the title of an effect for the start of a line: "Offset (radial)" for "offset@radial"."""
    own, rig = effect_name(name), rig_of(name)
    known = effects().get(own)
    words = _TITLES.get(own) or getattr(known, "title", "") or own.replace("_", " ").capitalize()
    words = " ".join(word.capitalize() if word.capitalize() in PEOPLE else word for word in words.split())
    return f"{words} ({rig})" if rig else words


def phrase(name: str) -> str:
    """Return the name of an effect within a sentence: "internal friction", "unknown physics"."""
    return within(title(name))
