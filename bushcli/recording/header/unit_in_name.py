"""Units in the name of a column without brackets: ``force_kN``, ``Kraft in N``, ``F / N``, ``Moment kN·m``."""

from __future__ import annotations

import re
from collections.abc import Sequence

from bushcli.recording.header.quality import name_quality, plain_name
from bushcli.recording.header.units import COUNTED, tabulated_unit
from bushcli.recording.header.vocabulary import NUMBERED_WORDS, POWER, known_word

#: A product or quotient of units after a name: the "N/s" of "Force_N/s", the "kN·m" of "Moment kN·m filtered".
_COMPOUND = re.compile(r"(?<=[\s_,;:|=./-])[^\W\d_]+[²³]?(?:[·⋅×*/^][^\W_]+)+")
#: A number before a unit, such as the range of a sensor.
_NUMBER = re.compile(r"\d+(?:[.,/]\d+)?k?")


def unit_within(text: str, timed: bool) -> tuple[str, str]:
    """Split a name without brackets into the name and its unit, wherever that is, or an empty text."""
    for match in _COMPOUND.finditer(text):
        if _are_units(re.split(r"[·⋅×*/^]", match[0])):
            return text[: match.start()] + " " + text[match.end() :], match[0]
    last = re.search(r"(?<=[\s_,;:|=])[^\W\d_]+-[^\W\d_]+$", text)
    if last and _are_units(last[0].split("-")):  # ft-lb
        return text[: last.start()], last[0]
    foot = re.fullmatch(r"(.*\w)[\s_,;:.=-]*['′]", text)
    if foot:
        return foot[1], "'"
    for sign in "%‰":
        if sign in text:
            return text.replace(sign, " "), sign
    absent = re.search(r"(?<![^\W_])n\s*/\s*a\.?$", text, re.IGNORECASE)
    if absent:
        return text[: absent.start()], absent[0]
    return _unit_at_end(text, timed)


def with_second_unit(rest: str, written: list[str], timed: bool) -> tuple[str, list[str]]:
    """Return a name without the second unit that stands before a first one, and both: ``Travel mm (in)``."""
    first = tabulated_unit(written[0]) if len(written) == 1 else None
    if first is not None and prefix_apart(re.findall(r"[^\W_]+", rest), written[0]):
        return rest, written  # "Travel m m"
    before, unit = _unit_at_end(rest, timed) if first is not None else (rest, "")
    second = tabulated_unit(unit) if unit and unit.lower() != "in" else None
    if first is None or second is None or second.measured != first.measured:
        return rest, written
    return re.sub(r"\s+in\s*$", "", before), [*written, unit]


def is_range(words: Sequence[str], text: str) -> bool:
    """Whether the last of the words before a unit in a text is a number, and a range: not that of a channel.

    A name in which underscores stand around the number, force_2_N, numbers the channels.
    """
    if not words or not _NUMBER.fullmatch(words[-1]) or f"_{words[-1]}_" in text:
        return False
    before = words[-2].lower() if len(words) > 1 else ""
    return before not in NUMBERED_WORDS


def prefix_apart(words: Sequence[str], unit: str) -> str:
    """Return the prefix that a blank or a sign separates from its unit, ``Force k N``, or an empty text."""
    found = tabulated_unit(unit)
    last = words[-1] if words else ""
    if last.lower() in COUNTED:
        return last
    if found is None or len(last) > 2 or (last == "M" and found.measured == "moment"):
        return ""  # M is the symbol of a moment
    joined = tabulated_unit(last + unit) if last else None
    scaled = joined is not None and joined.measured == found.measured and joined.factor != found.factor
    return last if last == "k" or scaled else ""


def is_inner_unit(word: str) -> bool:
    """Whether a word between others is certainly a unit: the kN of ``force_kN_filtered``."""
    return (len(word) > 1 or word == "N") and not known_word(word) and tabulated_unit(word) is not None


def _unit_at_end(text: str, timed: bool) -> tuple[str, str]:
    """Split ``force_kN``, ``Kraft in N``, ``F / N``, ``Moment N mm`` into the name and its unit, or an empty text."""
    slash = re.fullmatch(r"\s*([^\s_/]+|\S.*?\s)/\s*(\S.*)", text)
    if slash and (_is_unit(slash[2]) or not _names_something(slash[2])):
        return slash[1].strip(), slash[2]
    tokens = [token for token in re.split(r"[_\s,;|=]+", text) if token]
    for count in (2, 1):
        unit = "".join(tokens[-count:])
        found = tabulated_unit(unit) if len(tokens) > count else None
        if found is None or (count == 2 and found.measured != "moment"):
            continue
        if count == 2 and tokens[-2] == "in" and name_quality(plain_name(" ".join(tokens[:-2])), "force"):
            continue  # "Force in lbf" is no moment
        if unit.lower() == "min" and not (timed and unit == "min"):
            continue  # the smallest value, or doubtful
        if POWER.fullmatch(tokens[-count - 1]) or is_range(tokens[: len(tokens) - count], text):
            # "Force x10 N" is not in N, and "Load Cell 500 N" gives the range of a sensor.
            return " ".join(tokens[: -count - 1]), " ".join(tokens[-count - 1 :])
        return " ".join(token for token in tokens[:-count] if token.lower() not in ("in", "/")), unit
    match = re.fullmatch(r"(\S.*?)\s+in\s+(\S+)", text.strip())
    if match and not _names_something(match[2]):
        return match[1], match[2]
    match = re.fullmatch(r"(.+)[-.]([^-.\s]+)", text.strip())
    if match and _is_unit(match[2]):
        return match[1], match[2]
    return text, ""


def _are_units(parts: Sequence[str]) -> bool:
    """Whether the parts of a text are factors of a unit: one of them is known, and none is a word of a name."""
    known = [tabulated_unit(part.rstrip("²³")) is not None for part in parts]
    return any(known) and not any(
        known_word(part) and not unit and not part.isdigit() for part, unit in zip(parts, known, strict=True)
    )


def _is_unit(text: str) -> bool:
    """Whether a text is a unit of the table that is not also a word for the smallest value."""
    return tabulated_unit(text) is not None and text.lower() != "min"


def _names_something(text: str) -> bool:
    """Whether a text contains a word of a name, so that it is not a unit: the "unload force" of "load/unload force"."""
    return any(known_word(word) and len(word) > 1 for word in re.findall(r"[^\W\d_]+", text))
