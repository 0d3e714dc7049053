"""Lines above a table of dynamic stiffness, and between its rows: the conditions that they state.

A line states a condition if all of its words are known: ``Preload: 500 N``, ``Static preload 1'500 N``, ``Temperature:
RT (23 °C)``. One that says more, or whose number or unit is not understood, states none. If nothing else states its
condition, ``Preload: 200-500 N`` is asked for with the key that does. What has no number, or names another quantity as
``Storage temperature: 40 °C`` does, gets a remark.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

from bushcli.recording.dynamic.names import DIGITS, Stated, meaning, read_number
from bushcli.recording.dynamic.peaks import FACTORS, Peak, said_of_peak
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.header.units import Unit, read_unit
from bushcli.recording.header.vocabulary import is_foreign, plain_name
from bushcli.recording.quantities import CONDITIONS, DYNAMIC, word_set
from bushcli.recording.text.table import SHOWN, Table, TextTable

_DIGITS = rf"(?:[1-9]\d{{0,2}}(?:[ \u00a0\u202f]\d{{3}})+(?:[.,]\d+)?(?!\d)|{DIGITS})"
#: A label, a number, and what follows it. A digit may stand in brackets of the label, "Amplitude (0-peak)".
_LINE = re.compile(
    r"\s*[#%/]*\s*(?P<label>(?:[^:=;\t\d(\[]|\([^)]*\)|\[[^\]]*\])+?)(?P<sign>\s*[:=;,\t][:=;,\t\s]*|\s+(?![\s(]))"
    r"(?P<prefix>(?i:~|≈|ca\.?|approx\.?|about|etwa|rt|room temperature|raumtemperatur)?\s*\(?\s*)"
    rf"(?P<number>(?:±|\+/-|[-+]|minus\b)?\s?{_DIGITS})(?![.,'’]?\d)"
    rf"(?P<tolerance>\s*(?:±|\+/-)\s*{_DIGITS})?(?P<rest>.*)"
)
#: A label and something else than a number.
_LABELLED = re.compile(r"\s*[#%/]*\s*(?P<label>[^:=;\t]+)(?:[:=]\s*\S|[;\t]\s*[^;\t\s][^;\t]*$)")
#: A unit between a label and a number, "Preload;N;500", and where the next statement of a line begins.
_UNIT_BEFORE = re.compile(r"([^:=;\t]+)[:=;\t]\s*([^\d:=;,\t]+?)\s*[:=;\t]\s*(?=[-+±]?\d)")
_NEXT = re.compile(r"[,;\t]\s*(?=[^\W\d_][^:=;,\t\d]*[:=]\s*\S)")
#: One or two words in which a unit may stand behind a number.
_UNIT = re.compile(
    r"[\s;,\t\[(]*(?P<two>(?P<one>[^\W\d]*[^\s\d;,\t\])(±~+-][^\s;,\t\])(]*)(?: [^\s;,\t\])(]+)?)"
)
_NUMBER = re.compile(rf"(?<![\w.,]){DIGITS}\s*(?P<unit>[^\W\d_]+|[°%]\w*)?")
_BRACKETS = re.compile(r"[(\[]([^)\]]*)[)\]]")
_TOLERANCE = re.compile(rf"(?:±|\+/-)\s*{DIGITS}(?:\s*[^\W\d_]+|\s*[°%]\w*)?")
#: The last parts of compounds.
_COMPOUND = re.compile(r"(?<=[^\W\d_]{3})(temperatur|frequenz|amplitude|vorlast|vorkraft)$", re.IGNORECASE)
#: Longer lines are no statements, and take long to match.
_LONGEST = 300
#: Rows in which a decimal sign is looked for.
_LOOKED_AT = 100
#: A value of another quantity behind a number and its unit, "500 N @ 23 °C", and one in brackets, "500 N (51 kg)".
_ALSO = re.compile(
    rf"[,(\s@]+(?:(?:at|bei)\s+)?(?P<value>(?:[-+]|minus\b)?\s?{DIGITS}\s*(?P<unit>[^\W\d_]+|°\w+)).*"
)
_IN_BRACKETS = re.compile(
    rf"[(\[]\s*[=~≈]?\s*(?P<number>[-+]?{DIGITS})\s*(?P<unit>[^\W\d_]+|[°%]\w*)\s*[)\]]"
)
#: Relative difference up to which the value in brackets is the one before it, rounded; and that of temperatures, K.
_ROUNDED, _ROUNDED_KELVINS = 0.05, 1.0
#: Quantities that a unit names, and the word for each.
_BY_UNIT = {"frequency": "frequency", "temperature": "temperature", "preload_force": "preload"}
#: Words that make a line one about another quantity than the condition that it names.
_OTHER = word_set(
    "conditioning conditioned konditionierung konditionierungs storage lagerung lagerungs after before nach vor sensor"
    " accuracy genauigkeit resolution auflösung stability stabilität calibration kalibrierung kalibrier toleranz grenz"
    " preconditioning cure curing vulkanisations axial radial torsional conical cardanic kardanisch torsion uniaxial"
)
#: Words of a label beside those of its quantity, which change nothing, and words behind the number.
_ALWAYS = word_set(
    "test tests prüf versuchs versuch actual measured ist the of at bei in during applied constant konstant level"
    " niveau"
)
_BESIDE = {
    "frequency": _ALWAYS | word_set("excitation erreger"),
    "amplitude": _ALWAYS | word_set("excitation erreger vibration sine sinus oscillation motion"),
    "preload": _ALWAYS | word_set("force kraft last displacement weg pre"),
    "temperature": _ALWAYS
    | word_set(
        "chamber specimen sample rubber part proben kammer room ambient raum umgebung umgebungs klimakammer"
    ),
}
_BEHIND = word_set(
    "compression compressive tension tensile druck zug constant const konstant static statisch sinus nominal at bei"
    " sinusoidal sine sinusförmig hold held holding gehalten haltezeit setpoint sollwert soll"
)


#: Words of the climate behind the number, "23 °C (room temperature), 50 % RH".
_CLIMATE = word_set("room ambient temperature raumtemperatur rt rh humidity relative rel luftfeuchte feuchte")


@dataclass(frozen=True)
class ConditionLine:
    """A line that names a condition.

    Attributes
    ----------
    line, text : int, str
        Its number and text.
    quantity : str
        One of `CONDITIONS`.
    stated : Stated, optional
        What it states; None where it does not do so for certain.
    doubtful : bool
        Whether it has a number that is not understood, and no word says that it is another quantity.
    """

    line: int
    text: str
    quantity: str
    stated: Stated | None
    doubtful: bool = False

    @property
    def place(self) -> str:
        """Number and text of the line in messages."""
        return f'line {self.line} ("{self.text.strip()[:SHOWN]}")'


def condition_line(text: str, decimal: str = "", mode: str = "", line: int = 0) -> ConditionLine | None:
    """Return what a line says of a condition; None where it names none.

    Parameters
    ----------
    text : str
    decimal : str
        Decimal sign of the table; empty if its numbers do not show it.
    mode : str
        Name of the mode: a preload may be called by it.
    line : int
    """
    before, plain = _UNIT_BEFORE.match(text), text
    if before and read_unit(before[2]) is not None:
        plain = f"{before[1]} [{before[2]}];{text[before.end() :]}"
    match = _LINE.match(plain)
    if match is None:
        labelled = _LABELLED.match(text)
        label = _plain_label(labelled["label"]) if labelled else ""
        quantity = meaning(label).quantity
        known = quantity in CONDITIONS and not _unknown_words(label, quantity, "", mode)
        has_number = labelled is not None and any(c.isdigit() for c in text[labelled.end("label") :])
        return ConditionLine(line, text, quantity, None, has_number) if known else None
    unit_text, rest = _unit_behind(match["rest"])
    label = _plain_label(match["label"])
    column = meaning(label, unit_text)
    quantity, unit = column.quantity, column.unit
    if (
        quantity == "preload"
        and unit is None
        and any(_is_load(found["unit"]) for found in _NUMBER.finditer(rest))
    ):
        quantity = "preload_force"
    if quantity not in CONDITIONS or (unit is not None and unit.measured not in DYNAMIC[quantity].every_kind):
        return None
    separated = match["sign"].strip() or not re.match(r"[-+±]\s", match["number"])
    unknown = _unknown_words(label, quantity, column.written, mode)
    known = separated and not unknown
    stated = None
    if unit is not None and known and not (match["tolerance"] and quantity == "amplitude"):
        number = read_number(match["number"], decimal)
        behind = _without_repeated(rest, number, unit)
        peak, sure = _behind(behind if quantity == "amplitude" else _TOLERANCE.sub(" ", behind), unit)
        peak = peak or column.peak
        if "±" in match["number"] or "/" in match["number"]:
            peak = "peak" if peak in ("", "peak") else ""
        stated = Stated(quantity, number, unit, peak, match["number"].strip()) if sure else None
    # A number alone behind words that are unknown, "Temperature sensor 2", is none of a condition.
    if not known and unit is None:
        return None
    doubtful = stated is None and not any(word in _OTHER or is_foreign(word) for word in unknown)
    return ConditionLine(line, text, quantity, stated, doubtful)


def states_condition(text: str) -> bool:
    """Whether a line states conditions, so that it may stand between the rows of a table."""
    lines = [condition_line(part) for part in _statements(text)]
    return bool(lines) and all(line is not None and line.stated is not None for line in lines)


def _statements(text: str) -> list[str]:
    """Return the statements of a line: "Preload: 500 N, Temperature: 23 °C" has two."""
    text = re.sub(" +", " ", text)
    if len(text) > _LONGEST:
        return []
    begins = [0]
    for found in _NEXT.finditer(text):
        label = re.split("[:=]", text[found.end() :], maxsplit=1)[0]
        begins += [found.end()] if meaning(_plain_label(label)).quantity in CONDITIONS else []
    parts = (text[begin:end].rstrip(" ,;\t") for begin, end in pairwise([*begins, len(text)]))
    return [statement for part in parts for statement in _with_unlabelled(part)]


def _with_unlabelled(text: str) -> list[str]:
    """Return a statement, and with their labels the values behind it whose unit says that they are another quantity."""
    match = _LINE.match(text)
    unit_text, rest = _unit_behind(match["rest"]) if match else ("", "")
    unit = read_unit(unit_text)
    if (
        match is None
        or unit is None
        or meaning(_plain_label(match["label"]), unit_text).quantity not in CONDITIONS
    ):
        return [text]
    for also in (found for i in range(len(rest)) if (found := _ALSO.match(rest, i))):
        between, other = rest[: also.start()], read_unit(also["unit"])
        plain = plain_name(said_of_peak(between)[1])
        if set(plain.split()) - _BEHIND or re.search(r"[;\t]", between):
            break
        key = _named_by_unit(other)
        if key and other is not None and other.measured != unit.measured:
            return [
                text[: len(text) - len(rest) + also.start()],
                *_with_unlabelled(f"{key}: {rest[also.start('value') :]}"),
            ]
    return [text]


def _named_by_unit(unit: Unit | None) -> str:
    """Return the word of the condition that a unit is enough for; an empty text for other units."""
    found = (word for key, word in _BY_UNIT.items() if unit and unit.measured in DYNAMIC[key].every_kind)
    return next(found, "")


def _without_repeated(rest: str, number: float, unit: Unit) -> str:
    """Return a text without a value in brackets that is the number before it in another unit, "500 N (51 kg)"."""

    def repeated(match: re.Match[str]) -> str:
        other = read_unit({"kg": "kgf"}.get(match["unit"], match["unit"]))
        if other is None or other.measured != unit.measured or other == unit:
            return match[0]
        value = other.factor * read_number(match["number"], ".") + other.zero
        rounding = _ROUNDED_KELVINS if unit.measured == "temperature" else 0.0
        same = math.isclose(value, unit.factor * number + unit.zero, rel_tol=_ROUNDED, abs_tol=rounding)
        return " " if same else match[0]

    return _IN_BRACKETS.sub(repeated, rest)


def _is_load(text: str | None) -> bool:
    """Whether a text is a unit of a preload that is a force."""
    unit = read_unit(text or "")
    return unit is not None and unit.measured in DYNAMIC["preload_force"].every_kind


def _plain_label(label: str) -> str:
    """Return a label with the last part of a compound as a word of its own, "Prüf temperatur"."""
    every = {word for key in CONDITIONS for phrase in DYNAMIC[key].words for word in phrase.split()}
    words = re.split(r"(\s+)", re.sub(r"(?<=[(\[])in\s+", "", label))
    return "".join(word if word.lower() in every else _COMPOUND.sub(r" \1", word) for word in words)


def _unit_behind(rest: str) -> tuple[str, str]:
    """Return the unit at the beginning of a text, and what follows it."""
    match = _UNIT.match(rest)
    for key in ("two", "one") if match else ():
        assert match is not None
        if read_unit(match[key]) is not None:
            return match[key], rest[match.end(key) :]
    return "", rest


def _unknown_words(label: str, quantity: str, unit: str, mode: str) -> set[str]:
    """Return the words of a label that are neither its quantity's, nor its unit, nor such as change nothing."""
    quantity = "preload" if quantity == "preload_force" else quantity
    text = _BRACKETS.sub(lambda m: " " if read_unit(said_of_peak(m[1])[1].strip(" ,")) else m[0], label)
    words = set(plain_name(said_of_peak(text)[1]).split()) - set(plain_name(unit).split())
    own = {word for phrase in DYNAMIC[quantity].words for word in phrase.split()}
    return words - own - _BESIDE[quantity] - _BEHIND - {mode}


