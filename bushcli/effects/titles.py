"""Effects in words for people: "Mullins softening" for "mullins", "offset (radial)" for "offset@radial"."""

from __future__ import annotations

from bushcli.effects.effect import effects
from bushcli.effects.names import effect_name, rig_of

UNKNOWN, NOTHING, FREE_LAW = "unknown", "nothing", "free_law"
_TITLES = {
    UNKNOWN: "Unknown physics",
    NOTHING: "Nothing missing",
    FREE_LAW: "A law other than the coupons'",
}


def title(name: str) -> str:
    """Return the title of an effect for the start of a line: "Offset (radial)" for "offset@radial"."""
    stem, rig = effect_name(name), rig_of(name)
    effect = effects().get(stem)
    words = _TITLES.get(stem) or getattr(effect, "title", "") or stem.replace("_", " ").capitalize()
    return f"{words} ({rig})" if rig else words


def phrase(name: str) -> str:
    """Return the name of an effect within a sentence: "internal friction", "unknown physics"."""
    return within(title(name))


def within(words: str) -> str:
    """Return the title of an effect as part of a sentence: "internal friction", but "Mullins softening"."""
    first_word = words.split(maxsplit=1)[0] if words else ""
    people = {effect.title.split()[0] for effect in effects().values() if effect.of_a_person}
    return words if first_word in people or not first_word[1:].islower() else words[:1].lower() + words[1:]
