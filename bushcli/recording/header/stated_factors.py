"""Factors that the lines above a table state: ``Scale factor;1;10;100``, ``Force scale factor: 2``.

None is applied, because the numbers may contain it already. If a line says of which column it speaks, and that column
is read, the case has to decide: the recording is refused until `units` says in which unit the numbers are. Otherwise
the line is reported. The gain of an amplifier and the factor of a calibration are only reported: columns in newtons
contain them.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.factors import number_of
from bushcli.recording.header.header import heading
from bushcli.recording.header.match import WantedColumn, quality_of
from bushcli.recording.source import Source
from bushcli.recording.text.table import LONGEST_LINE, SHOWN, Table

_N = r"\d+(?:[.,]\d+)?(?:[eE][-+−]?\d+)?"
#: What names a factor.
_CALLED = re.compile(
    r"(?:\b|(?<=[a-z])(?=[FS]))\w{0,20}(?:scale|scaling|gains?|multipliers?|factors?|faktor(?:en)?|skalierung"
    r"|verstärkung|multiplikator(?:en)?|facteurs?|échelle|fattore|fattori|factores|moltiplicatore|multiplicador)\b"
    r"|\b(?:multipl(?:y|ied)|divided?)\b|\w{0,10}multiplizier\w*|\bdividier\w*|系数|比例|倍率|係数"
    rf"|\b(?:in|units?|einheiten|multiples|vielfachen?)\s+(?:of|von)\s+(?={_N})|(?<![^\W_])[x×*]\s*(?={_N})",
    re.IGNORECASE,
)
#: A factor in words, or before a unit: "Force in thousands", "Kraftwerte in 1000 N".
_WORDED = re.compile(
    r"\b(?:in|en)\s+(?:tens|hundreds?|thousands?|millions?|tausend(?:er)?|hundert|milliers|miles|migliaia)\b"
    r"|\b(?:forces?|loads?|values?|kräfte|\w*werte|\w*wege?|\w*kraft|displacements?)\s+(?:are\s+)?in\s+10+\s+[^\W\d_]",
    re.IGNORECASE,
)
#: What else is called so.
_OTHER = re.compile(
    r"\b(?:pid|[pid] ?gain|gain ?[pid]|full|safety|shape|form|loss|damping|filter|drawing|stretch|rate|speed"
    r"|temperature|sensitivity|gau?ge|k|power|crest|formfaktor|verlustfaktor|sicherheitsfaktor|k-faktor|zoom|plot|axis"
    r"|graph|display|anzeige|diagramm?)\b|\d\s*x\s*\d",
    re.IGNORECASE,
)
#: What a column in units of force or length contains already, or what says so.
_CONTAINED = re.compile(
    r"gain|ampli|verstärk|calib|kalib|\bcal\b|étalon|\btar|already|applied|included|corrected|bereits|enthalten"
    r"|korrigiert|angewendet|incluse?",
    re.IGNORECASE,
)
_ALL = re.compile(r"\b(?:all|alle|allen|toutes?|tous|tutti|todos|todas)\b", re.IGNORECASE)
#: A number without a unit; behind "in units of" the unit is that of the column.
_BARE = re.compile(rf"(?<![\w.,:]){_N}(?![\w:]|[.,]\d|\s*[^\W\d_]|\s*%)")
_NUMBER = re.compile(rf"(?<![\w.,]){_N}(?![\w]|[.,]\d)")


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

    def concerns(self, index: int, wanted: WantedColumn) -> bool:
        """Whether the line certainly speaks of a column that is read."""
        if self.by_column:
            return self.by_column[index] not in (None, 1.0)
        if _ALL.search(self.text):
            return wanted.quantity != "time"
        return any(quality_of(heading(label), wanted) >= 2 for label in _labels(self.text))


def refuse_factor(table: Table, source: Source, wanted: WantedColumn, index: int) -> None:
    """Refuse a column of which a line above the table states a factor."""
    for one in stated_factors(table):
        if one.concerns(index, wanted) and not _CONTAINED.search(one.text):
            what = f'"{one.text[:SHOWN]}" states a factor of {table.label(index)}; the numbers may contain it already'
            unit = table.units[index] or next(iter(heading(table.names[index]).written), "") or "..."
            decided = f'units = {{{wanted.quantity} = "{unit}"}} in the table of the case file'
            if source.six is not None:
                decided = "delete the line"  # a path of six motions has no such key
            expected = f"{decided} if they do; otherwise multiply them in the file"
            raise RecordingError(Problem(f"{table.path}:{one.line}", what, "", expected))


def factor_remarks(table: Table, taken: Collection[int]) -> list[str]:
    """Return a remark about each line that states a factor of a column that was read, or that does not say of which."""
    return [
        f'line {one.line} states a factor ("{one.text[:SHOWN]}"), which was not applied: if the numbers '
        "of the table still have to be multiplied by it, change them in the file"
        for one in stated_factors(table)
        if not one.by_column or any(one.by_column[index] not in (None, 1.0) for index in taken)
    ]


def stated_factors(table: Table) -> list[StatedFactor]:
    """Return the lines above a table that state a factor other than 1."""
    found = []
    for number, text in table.preamble:
        text = text[:LONGEST_LINE].strip()
        if _WORDED.search(text):
            found.append(StatedFactor(number, text))
            continue
        called = _CALLED.search(text)
        if called is None or _OTHER.search(text):
            continue
        row = _row(text, len(table.names))
        if row:
            found += (
                [StatedFactor(number, text, row)] if any(value not in (None, 1.0) for value in row) else []
            )
            continue
        # The number may stand before a verb, and with a unit behind "units of".
        verb = called[0].lower().startswith(("multipl", "divid")) or "multiplizier" in called[0].lower()
        bare = _NUMBER if verb or re.search(r"\s(?:of|von)\s*$", called[0]) else _BARE
        within = text if verb else text[called.start() :].lstrip("xX×* ")
        if any(number_of(one) != 1.0 for one in bare.findall(within)):
            found.append(StatedFactor(number, text))
    return found


def _row(text: str, width: int) -> tuple[float | None, ...]:
    """Return the factor of each column of a table from a line with a label and a number for each; empty for others."""
    for delimiter in (r"[;\t|]", ",", r"\s+"):
        label, *fields = [field.strip() for field in re.split(delimiter, text)]
        numbers = [re.fullmatch(_N, field) for field in fields]
        count = sum(one is not None for one in numbers)
        if count < 2 and not (count == 1 and delimiter == r"[;\t|]" and len(fields) > 1):
            continue
        if label and all(one is not None or not field for one, field in zip(numbers, fields, strict=True)):
            values = [None if one is None else number_of(one[0]) for one in numbers]
            if len(values) in (width - 1, width):
                return (*[None] * (width - len(values)), *values)
    return ()


def _labels(text: str) -> list[str]:
    """Return what a line may be about, without the words of the factor and its numbers: "Force" of "Force scale: 2"."""
    plain = _NUMBER.sub(
        " ", _CALLED.sub(" ", re.sub(r"\b(?:in|en)\s+(?:\w+s\b|\d+|tausend|hundert).*", " ", text))
    )
    words = re.sub(
        r"[:=;,\t|()\[\]*×]|\b(?:of|for|by|de|von|für|mit|values?|werte?|in|channel|kanal)\b", " ", plain
    )
    singular = " ".join(word.removesuffix("s") if len(word) > 4 else word for word in words.split())
    return [" ".join(words.split()), singular]