def _behind(rest: str, unit: Unit) -> tuple[Peak, bool]:
    """Return what stands behind a number and its unit says of an amplitude, and whether the number is the only one."""
    fields = re.split(r"[;\t]", rest)
    # In "0.1;mm;peak" the word has a field of its own; a number there is one of a list.
    following = next((field for field in fields[1:] if field.strip()), "")
    listed = re.match(rf"\s*(?:±|\+/-|[-+])?{DIGITS}", following) is not None
    peak, others = said_of_peak(fields[0])
    said, more = said_of_peak(following)
    peak = peak or ("" if plain_name(more) else said)
    for match in _NUMBER.finditer(others):
        kind = read_unit(match["unit"] or "")
        listed |= kind is None or kind.measured == unit.measured or bool(_named_by_unit(kind))
    return peak, not (listed or set(plain_name(_NUMBER.sub(" ", others)).split()) - _BEHIND - _CLIMATE)


def decimal_of(table: Table, source: DynamicSource) -> str:
    """Return the decimal sign of a table, empty if neither the case file nor its numbers show it."""
    if source.decimal is not None or not isinstance(table, TextTable):
        return source.decimal or ""
    rows = range(min(len(table), _LOOKED_AT))
    texts = (table.text(row, column) for row in rows for column in range(len(table.names)))
    return table.decimal if any(table.decimal in text for text in texts) else ""


