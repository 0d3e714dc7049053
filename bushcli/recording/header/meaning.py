"""Meaning of a coupon's column (true stress, logarithmic strain, volume ratio), from its name and its numbers.

A column means what its name says, whether it was found or is chosen by name or number, unless the case file states
another meaning. If the name leaves the meaning open, or the column cannot be converted, the user is asked; numbers that
contradict the name or the unit are refused.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.header.match import EITHER_TRUE, NamedColumn
from bushcli.recording.header.name_parts import largest
from bushcli.recording.header.units import Unit
from bushcli.recording.quantities import SPECIAL, STATIC
from bushcli.recording.source import Source

Array = NDArray[np.float64]

_NOMINAL = frozenset({"nominal", "engineering", "nom", "eng", "technical"})
_VOLUME = frozenset({"volume", "volumetric", "vol", "volumetrisch", "volumetrische"})
#: Days since 1900 from 1982 to 2119, largest interval of samples in days, and milliseconds since 1970 in 1973.
_DAYS, _LONGEST_DAYS, _MILLISECONDS = (30_000.0, 80_000.0), 0.1, 1e11
#: Share of a range by which a sensor is overloaded at most; judgement.
_OVERLOAD = 1.2
#: Strain of the first sample of a coupon up to which it counts as at rest; judgement.
_AT_REST = 0.15
#: Beginnings of words for compression and for tension.
_COMPRESSIVE = ("compress", "druck", "stauch", "kompress", "schiacc", "écras")
_TENSILE = ("tens", "zug", "pull", "trac", "traz")


def meaning_of(column: NamedColumn, source: Source, chosen: bool) -> tuple[str, tuple[str, ...]]:
    """Return the form of a coupon's column, a value of `Specimen.strain` or `Specimen.stress`, and remarks."""
    wanted, mode, words = column.wanted, column.wanted.mode, set(column.head.words)
    key = "strain" if wanted.quantity == "displacement" else "stress"
    form = source.specimen.strain if key == "strain" else source.specimen.stress
    if not wanted.given and form is None:
        _refuse_other(column, key, chosen)
    remarks: tuple[str, ...] = ()
    volumetric = mode.needs_compressibility
    measure: str = form or "engineering"
    if mode.specimen != "coupon" or wanted.quantity == "time":
        measure = "engineering"
    elif wanted.measured not in ("strain", "stress"):
        # A travel over a length, a force over an area; under a piston in a cylinder, change of volume and true stress.
        measure = {"strain": "volume", "stress": "true"}[key] if volumetric else "engineering"
    elif form is None:
        # The first stress of Piola and Kirchhoff is the nominal one.
        is_first = any(text in column.head.name for text in ("1st", "first"))
        if (words & STATIC[key].unconverted) - ({"kirchhoff", "pk"} if is_first else set()):
            what = f"{column.label} is not an engineering {key} by its name, and not a true one"
            remedy = f"choose another column, or give {_possible_values(column, key)}"
            raise column.table.refusal(what, remedy)
        # Shear stress and amount of shear are the same in the deformed and the undeformed body.
        same = wanted.given == "stretch" or mode.sheared
        true = not same and not words.isdisjoint(STATIC[key].true)
        measure = "true" if true else "engineering"
        if volumetric and not same:
            if key == "strain":
                kinds = ("volume ratio", "volume strain")
                volume = bool(_VOLUME & words) or any(map(column.head.quality, kinds))
                is_unnamed = chosen and not wanted.quality(column.head)
                nominal = bool(_NOMINAL & words) and not column.head.quality("stretch")
                if true or (not volume and (is_unnamed or nominal)):
                    what = f"{column.label} may be the change of volume or that of a length: the mode is {mode.name}"
                    raise column.table.refusal(what, f"give {_possible_values(column, 'strain')}")
                linear = not volume and bool(column.head.quality("stretch") or {"linear", "axial"} & words)
                measure = "engineering" if linear else "volume"
                if not volume and not linear:
                    read = f"{column.label} is read as the change of volume, J - 1"
                    remarks = (f'{read}; strain = "engineering" if it is that of a length',)
            else:
                pressure, nominal = column.head.quality("pressure"), bool(_NOMINAL & words)
                measure = "pressure" if pressure else "engineering" if nominal else "true"
                if not (true or pressure or nominal or "hydrostatic" in words):
                    read = f"{column.label} is read as the hydrostatic stress, tension positive"
                    remarks = (f'{read}; stress = "engineering" if it is nominal',)
    return measure, remarks


def _possible_values(column: NamedColumn, key: str) -> str:
    """Return the values of `strain` or `stress` that the case file can give, as a text."""
    special = {"strain": "volume", "stress": "pressure"}
    measure = special[key] if column.wanted.mode.needs_compressibility else "true"
    return f'{key} = "engineering" or "{measure}" in the table of the case file'


