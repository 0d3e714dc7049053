"""What the lines above a table state of its columns: units, factors, and the rate of the samples.

``Force unit: lbf``, ``# units: s, in, lbf`` and ``Kraft in daN`` state units. A factor, ``Force scale factor: 2``, is
never applied, because the numbers may contain it already: if the line says of which column it speaks, the case has to
decide; otherwise it is reported. A rate, ``Sample rate: 100 Hz``, is only proposed: rigs sample faster than they save.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.match import NamedColumn, WantedColumn
from bushcli.recording.header.name import Heading, heading
from bushcli.recording.header.name_parts import number_of
from bushcli.recording.header.units import Unit, certain_unit, find_unit, is_unit, tabulated_unit
from bushcli.recording.quantities import STATIC
from bushcli.recording.source import Quantity, Source, dimension
from bushcli.recording.text.table import LONGEST_LINE, SHOWN, Table

_UNITS = re.compile(
    r"(?i)(?:\b|(?<=[a-zé])(?=U))(?:units?(?:\s+(?:set|system))?|einheit(?:en)?|unités?)\b\W*"
)
#: The label of units of all columns. "Unit: 3" may count the parts under test; "Units: 3" has no unit either.
_LABEL = re.compile(
    r"(?i)\W*(?:units|einheiten|unités|units?\s+(?:set|system)|einheitensystem|system\s+of\s+units)"
    r"(?:\s+(?:set\s+to|are|used))?"
    r"(?:\s*[:=;,\t|]|\s+in(?=\s+[^\W\d_])|(?<=to)\s|(?<=are)\s)\W*"
)
#: "All values in kN and mm" states units; "Data in file 3" does not.
_IN = (
    r"\W*(?i:(?:(?:all|alle|toutes?|les)\s+)*(?:values?|data|results?|measurements?|channels|columns|werte|messwerte"
    r"|daten|valeurs)\s+(?:(?:are|is|sind|sont|given|recorded|angegeben)\s+)*in\s+)"
)
_VALUES = re.compile(_IN)
_ALL = re.compile(r"\W*(?:all|alle|toutes)\b", re.IGNORECASE)
#: A statement ends at these, or after a unit in brackets.
_ENDS = re.compile(r"[,;\t|]|(?<=[\])])")
#: Words between units; "in" before a unit is a preposition: "all values in mm".
_JOINING = re.compile(
    r"(?i)\b(?:and|und|et|all|alle|are|set|to|used|the|values?)\b|\bin\s+(?=[^\W\d_])|[:=]|\.(?=\s|$)"
)
#: Systems of units, which do not say in which unit a column is, and where their names stand. "US" is no unit there,
#: and "us" no system.
_NAME = (
    r"(?:(?:US|U\.S\.|SI|MKS|CGS|FPS|cgs|mks|USCS)(?![\w-])(?:[ -][Cc]ustomary)?"
    r"|(?i:(?:us|u\.s\.)[ -]customary|imperial|english|british|metric|metrisch|customary|inch[ -]pound)(?![\w-]))"
)
_SYSTEMS = (
    # "Units" anywhere; "unit" and "system" at the beginning, for "Business unit: US" is none.
    re.compile(
        r"(?i:\b(?:units|einheiten|unités)(?:[ -]?(?:set|system))?|^\W*unit(?:[ -]?(?:set|system))?|^\W*einheitensystem"
        rf"|^\W*system(?:[ ]of[ ]units)?)\W{{0,9}}(?i:(?:set to|are|is|in|used)?)[\W_]{{0,9}}({_NAME})"
    ),
    re.compile(rf"(?<![\w-])({_NAME}[ -](?i:units?|einheiten|unit system))\b"),
    re.compile(rf"^{_IN}({_NAME})"),
    re.compile(r"\b(imperial|(?:us|u\.s\.)[ -]customary|inch[ -]pound)\b", re.IGNORECASE),
)
#: "Force in 0.1 N", "Kraft in Skalenteilen".
_IS_UNIT = re.compile(r"\s*([^\W\d_][^:=]*?)(?:\s*[:=]\s*|\s+in\s+)(\S.*?)\s*")
_IN_UNIT = re.compile(r"\s*([^\W\d_].*?)\s+in\s+(\S+(?:\s+\S+){0,2})\s*")
_QUANTITIES: tuple[Quantity, ...] = ("time", "displacement", "force")
#: Longest unknown word after "Values in" that may be a unit, and number of words that may be.
_SHORT = 4
_MOST = 10
#: Words of a statement that belong to no name of a column.
_ABOUT = re.compile(r"(?i)\b(?:all|alle|toutes?|les|is|are|in|of|(?:channel|kanal)\b\s*\d*)(?!\w)|[:=]")
#: "Length unit: inch" is about the column of a length; "Gauge length unit: mm" is not.
_LENGTH = re.compile(
    r"(?i)^\W*(?:(?:lengths?|distances?|längen?)(?=[\s_-]*(?:units?|einheit))"
    r"|units?\s+(?:of|for)\s+(?:lengths?|distances?)\b)"
)
#: "Force unit: foo", "Unit of force = foo": the label without its colon, and what it says.
_OF_QUANTITY = re.compile(r"([^:=;,\t|]*)[:=;,\t|]+\s*(\S.*)")

_N = r"\d+(?:[.,]\d+)?(?:[eE][-+−]?\d+)?"
#: What names a factor.
_CALLED = re.compile(
    r"(?i)(?:\b|(?<=[a-z])(?=[FS]))\w{0,20}(?:scale|scaling|gains?|multipliers?|factors?|faktor(?:en)?|skalierung"
    r"|verstärkung|multiplikator(?:en)?|facteurs?|échelle|fattore|fattori|factores|moltiplicatore|multiplicador)\b"
    r"|\b(?:multipl(?:y|ied)|divided?)\b|\w{0,10}multiplizier\w*|\bdividier\w*|系数|比例|倍率|係数"
    rf"|\b(?:in|units?|einheiten|multiples|vielfachen?)\s+(?:of|von)\s+(?={_N})|(?<![^\W_])(?<!\*)[x×*]\s*(?={_N})"
)
#: A factor in words, or before a unit: "Force in thousands", "Kraftwerte in 1000 N".
_WORDED = re.compile(
    r"(?i)\b(?:in|en)\s+(?:tens|hundreds?|thousands?|millions?|tausend(?:er)?|hundert|milliers|miles|migliaia)\b"
    r"|\b(?:forces?|loads?|values?|kräfte|\w*werte|\w*wege?|\w*kraft|displacements?)\s+(?:are\s+)?in\s+10+\s+[^\W\d_]"
)
#: What else is called so.
_OTHER = re.compile(
    r"(?i)\b(?:pid|[pid] ?gain|gain ?[pid]|full|safety|shape|form|loss|damping|filter|drawing|stretch|rate|speed"
    r"|temperature|sensitivity|gau?ge|k|power|crest|formfaktor|verlustfaktor|sicherheitsfaktor|k-faktor|zoom|plot|axis"
    r"|graph|display|anzeige|diagramm?)\b|\d\s*x\s*\d"
)
#: What a column in units of force or length contains already, or what says so.
_CONTAINED = re.compile(
    r"(?i)gain|ampli|verstärk|calib|kalib|\bcal\b|étalon|\btar|already|applied|included|corrected|bereits|enthalten"
    r"|korrigiert|angewendet|incluse?"
)
_ABOUT_FACTOR = re.compile(
    r"[:=;,\t|()\[\]*×]|\b(?:of|for|by|de|von|für|mit|values?|werte?|in|channel|kanal)\b"
)
_EVERY = re.compile(r"\b(?:all|alle|allen|toutes?|tous|tutti|todos|todas)\b", re.IGNORECASE)
#: A number without a unit; behind "in units of" the unit is that of the column.
_BARE = re.compile(rf"(?<![\w.,:]){_N}(?![\w:]|[.,]\d|\s*[^\W\d_]|\s*%)")
_NUMBER = re.compile(rf"(?<![\w.,]){_N}(?![\w]|[.,]\d)")

_RATE = (
    r"(?:(?:sampl(?:e|ing)|scan(?:ning)?|acquisition|data|logg(?:er|ing)|daq|storage)[\s_-]*(?:rate|freq(?:uency|\.)?)"
    r"|(?:abtast|mess|speicher|aufzeichnungs)[\s_-]*(?:rate|frequenz)|fréquence d.échantillonnage|f_?s)"
)
_STEP = (
    r"(?:(?:sampl(?:e|ing)|scan(?:ning)?|acquisition|logg(?:er|ing)|storage)[\s_-]*(?:interval|period|time|step)"
    r"|(?:abtast|mess|speicher)[\s_-]*(?:intervall|zeit)|pas d.échantillonnage|time[\s_-]*step|delta[\s_-]*t|[dΔ]t)"
)
#: A label, a unit in brackets, a number, a unit: "Sampling rate [Hz] = 100", "dt: 0.01 s".
_STATEMENT = re.compile(
    rf"(?i)(?:^|[;,\t|])\W*(?:(?P<rate>{_RATE})|(?P<step>{_STEP}))\W*?"
    r"(?:[\[(]\s*(?P<inside>[^\])]{1,20})[\])])?\s*[:=;,\t|\s]+"
    r"(?P<value>\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)[ \t;|]*(?P<behind>[^\s;,|]*(?: per s\w*)?)"
)
#: Units of a rate, in hertz or kilohertz.
_HERTZ = re.compile(
    r"(?i)(k?)(?:hz|s/s)|1/s|s\^?-1|sps|(?:samples|pts|points)/s|samples/(?:sec|second)|samples per (?:s|sec|second)"
)
#: Largest relative difference of a rate and an interval that say the same: both are rounded to three digits.
_SAME = 5e-3


def stated_units(table: Table, wanted: WantedColumn, explicit: bool = False) -> list[tuple[int, Unit]]:
    """Return the units of a quantity that the lines above a table state, each with the number of the line.

    A number before a unit makes it a value, such as the range of a sensor, and no statement.
    """
    statements: list[tuple[int, Unit]] = []
    for number, line in table.preamble:
        if explicit and not (_UNITS.search(line[:LONGEST_LINE]) or _VALUES.match(line)):
            continue
        text = _plain(line)
        parts = _ENDS.split(text)
        # "Travel;in;Force;lbf" has each unit behind its name.
        pairs = [f"{name} [{unit.strip()}]" for name, unit in pairwise(parts) if tabulated_unit(unit)]
        listed = _own((find_unit(part, wanted.measured) for part in _parts(_listing(text) or "")), wanted)
        ways = (pairs, [text], re.split(r"[;\t|]", text), parts)
        by_name = (_own([_unit_of_part(part, wanted) for part in way], wanted) for way in ways)
        statements += [(number, unit) for unit in listed or next(filter(None, by_name), [])]
    return statements


def _plain(text: str) -> str:
    """Return a line with "Krafteinheit" in two words, and "displacement" where it states the unit of a length.

    Longer lines are cut: they are no statements, and the search for units in them takes long.
    """
    # A quotation mark alone is an inch.
    text = re.sub(r'"([^"]*)"', r"\1", text[:LONGEST_LINE])
    text = re.sub(r"(?<=[a-zäöüß])(einheit(?:en)?)(?=\W|$)", r" \1", text)
    return _LENGTH.sub("displacement ", text)


def _own(units: Iterable[Unit | None], wanted: WantedColumn) -> list[Unit]:
    """Return the units of the wanted quantity, each once."""
    return list(dict.fromkeys(unit for unit in units if unit and unit.measured == wanted.measured))


def _listing(text: str) -> str | None:
    """Return the units, as written, that a line lists without names of columns: "Units: mm, kN"; None for other lines.

    Names of systems of units, and words between the units, are left out.
    """
    text = text.strip()
    values = _VALUES.match(text)
    label = values or _LABEL.match(text) or _UNITS.match(text)
    behind = text[label.end() :] if label else ""
    rest = _without_words(re.sub(rf"(?<![\w-]){_NAME}", " ", behind))
    lists = all(map(is_unit, _parts(rest))) if values else not any(map(_is_named, _ENDS.split(behind)))
    return rest if label and lists else None


def _without_words(text: str) -> str:
    """Return a list of units without the words between them."""
    return _JOINING.sub(" ", re.sub(r"\s(?:and|und|et)\s", ", ", text))


def _parts(text: str) -> list[str]:
    """Return the units of a list: "mm, N/mm and 0.1 N" has three; "mm / kN", with blanks, has two."""
    parts = []
    for part in (part.strip() for part in _ENDS.split(text)):
        several, words = re.split(r"[-/]", part), part.split()
        units = [tabulated_unit(word) for word in words]
        # Blanks within a unit stand behind a prefix, "Mio N", or in a product, "N m".
        product = [u.measured for u in units if u] == ["force", "length"] and max(map(len, words)) <= 2
        joined = len(words) > 1 and is_unit(part) and (product or None in units)
        if len(several) > 2 and all(map(tabulated_unit, several)):
            parts += several  # mm-kN-s
        elif not part or certain_unit(part) or joined:
            parts.append(part)
        else:
            parts += re.split(r"\s+(?:[/-]\s+)?|(?<=\w)/(?=\w+/\w)|(?<=/\w)/", part)
    return [part for part in parts if part]


def _unit_of_part(part: str, wanted: WantedColumn) -> Unit | None:
    """Return the unit of a quantity that a part of a line states, such as "Kraft in daN" or "forces are in kN"."""
    written = ((head.written or head.doubtful) for head in _heads(part) if wanted.quality(head))
    units = _own((find_unit(texts[0], wanted.measured) for texts in written if len(texts) == 1), wanted)
    return units[0] if units else None


def _heads(part: str) -> list[Heading]:
    """Return a part of a line as a heading, without the word for units; then also in the singular, without "are in"."""
    plain = _UNITS.sub(" ", part)
    # "in" is a unit at the end, and a preposition before one.
    words = _ABOUT.sub(" ", plain).split()
    singular = " ".join(
        word.removesuffix("s") if len(word) > 4 and word.isalpha() and word[-2] != "s" else word
        for word in words
    )
    # "- Force in kN" is an item of a list, not the negative force.
    return [replace(heading(text), formula=False) for text in (plain, singular)]


def stated_system(table: Table) -> tuple[int, str] | None:
    """Return the line above a table, its number and words, that names a system of units: "Units: Imperial"; or None."""
    matches = ((n, form.search(text[:LONGEST_LINE])) for n, text in table.preamble for form in _SYSTEMS)
    return next(((number, match[1]) for number, match in matches if match), None)


def stated_unknown(column: NamedColumn) -> tuple[int, str] | None:
    """Return the line above a table, its number and words, that states an unknown or unsuitable unit; or None."""
    lines = ((number, _plain(text)) for number, text in column.table.preamble)
    plain = ((number, text) for number, text in lines if not any(form.search(text) for form in _SYSTEMS))
    statements = ((n, _unknown_of(text, column.wanted) or _unknown_listed(text, column)) for n, text in plain)
    return next(((number, text[:SHOWN]) for number, text in statements if text), None)


def _unknown_listed(plain: str, column: NamedColumn) -> str:
    """Return what a line lists as units without names, "Units: foo", "Values in V", and what is none of the test."""
    mode, measured = column.wanted.mode, column.wanted.measured
    of_mode = {measured, *(dimension(q, mode.specimen, mode.rotational) for q in _QUANTITIES)}

    def is_own(part: str) -> bool:
        units = ((kind, find_unit(part, kind)) for kind in of_mode)
        return any(unit is not None and unit.measured == kind for kind, unit in units)

    label, values = _LABEL.match(plain), _VALUES.match(plain)
    if label and not any(map(_is_named, _ENDS.split(plain[label.end() :]))):
        parts = [part for part in _parts(_listing(plain) or "") if not part.isdigit()]
        unknown = [part for part in parts if not is_unit(part)]
        foreign = [part for part in parts if not is_own(part)] if column.wanted.quantity != "time" else []
        # No unit in the list is one of the quantity: of one for each column it is the column's own that is wrong.
        by_column = len(parts) == len(column.table.names) > 1
        return parts[column.index] if by_column else " ".join(unknown or foreign)
    parts = _parts(_without_words(plain[values.end() :])) if values and not label else []
    single = len(parts) == 1 and not is_unit(parts[0])
    short = single and len(parts[0]) <= _SHORT and parts[0].isalpha()
    are_units = 0 < len(parts) <= _MOST and all(find_unit(part, measured) for part in parts)
    wrong = short or (single and _ALL.match(plain)) or (are_units and not any(map(is_own, parts)))
    return " ".join(parts) if wrong else ""


def _unknown_of(plain: str, wanted: WantedColumn) -> str:
    """Return what a line states as the unit of a quantity by name and what is none: "Force unit: foo"."""

    def names(label: str) -> bool:
        return any(wanted.quality(head) >= 3 for head in _heads(label))

    of_quantity = _OF_QUANTITY.fullmatch(plain.strip())
    if of_quantity and _UNITS.search(of_quantity[1]) and names(of_quantity[1]):
        return of_quantity[2].strip()
    label = _LABEL.match(plain)
    unknown = []
    for part in _ENDS.split(plain[label.end() :] if label else plain):
        pair = (_IS_UNIT if label else _IN_UNIT).fullmatch(part)
        if pair and names(pair[1]):
            sure = label or " " not in pair[2] or any(map(tabulated_unit, pair[2].split()))
            unknown += [pair[2]] if sure else []
        for head in _heads(part):
            # "Force: 25 kN" is a value, and a name with words beside it is a sentence.
            texts = [text for text in head.written if label or not text[:1].isdigit() or certain_unit(text)]
            unknown += texts[:1] if wanted.quality(head) >= 3 and ":" not in part else []
    return unknown[0] if unknown else ""


def _is_named(part: str) -> bool:
    """Whether a part of a list has the name of a quantity: "Force=N" in "units: Time=s, Force=N"."""
    is_quantity = any(head.quality(kind) for head in _heads(part) for kind in STATIC)
    return is_quantity and len(part) > 1 and not is_unit(part)


@dataclass(frozen=True)
class StatedFactor:
    """A line above a table that states a factor other than 1.

    Attributes
    ----------
    line : int
    text : str
    by_column : tuple of float or None
        Factor of each column of the table, where the line lists one for each; None for a column without one. Empty for
        other lines.
    """

    line: int
    text: str
    by_column: tuple[float | None, ...] = ()

    def is_of(self, index: int) -> bool:
        """Whether the line lists a factor of a column."""
        return bool(self.by_column) and self.by_column[index] not in (None, 1.0)

    def concerns(self, column: NamedColumn) -> bool:
        """Whether the line certainly speaks of a column that is read."""
        # What the line may be about, without the words of the factor and its numbers: "Force" of "Force scale: 2".
        plain = re.sub(r"\b(?:in|en)\s+(?:\w+s\b|\d+|tausend|hundert).*", " ", self.text)
        words = _ABOUT_FACTOR.sub(" ", _NUMBER.sub(" ", _CALLED.sub(" ", plain))).split()
        singular = (word.removesuffix("s") if len(word) > 4 else word for word in words)
        is_mentioned = any(column.wanted.quality(heading(" ".join(p))) >= 2 for p in (words, singular))
        every = _EVERY.search(self.text) is not None
        spoken = column.wanted.quantity != "time" if every else is_mentioned
        return self.is_of(column.index) if self.by_column else spoken


def refuse_factor(column: NamedColumn, source: Source) -> None:
    """Refuse a column of which a line above the table states a factor."""
    for stated in stated_factors(column.table):
        if stated.concerns(column) and not _CONTAINED.search(stated.text):
            what = f'"{stated.text[:SHOWN]}" states a factor of {column.label}; the numbers may contain it already'
            unit = column.table.units[column.index] or next(iter(column.head.written), "") or "..."
            decided = f'units = {{{column.wanted.quantity} = "{unit}"}} in the table of the case file'
            # A path of six motions has no such key.
            decided = decided if source.six is None else "delete the line"
            expected = f"{decided} if they do; otherwise multiply them in the file"
            raise RecordingError(Problem(f"{column.table.path}:{stated.line}", what, "", expected))


def factor_remarks(table: Table, taken: Collection[int]) -> list[str]:
    """Return a remark about each line that states a factor of a column that was read, or that does not say of which."""
    return [
        f'line {factor.line} states a factor ("{factor.text[:SHOWN]}"), which was not applied: if the numbers '
        "of the table still have to be multiplied by it, change them in the file"
        for factor in stated_factors(table)
        if not factor.by_column or any(map(factor.is_of, taken))
    ]


def stated_factors(table: Table) -> list[StatedFactor]:
    """Return the lines above a table that state a factor other than 1."""
    factors = []
    for number, text in table.preamble:
        text = text[:LONGEST_LINE].strip()
        called = _CALLED.search(text)
        worded = _WORDED.search(text) is not None
        if not worded and (called is None or _OTHER.search(text)):
            continue
        row = () if worded else _row(text, len(table.names))
        numbers: list[str] = []
        if called and not worded and not row:
            # The number may stand before a verb, and with a unit behind "units of".
            verb = called[0].lower().startswith(("multipl", "divid")) or "multiplizier" in called[0].lower()
            bare = _NUMBER if verb or re.search(r"\s(?:of|von)\s*$", called[0]) else _BARE
            numbers = bare.findall(text if verb else text[called.start() :].lstrip("xX×* "))
        if worded or any(number_of(number) != 1.0 for number in numbers) or set(row) - {None, 1.0}:
            factors.append(StatedFactor(number, text, row))
    return factors


def _row(text: str, width: int) -> tuple[float | None, ...]:
    """Return the factor of each column of a table from a line with a label and a number for each; empty for others."""
    rows: list[tuple[float | None, ...]] = []
    for delimiter in (r"[;\t|]", ",", r"\s+"):
        label, *fields = [field.strip() for field in re.split(delimiter, text)]
        values = [number_of(field) if re.fullmatch(_N, field) else None for field in fields]
        count = len(values) - values.count(None)
        whole = all(value is not None or not field for value, field in zip(values, fields, strict=True))
        several = count >= 2 or (count == 1 and delimiter == r"[;\t|]" and len(fields) > 1)
        if several and label and whole and len(values) in (width - 1, width):
            rows.append((*[None] * (width - len(values)), *values))
    return rows[0] if rows else ()


def rate_remarks(table: Table) -> list[str]:
    """Return a remark about the sampling rates, in Hz, that the lines above a table without a time state."""
    rates = []
    for number, text in table.preamble:
        for match in _STATEMENT.finditer(text[:LONGEST_LINE]):
            unit = (match["inside"] or match["behind"]).strip()
            step = find_unit(unit, "time") if unit and match["step"] else None
            # A step in seconds is one over a rate; 0 where the unit is neither.
            seconds = step.factor if step is not None and step.measured == "time" else 0.0
            hertz = _HERTZ.fullmatch(unit)
            factor = seconds if match["step"] else 0.0 if hertz is None else 1e3 if hertz[1] else 1.0
            value = number_of(match["value"]) * factor
            if value > 0.0:
                rates.append((1.0 / value if match["step"] else value, number, text.strip()[:SHOWN]))
    if any(abs(hertz / rates[0][0] - 1.0) > _SAME for hertz, _, _ in rates):
        texts = ", ".join(f'line {line} "{text}"' for _, line, text in rates)
        return [f"sampling rates that contradict are stated above the table, and not used ({texts})"]
    return [
        f'line {line} states a sampling rate ("{text}"), which is not used: '
        f"give sample_rate = {hertz:g} if the rows of the table have it"
        for hertz, line, text in rates[:1]
    ]