def condition_lines(table: Table, source: DynamicSource, between: bool = False) -> list[ConditionLine]:
    """Return the lines above a table, or those between its rows, that name a condition."""
    decimal = decimal_of(table, source)
    lines = table.between if between else table.preamble
    parts = ((line, part) for line, text in lines for part in _statements(text))
    read = (condition_line(part, decimal, source.mode, line) for line, part in parts)
    return [line for line in read if line is not None]


def conditions_above(table: Table, source: DynamicSource, wanted: Iterable[str]) -> dict[str, Stated]:
    """Return the conditions that the lines above a table state for all its rows, by quantity.

    Parameters
    ----------
    table : Table
    source : DynamicSource
    wanted : iterable of str
        Conditions that neither the case file nor a column has.

    Raises
    ------
    RecordingError
        Two lines state different values, or a number has two readings.
    """
    stated: dict[str, Stated] = {}
    lines = condition_lines(table, source)
    for quantity in wanted:
        own = [(each, each.stated) for each in lines if each.quantity == quantity and each.stated is not None]
        for line, condition in own:
            refuse_ambiguous(table, condition, line.place)
        # A line that says what its amplitude is says more than one that does not.
        own.sort(key=lambda pair: not pair[1].peak)
        for line, condition in own[1:]:
            first, peak = own[0][1], condition.peak or own[0][1].peak
            if not math.isclose(
                condition.value * FACTORS[peak], first.value * FACTORS[first.peak], rel_tol=1e-6
            ):
                word = quantity.replace("_", " ")
                what = f"{own[0][0].place} and {line.place} state different values of the {word}"
                raise table.refusal(what, f"{quantity} = ... in the recording's table of the case file")
        if own:
            stated[quantity] = own[0][1]
    return stated