def _refuse_other(column: NamedColumn, key: str, chosen: bool) -> None:
    """Refuse a column whose name is that of another quantity: of another test, or chosen, without a unit."""
    wanted, head = column.wanted, column.head.without(EITHER_TRUE)
    special = [kind for kind in SPECIAL if kind not in wanted.kinds and head.quality(kind) >= 3]
    # A name of one letter, "p" or "J", means something in the test of its own mode only.
    if wanted.measured not in ("strain", "stress") or len(head.name) == 1:
        special = []
    # A unit of another quantity is refused where units are read; one of this quantity says what the column is.
    says = not chosen or wanted.quality(head) or column.written_units
    plain = [] if says else [kind for kind in STATIC if head.quality(kind) >= 3]
    other = next((kind for kind in (*special, *plain) if kind != wanted.measured), "")
    if other:
        title = (STATIC.get(other) or SPECIAL[other]).title
        what = f"{column.label} is a {title} by its name, and the {STATIC[wanted.measured].title} is needed"
        remedy = f'units = {{{wanted.quantity} = "..."}} if it is one'
        if other in SPECIAL:
            test = SPECIAL[other].test
            remedy = f'mode = "{test}" if the test is one, or {key} = "engineering" if the column is one'
        elif STATIC[other].size and wanted.measured in ("strain", "stress"):
            remedy = f"give {STATIC[other].size}, or {remedy}"
        elif wanted.mode.specimen == "coupon" and STATIC[wanted.measured].size:
            remedy = f"leave out {STATIC[wanted.measured].size.split()[0]}, or {remedy}"
        raise column.table.refusal(what, f"choose another column; {remedy}")


def refuse_date(column: NamedColumn, time: Array) -> None:
    """Refuse a time without a unit whose numbers are dates: days since 1900 as in Excel, or milliseconds since 1970."""
    first, steps = float(time[0]), np.abs(np.diff(time))
    step = float(np.median(steps)) if len(steps) else 0.0
    is_day = _DAYS[0] < first < _DAYS[1] and 0.0 < step < _LONGEST_DAYS and first % 1.0 != 0.0
    if is_day or first > _MILLISECONDS:
        kind = "days since 1900" if is_day else "milliseconds since 1970"
        what = f"{column.label}: {column.table.text(0, column.index)} looks like a date in {kind}, not like seconds"
        expected = 'write the time in s, or give units = {time = "s"} in the table of the case file if it is'
        raise column.table.refusal(what, expected, 0)


def ranges_of(column: NamedColumn, numbers: Array, assumed: bool) -> list[str]:
    """Return a remark about each range in the name of a column, such as the ±25 of ``Displacement ±25``."""
    remarks = []
    for text in column.head.ranges:
        row = int(np.argmax(np.abs(numbers)))
        if assumed and abs(float(numbers[row])) > _OVERLOAD * largest(text):
            number = column.table.text(row, column.index)
            what = f'{column.label}: {number} is beyond the range "{text}", and no unit is given'
            expected = f'units = {{{column.wanted.quantity} = "..."}} in the table of the case file'
            raise column.table.refusal(what, expected, row)
        remarks.append(f'{column.label}: "{text}" is taken for the range of the sensor, and not applied')
    return remarks


def refuse_other_strain(column: NamedColumn, read: Unit, values: Array) -> None:
    """Refuse a strain that begins like a stretch, and a stretch that begins like a strain: a coupon begins at rest."""
    first, is_strain = float(values[0]), read.name == "strain"
    if (is_strain and abs(first - 1.0) < _AT_REST and values.min() > 1.0 - _AT_REST) or (
        read.name == "stretch" and abs(first) < _AT_REST and first != 0.0
    ):
        other, value = "stretch" if is_strain else "strain", column.table.text(0, column.index)
        what = f"{column.label} is read as a {read.name}, and begins with {value} as a {other} does"
        expected = f'units = {{displacement = "{other}"}} in the table of the case file, or "{read.name}" if it is one'
        raise column.table.refusal(what, expected, 0)


def says_compression(name: str) -> bool:
    """Whether a name contains a word for compression, and none for tension."""
    words = re.split(r"[\W_\d]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())
    tensile = any(word.startswith(_TENSILE) or "zug" in word for word in words)
    return any(word.startswith(_COMPRESSIVE) for word in words) and not tensile


def refuse_compression(column: NamedColumn, source: Source, values: Array) -> None:
    """Refuse a compressive strain or stress that is counted as positive: it would be read as tension.

    The name of the column says that it is compressive, or that of the file, of its sheet or of the channel. In shear
    and in volumetric tests it says nothing about signs (`bushcli.recording.specimen`).
    """
    names = {source.file.stem: "the name of the file", column.table.part: "its sheet"}
    names[source.name] = "the name of the channel"
    by_column = any(word.startswith(_COMPRESSIVE) for word in column.head.words)
    telling = [f"{of} says compression" for name, of in names.items() if says_compression(name)]
    mode = column.wanted.mode
    signed = source.reverse is not None or mode.sheared or mode.needs_compressibility
    # A stretch in compression is below 1: it has its sign already.
    if (by_column or telling) and not signed and values.max() > abs(values.min()):
        says = f"{column.label} is compressive" if by_column else telling[0]
        its = "its values" if by_column else f"the values of {column.label}"
        what = f"{says}, and {its} are positive: they would be read as tension"
        expected = 'reverse = ["displacement", "force"] in the table of the case file, or reverse = [] if it is tension'
        raise column.table.refusal(what, expected)
