"""Units and numbers in the name of a column outside of brackets: ``force_kN_filtered``, ``Force x 10``, ``Force ±25``.

A unit stands at the end, between words, or is doubtful. A number without a unit is a range, a factor, which is never
applied, or the number of a channel.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

from bushcli.recording.header.units import COUNTED, Unit, find_unit, tabulated_unit
from bushcli.recording.header.vocabulary import NUMBERED_WORDS, POWER, kinds_of, known_word

#: What a text means as a unit.
UnitReader = Callable[[str], Unit | None]
#: Kinds of units that are written in two words: "N mm", "N s/mm".
_PRODUCTS = ("moment", "damping", "rotational damping")
#: Before a factor among the units of a column.
FACTOR = "factor"
_INCH_FIRST = re.compile(r"\s*in[\s_](?!phase|plane)", re.IGNORECASE)
#: A product or quotient of units after a name: the "N/s" of "Force_N/s", the "kN·m" of "Moment kN·m filtered".
_COMPOUND = re.compile(r"(?<=[\s_,;:|=./-])[^\W\d_]+[²³]?(?:[·⋅×*/^][^\W_]+)+")
#: Units at the end: "ft-lb", a foot, and none.
_HYPHENED = re.compile(r"(?<=[\s_,;:|=])[^\W\d_]+-[^\W\d_]+$")
_FOOT = re.compile(r"^(.*\w)[\s_,;:.=-]*['′]$")
_ABSENT = re.compile(r"(?<![^\W_])n\s*/\s*a\.?$", re.IGNORECASE)
#: A number before a unit, such as the range of a sensor.
_NUMBER = re.compile(r"\d+(?:[.,/]\d+)?k?")

_SIGNED_NUMBER = r"\d+(?:[.,]\d+)?(?:[eE][-+−]?\d+)?"
#: A factor in a name, with its number in a group: "Force/10", "2*Force", "2x Force", "Travel x 0.1", "Gain 5". An upper
#: X before a number may be an axis; "Force 2 x" may be the axis x of the second sensor.
_TIMES = re.compile(
    rf"(?:[×*÷·/]|(?<![^\W_])x)\s*(?P<behind>[-+−]?{_SIGNED_NUMBER})"
    rf"|(?<![\w.,])(?P<before>[-−]?{_SIGNED_NUMBER})(?:\s*[×*]|x(?![^\W_]))|^\W*(?P<first>{_SIGNED_NUMBER})\s+x(?=[\s_])"
    rf"|(?<![^\W_])(?:scale|scaling|gain|factor|faktor|multiplier)\W*(?P<called>{_SIGNED_NUMBER})"
)
#: A power of ten or another number that cannot be that of a channel: "10^3", "e-3", "1e3", "E3", "0.5 Force".
_TENS = re.compile(
    r"(?<![\d.])10\s*\^\s*[-+−]?\d+|(?<![\d.])10[⁻⁺]?[¹²³⁴-⁹]+|X\s*10+(?![\d.])"
    r"|(?<![^\W_])(?:\d+(?:[.,]\d+)?)?(?:[eE][-+−]\d+|e\d+)(?![^\W_])|(?<![^\W_])(?:\d[\d.,]*E\d+|E[3-9])(?![^\W_])"
    r"|^\W*\d+[.,]\d+(?=\s)|(?<![\w.,])0[.,]\d+\W*$"
    # Thousands as in accounts: "'000 N", "000's N".
    r"|['’‘´`]0+(?![^\W_]|[.,]\d)|(?<![\w.,])0{2,}['’]?s(?![^\W_])"
)
#: Factors in words; a prefix apart from its unit, "Force mega N", at the end of the name, after which the unit stood.
_WORDED = re.compile(
    r"(?i)(?<![^\W_])(?:(?:ten|hundred|thousand|million)(?:th)?s?|tsd|tausend(?:stel)?|hundertstel|zehntel)(?![^\W_])"
)
_PREFIX = re.compile(r"(?<![^\W_])(?:giga|mega|kilo|hecto|deca|deci|centi|milli|micro)\W*$", re.IGNORECASE)
#: Before the "/50" in the type of a sensor, WA/50, S9M/5kN, and before the "/-25" of a range, +/-25.
_TYPE = re.compile(r"(?<![^\W_])(?:WA|[A-EG-QS-Z]\d+[A-Z]\w*)$|\+$")

_N = r"\d+(?:[.,]\d+)?"
#: No further digit, letter, degree or percent behind a number: these would belong to it.
_END = r"(?![\w°%]|[.,]\d|\s*[°%])"
#: A range with its sign: "±25", "+/- 2.5", "< 25", "-25...+25", "-25 to 25", "0-10".
RANGE = re.compile(
    rf"(?:±|\+\s*/?\s*[-−–]|(?<![<>=])[<≤]=?)\s*{_N}{_END}(?!\s*k?[^\W\d_])"
    rf"|(?<![\w.,])(?:[-−–]\s*{_N}|0)\s*(?:\.{{2,}}|…|[-–/]|to\b|bis\b|à\b)\s*\+?\s*{_N}{_END}(?!\s*k?[^\W\d_])"
)
#: A number that stands alone. Behind a hyphen or a slash it belongs to the word before it: "LC-1500", "1-2".
_ALONE = re.compile(rf"(?<![^\W_])(?<![.,:/−–-]){_N}{_END}(?![-:/]\d)")
_BEFORE = re.compile(r"(#|[^\W\d_]+)[\s._:,(-]*$")
#: Words before the number of a test or a device.
_COUNTING = NUMBERED_WORDS | {
    "run", "test", "specimen", "sample", "probe", "part", "versuch", "messung", "serie", "series", "id", "sn", "module",
    "modul", "slot", "port", "#",
}  # fmt: skip
#: A word beside a range.
RANGE_WORDS = frozenset({"range", "bereich", "messbereich", "plage", "gamme", "campo", "rango"})
#: Smallest whole number that is more likely a range or a factor than the number of a channel; judgement.
_LARGE = 100


def units_within(text: str, timed: bool, known: UnitReader = tabulated_unit) -> Iterator[tuple[str, str]]:
    """Yield the ways to split a name without brackets into the name and its unit, wherever that is, the surest first.

    The last one has an empty text in place of a unit.
    """
    for match in _COMPOUND.finditer(text):
        if _are_units(re.split(r"[·⋅×*/^]", match[0])):
            yield text[: match.start()] + " " + text[match.end() :], match[0]
    for match in _HYPHENED.finditer(text):
        if _are_units(match[0].split("-")):
            yield text[: match.start()], match[0]
    yield from ((match[1], "'") for match in _FOOT.finditer(text))
    yield from ((text.replace(sign, " "), sign) for sign in "%‰" if sign in text)
    yield from ((text[: match.start()], match[0]) for match in _ABSENT.finditer(text))
    yield from _units_at_end(text, timed, known)


def _units_at_end(text: str, timed: bool, known: UnitReader) -> Iterator[tuple[str, str]]:
    """Yield the units at the end of a name: ``force_kN``, ``Kraft in N``, ``F / N``, ``Moment N mm``."""
    slash = re.fullmatch(r"\s*([^\s_/]+|\S.*?\s)/\s*(\S.*)", text)
    if slash and (_is_unit(slash[2], known) or not _names_something(slash[2])):
        yield slash[1].strip(), slash[2]
    tokens = [token for token in re.split(r"[_\s,;|=]+", text) if token]
    for count in (2, 1):
        unit, before = "".join(tokens[-count:]), tokens[:-count]
        read = known(unit) if before else None
        if read is None or (count == 2 and read.measured not in _PRODUCTS):
            continue
        # "Force in lbf" is no moment; "min" is the smallest value, or doubtful.
        force = count == 2 and tokens[-2] == "in" and "force" in kinds_of(" ".join(before))
        if force or (unit.lower() == "min" and not (timed and unit == "min")):
            continue
        if POWER.fullmatch(before[-1]) or _is_range(before, text):
            # "Force x10 N" is not in N, and "Load Cell 500 N" gives the range of a sensor.
            yield " ".join(before[:-1]), " ".join(tokens[-count - 1 :])
        yield " ".join(token for token in before if token.lower() not in ("in", "/")), unit
    joined = re.fullmatch(r"(\S.*?)\s+in\s+(\S+)", text.strip())
    if joined and not _names_something(joined[2]):
        yield joined[1], joined[2]
    match = re.fullmatch(r"(.+)[-.]([^-.\s]+)", text.strip())
    if match and _is_unit(match[2], known):
        yield match[1], match[2]
    yield text, ""


def with_second_unit(rest: str, written: list[str], timed: bool, known: UnitReader) -> tuple[str, list[str]]:
    """Return a name without the second unit that stands before a first one, and both: ``Travel mm (in)``."""
    first = known(written[0]) if len(written) == 1 else None
    # The first m of "Travel m m" is a prefix.
    prefix = first and _prefix_apart(re.findall(r"[^\W_]+", rest), written[0])
    before, unit = next(_units_at_end(rest, timed, known)) if first and not prefix else (rest, "")
    second = known(unit) if unit and unit.lower() != "in" else None
    are_two = first and second and second.measured == first.measured
    return (re.sub(r"\s+in\s*$", "", before), [*written, unit]) if are_two else (rest, written)


def inner_units(shown: list[str], rest: str) -> tuple[list[str], list[str]]:
    """Return the words of a name without the units between them, ``force_kN_filtered``, and these units.

    The "5 kN" of "5 kN cell" is one.
    """
    units = [
        i
        for i, word in enumerate(shown[1:-1], start=1)
        if (len(word) > 1 or word == "N") and not known_word(word) and tabulated_unit(word) is not None
    ]
    ranges = [i for i in units if _is_range(shown[:i], rest)]
    written = [f"{shown[i - 1]} {shown[i]}" if i in ranges else shown[i] for i in units]
    for i in units:
        prefix = _prefix_apart(shown[:i], shown[i]) or _prefix_apart(shown[i + 1 :][:1], shown[i])
        written += [f"{FACTOR} {prefix}"] if prefix else []
    removed = {*units, *(i - 1 for i in ranges)}
    return [word for i, word in enumerate(shown) if i not in removed], written


def numbers_or_doubts(shown: Sequence[str], rest: str, has_unit: bool) -> tuple[list[str], list[str]]:
    """Return the number in a name that may be a range or a factor, with its unit, or else the doubtful words."""
    doubtful = [word for word in shown if not known_word(word)]
    # "t" is a time at the beginning of a name and may be tonnes at its end; V is a direction or volts, "at" a pressure.
    doubtful += [word for word in shown[1:][-1:] if word in ("t", "V", "at", "At", "AT")]
    # "Load #" is in pounds or counts loads; "disp_in_raw" may be in inches.
    doubtful += ["#"] * (re.search(r"[\s,;_]#\s*$", rest) is not None)
    doubtful += ["in"] * ("_in_" in rest.lower() or _INCH_FIRST.match(rest) is not None)
    numbers: list[str] = []
    for word in doubtful:
        index = shown.index(word) if word in shown else 0
        glued = re.fullmatch(r"\d+(?:[.,]\d+)?([^\W\d_]+)", word)
        if _is_range(shown[:index], rest) and any(find_unit(word, kind) for kind in ("force", "length")):
            numbers.append(f"{shown[index - 1]} {word}")
        elif glued and tabulated_unit(glued[1]) is not None and not has_unit:
            numbers.append(word)
    only_digits = not has_unit and all(word.isdigit() for word in doubtful)
    numbers += loose_numbers(rest) if only_digits and not numbers else []
    return numbers[:1], [] if numbers or only_digits else doubtful


def prefix_of(rest: str, written: Sequence[str], bracketed: bool) -> str:
    """Return the prefix that stands apart from the unit of a name, "Force k N"; an upper "Kraft K [N]" is a symbol."""
    words = re.findall(r"[^\W_]+", rest)
    symbol = bracketed and words and words[-1].isupper()
    return _prefix_apart(words, written[0]) if len(written) == 1 and not symbol else ""


def _prefix_apart(words: Sequence[str], unit: str) -> str:
    """Return the prefix that a blank or a sign separates from its unit, ``Force k N``, or an empty text."""
    last, known = words[-1] if words else "", tabulated_unit(unit)
    joined = tabulated_unit(last + unit) if last and known else None
    scaled = known and joined and joined.measured == known.measured and joined.factor != known.factor
    # M is the symbol of a moment.
    short = known and len(last) <= 2 and not (last == "M" and known.measured == "moment")
    return last if last.lower() in COUNTED or (short and (last == "k" or scaled)) else ""


def _is_range(words: Sequence[str], text: str) -> bool:
    """Whether the last of the words before a unit in a text is a number, and a range: not that of a channel.

    A name in which underscores stand around the number, force_2_N, numbers the channels.
    """
    numbered = bool(words) and _NUMBER.fullmatch(words[-1]) is not None and f"_{words[-1]}_" not in text
    return numbered and (len(words) == 1 or words[-2].lower() not in NUMBERED_WORDS)


def _are_units(parts: Sequence[str]) -> bool:
    """Whether the parts of a text are factors of a unit: one of them is known, and none is a word of a name."""
    are_units = [tabulated_unit(part.rstrip("²³")) is not None for part in parts]
    words = (part for part, unit in zip(parts, are_units, strict=True) if not unit and not part.isdigit())
    return any(are_units) and not any(map(known_word, words))


def _is_unit(text: str, known: UnitReader) -> bool:
    """Whether a text is a known unit that is not also a word for the smallest value."""
    return known(text) is not None and text.lower() != "min"


def _names_something(text: str) -> bool:
    """Whether a text contains a word of a name, so that it is not a unit: the "unload force" of "load/unload force"."""
    return any(known_word(word) and len(word) > 1 for word in re.findall(r"[^\W\d_]+", text))


def number_of(text: str) -> float:
    """Return a number with a decimal point or comma."""
    return float(text.replace(",", ".").replace("−", "-"))


def largest(text: str) -> float:
    """Return the largest number in a range as written."""
    return max(map(number_of, re.findall(_N, text)))


def factor_in(name: str) -> str:
    """Return the factor that the name of a column contains, as written, or an empty text; a factor of 1 is none."""
    factors = [match[0] for form in (_TENS, _WORDED, _PREFIX) if (match := form.search(name))]
    factors += [
        match[0]
        for match in _TIMES.finditer(name)
        if not (match[0].startswith("/") and _TYPE.search(name[: match.start()]))
        and number_of(in_groups(match)) != 1.0
    ]
    return factors[0].strip() if factors else ""


def ranges_in(text: str) -> list[str]:
    """Return the ranges, as written, that a text gives with a sign and without a unit: ``±25``."""
    return [match[0].strip() for match in RANGE.finditer(text)]


def loose_numbers(name: str) -> list[str]:
    """Return the numbers of a name without brackets that may be factors or ranges: the ``2.5`` of ``Force 2.5``.

    A number behind a word such as "channel", and a whole number of one or two digits, is the number of a channel.
    """
    numbers, name = [], RANGE.sub(" ", name)
    for match in _ALONE.finditer(name):
        before, digits = _BEFORE.search(name[: match.start()]), match[0]
        whole = digits.isdigit()
        counts = (before is not None and before[1].lower() in _COUNTING) or (digits[0] == "0" and whole)
        large = whole and (int(digits) >= _LARGE or POWER.fullmatch(digits) is not None)
        if not counts and (large or (not whole and number_of(digits) != 1.0)):
            numbers.append(digits)
    return numbers


def in_groups(match: re.Match[str]) -> str:
    """Return the text of the only group of a match that took part in it."""
    return next(text for text in match.groups() if text is not None)