def refuse_ambiguous(table: Table, condition: Stated, where: str) -> None:
    """Refuse a number whose only sign may be the decimal one or separate thousands."""
    if math.isnan(condition.number):
        sign = "," if "," in condition.written else "."
        either = f"{condition.written.replace(sign, '.')} or {condition.written.replace(sign, '')}"
        what = (
            f"{where}: {condition.written} may be {either}, and no number of the table shows its decimal sign"
        )
        raise table.refusal(what, 'decimal = "." or "," in the recording\'s table of the case file')


def conditions_between_rows(
    table: Table, source: DynamicSource, wanted: Collection[str]
) -> list[tuple[int, Stated]]:
    """Return the wanted conditions that lines between the rows state for the rows below, with the lines' numbers."""
    stated = []
    for line in condition_lines(table, source, between=True):
        if line.quantity in wanted and line.stated is not None:
            refuse_ambiguous(table, line.stated, line.place)
            stated.append((line.line, line.stated))
    return stated


def refuse_doubtful(
    table: Table, source: DynamicSource, wanted: Collection[str], stated: Collection[str]
) -> None:
    """Refuse a table with a line that may state a wanted condition, is not understood, and is the only one that may.

    Parameters
    ----------
    table : Table
    source : DynamicSource
    wanted : collection of str
        Conditions that neither the case file nor a column has.
    stated : collection of str
        Those that other lines state.
    """
    lines = (line for between in (False, True) for line in condition_lines(table, source, between))
    for line in lines:
        if line.doubtful and line.quantity in wanted and line.quantity not in stated:
            what = f"{line.place} may state the {line.quantity.replace('_', ' ')}, and is not understood"
            # Without a unit that is understood, a preload may be a force or a displacement.
            keys = ("preload_force", "preload") if line.quantity == "preload" else (line.quantity,)
            asked = " or ".join(f"{key} = ..." for key in keys)
            expected = f"{asked} in the recording's table of the case file"
            raise table.refusal(what, f"{expected}; or delete the line, if it says something else")


def remarks_on_lines(table: Table, source: DynamicSource, wanted: Collection[str]) -> Iterator[str]:
    """Yield a remark about each line that names a wanted condition, and does not state it for certain."""
    for between in (False, True):
        for line in condition_lines(table, source, between):
            if line.stated is None and line.quantity in wanted:
                yield f"{line.place} is not read as a condition; if it is one: {line.quantity} = ... in the case file"
