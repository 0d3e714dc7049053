"""What the name of a coupon's column says of its values: true stress, logarithmic strain, volume ratio, pressure.

A column keeps the meaning of its name, whether it was found or is chosen by name or number, unless the case file states
another one. What a name leaves open and what cannot be converted is asked.
"""

from __future__ import annotations

from dataclasses import dataclass

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.header import Heading, heading, without, word_quality
from bushcli.recording.header.hints import KIND
from bushcli.recording.header.match import (
    TRUE_STRAIN,
    TRUE_STRESS,
    WantedColumn,
    quality_of,
    special_quality,
    written_units,
)
from bushcli.recording.header.vocabulary import SPECIAL, WORDS
from bushcli.recording.source import Source
from bushcli.recording.text.table import Table

#: Words of strains and stresses that belong to no load over an area and to no change of a length.
_UNCONVERTED = {
    "strain": frozenset({"green", "lagrange", "lagrangian", "almansi", "biot", "equivalent", "mises"}),
    "stress": frozenset({"kirchhoff", "pk", "2nd", "second", "pk2", "mises", "equivalent", "deviatoric"}),
}
_NOMINAL = frozenset({"nominal", "engineering", "nom", "eng", "technical"})
_VOLUME = frozenset({"volume", "volumetric", "vol", "volumetrisch", "volumetrische"})


@dataclass(frozen=True)
class Meaning:
    """The form of a column, a value of `Specimen.strain` or `Specimen.stress`, and what to say about it."""

    form: str
    remarks: tuple[str, ...] = ()


def meaning_of(table: Table, wanted: WantedColumn, index: int, source: Source, chosen: bool) -> Meaning:
    """Return the form in which a column holds the strain or the stress of a coupon."""
    head = heading(table.names[index])
    key = "strain" if wanted.quantity == "displacement" else "stress"
    form = source.specimen.strain if key == "strain" else source.specimen.stress
    if not wanted.given and form is None:
        _refuse_other(table, wanted, index, key, chosen)
    if wanted.mode.specimen != "coupon" or wanted.quantity == "time":
        return Meaning("engineering")
    if wanted.measured not in ("strain", "stress"):
        # A travel over a length, a force over an area; under a piston in a cylinder, change of volume and true stress.
        machine = "volume" if key == "strain" else "true"
        return Meaning(machine if wanted.mode.needs_compressibility else "engineering")
    if form is not None:
        return Meaning(form)
    name = " ".join(head.words)
    first = any(text in name for text in ("1st", "first"))
    odd = [
        word
        for word in head.words
        if word in _UNCONVERTED[key] and not (first and word in ("kirchhoff", "pk"))
    ]
    if odd:
        what = f"{table.label(index)} is not an engineering {key} by its name, and not a true one"
        raise RecordingError(
            Problem(table.where, what, "", f"choose another column, or give {_stated(key, wanted)}")
        )
    if wanted.given == "stretch" or wanted.mode.sheared:
        # Shear stress and amount of shear are the same in the deformed and the undeformed body.
        return Meaning("engineering")
    true = bool(set(head.words) & (TRUE_STRAIN if key == "strain" else TRUE_STRESS))
    if not wanted.mode.needs_compressibility:
        return Meaning("true" if true else "engineering")
    return _volumetric(table, wanted, index, key, head, chosen, true)


def _volumetric(
    table: Table, wanted: WantedColumn, index: int, key: str, head: Heading, chosen: bool, true: bool
) -> Meaning:
    """Return the form of a column of a volumetric test."""
    label, nominal = table.label(index), bool(_NOMINAL & set(head.words))
    if key == "stress":
        if special_quality(head, "pressure"):
            return Meaning("pressure")
        if nominal:
            return Meaning("engineering")
        said = f'{label} is read as the hydrostatic stress, tension positive; stress = "engineering" if it is nominal'
        return Meaning("true", () if true or "hydrostatic" in head.words else (said,))
    kinds = ("volume ratio", "volume strain")
    volume = bool(_VOLUME & set(head.words)) or any(special_quality(head, kind) for kind in kinds)
    if volume and not true:
        return Meaning("volume")
    is_unnamed = chosen and not quality_of(head, wanted)
    if true or is_unnamed or (nominal and not word_quality(head, "stretch")):
        what = f"{label} may be the change of volume or that of a length: the mode is {wanted.mode.name}"
        raise RecordingError(Problem(table.where, what, "", f"give {_stated(key, wanted)}"))
    if word_quality(head, "stretch") or {"linear", "axial"} & set(head.words):
        return Meaning("engineering")
    said = f'{label} is read as the change of volume, J - 1; strain = "engineering" if it is that of a length'
    return Meaning("volume", (said,))


def _stated(key: str, wanted: WantedColumn) -> str:
    """Return the values of `strain` or `stress` that the case file can give, as a text."""
    own = {"strain": "volume", "stress": "pressure"}[key]
    values = ["engineering", own if wanted.mode.needs_compressibility else "true"]
    return f'{key} = "{values[0]}" or "{values[1]}" in the table of the case file'


def _refuse_other(table: Table, wanted: WantedColumn, index: int, key: str, chosen: bool) -> None:
    """Refuse a column whose name is that of another quantity: of another test, or chosen, without a unit."""
    head = without(heading(table.names[index]), TRUE_STRESS | TRUE_STRAIN)
    special = [kind for kind in SPECIAL if kind not in wanted.kinds and special_quality(head, kind) >= 3]
    # A name of one letter, "p" or "J", means something in the test of its own mode only.
    if wanted.measured not in ("strain", "stress") or len(head.name) == 1:
        special = []
    # A unit of another quantity is refused where units are read; one of this quantity says what the column is.
    says = not chosen or quality_of(head, wanted) or written_units(table, index, head)
    plain = [] if says else [kind for kind in WORDS if word_quality(head, kind) >= 3]
    found = next((kind for kind in (*special, *plain) if kind != wanted.measured), "")
    if not found:
        return
    size = {"length": "gauge_length", "force": "area"}
    what = f"{table.label(index)} is a {KIND.get(found, found)} by its name, and the {KIND[wanted.measured]} is needed"
    remedy = f'units = {{{wanted.quantity} = "..."}} if it is one'
    if found in SPECIAL:
        mode = "simple_shear" if found.startswith("shear") else "volumetric"
        remedy = f'mode = "{mode}" if the test is one, or {key} = "engineering" if the column is one'
    elif wanted.mode.specimen == "coupon" and found in size and wanted.measured in ("strain", "stress"):
        remedy = f"give {size[found]} of the specimen in mm{'2' if found == 'force' else ''}, or {remedy}"
    elif wanted.measured in size and wanted.mode.specimen == "coupon":
        remedy = f"leave out {size[wanted.measured]}, or {remedy}"
    raise RecordingError(Problem(table.where, what, "", f"choose another column; {remedy}"))
