"""What a user can do where a file has no column for a quantity, by the columns that it has."""

from __future__ import annotations

from bushcli.recording.header.header import heading, match_quality, named_columns, without, word_quality
from bushcli.recording.header.match import TRUE_STRAIN, TRUE_STRESS, WantedColumn
from bushcli.recording.header.vocabulary import EXTREME_WORDS
from bushcli.recording.text.table import Table

#: Names of quantities in messages.
KIND = {
    "time": "time", "length": "length", "angle": "rotation", "force": "force", "moment": "moment",
    "strain": "stretch or strain", "stress": "stress", "shear": "shear strain",
}  # fmt: skip


def hint(table: Table, wanted: WantedColumn) -> str:
    """Return a hint on the mode to which the file's columns belong, or on the form of a coupon's columns."""
    mode = wanted.mode
    heads = [heading(name) for name in table.names if name]
    extreme = [head for head in heads if set(head.words) & EXTREME_WORDS]
    if any(word_quality(without(head, EXTREME_WORDS), wanted.measured) for head in extreme):
        return "are its rows the extremes of cycles? The samples of whole cycles are needed"
    if mode.specimen == "coupon":
        return _other_forms(table, wanted)
    for specimen, kind, modes in (
        ("translation", "length", "axial or radial"),
        ("rotation", "angle", "torsional or conical"),
        ("coupon", "stretch", "uniaxial, equibiaxial, planar or volumetric"),
        ("coupon", "strain", "uniaxial, equibiaxial, planar or volumetric"),
    ):
        here = "rotation" if mode.rotational else "translation"
        if specimen != here and any(match_quality(name, kind) >= 3 for name in table.names if name):
            return f"is this a recording of mode {modes}?"
    return ""


def headless(table: Table) -> str:
    """Return why a table has no header: a line above it that has names, but not as many as the rows have fields."""
    for number, text in reversed(table.preamble):
        for delimiter in ("\t", ";", ","):
            fields = [field.strip() for field in text.split(delimiter)]
            if len(fields) > 1 and named_columns(fields) > 1:
                return f"line {number} has {len(fields)} names, and the rows have {len(table.names)} fields"
    return "the table has no header"


def _other_forms(table: Table, wanted: WantedColumn) -> str:
    """Return a hint on what to write in the case file, where a coupon's file has force and travel, or true stress."""
    heads = [heading(name) for name in table.names if name]
    true = TRUE_STRESS if wanted.measured == "stress" else TRUE_STRAIN
    if any(word_quality(without(head, true), wanted.measured) and set(head.words) & true for head in heads):
        return f'if it is a true {wanted.measured}, give {wanted.measured} = "true"'
    raw, key = {
        "strain": ("length", "gauge_length"), "stress": ("force", "area (or width and thickness, or diameter)"),
    }.get(wanted.measured, ("", ""))  # fmt: skip
    if raw and any(word_quality(head, raw) for head in heads):
        return f"the file has a {KIND[raw]}: give {key} of the specimen in mm"
    return ""
