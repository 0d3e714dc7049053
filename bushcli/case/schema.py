"""The tables of a case file and their keys, as written: degrees, file names, nothing converted."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    AliasChoices,
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from bushcli.recording.source import WARM, FaultKind


def optional(description: str, **constraints: Any) -> Any:
    """Return a key that may be absent; its value is then None."""
    return Field(default=None, description=description, **constraints)


#: Keys at the top of a case file, in the usual order.
SECTIONS = (
    *("title", "temperature", "tolerance", "geometry", "mesh", "material"),
    *("load_cases", "recordings", "specimens", "coupons", "effects"),
)

Name = Annotated[str, Field(min_length=1)]
Elements = Annotated[int, Field(le=400)]


def _column(value: Any) -> str | int:
    if isinstance(value, str) and value:
        return value
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    raise ValueError("neither the name of a column nor its number, counted from 1")


ColumnKey = Annotated[str | int, PlainValidator(_column)]


def _value(value: Any) -> float | str:
    if isinstance(value, str):
        return value
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    raise ValueError("neither a number nor a word")


Value = Annotated[float | str, PlainValidator(_value)]


class CaseTable(BaseModel):
    """A table of the case file: unknown keys are refused, numbers are not read from texts."""

    model_config = ConfigDict(frozen=True, defer_build=True, extra="forbid", strict=True, allow_inf_nan=False)


def _numbers(value: Any) -> tuple[float, ...]:
    values = value if isinstance(value, list) else [value]
    if not values or any(isinstance(value, bool) or not isinstance(value, (int, float)) for value in values):
        raise ValueError(
            "neither a number nor a list of at least one number, written without quotes and unit"
        )
    return tuple(map(float, values))


Numbers = Annotated[tuple[float, ...], PlainValidator(_numbers)]


Temperature = Annotated[
    float, Field(ge=WARM[0], le=WARM[1], description="degrees C; absent = that of the case")
]


class HeatTable(CaseTable):
    """The temperature of the whole case."""

    temperature: Temperature | None = None


class MaterialTable(CaseTable):
    """``[material]``."""

    law: str = Field(description="a law, see bushcli list laws")
    # The one key that may be infinite; build.py refuses every other infinity and every nan.
    bulk_modulus: float = Field(
        default=float("inf"), gt=0, allow_inf_nan=True, description="MPa, inf = incompressible"
    )
    parameters: dict[str, float] = Field(default_factory=dict, description="by name, MPa or 1")
    # 100 parts of rubber of 920 kg/m3, 50 of carbon black of 1,800 and 10 of others of 1,000 have 1,090.
    density: float = Field(
        default=1100.0, gt=0, description="kg/m3 (filled rubber; unfilled 950); for vibrations and exports"
    )
    hardness: float | None = optional("Shore A, for a law without parameters where nothing else is known")
    terms: int | None = optional("number of terms to fit, when no parameters are given", ge=1)


class MeshTable(CaseTable):
    """``[mesh]``."""

    elements_across: Elements | None = optional("rubber elements from sleeve to sleeve", ge=2)
    elements_along: Elements | None = optional("rubber elements along the axis", ge=2)
    elements_around: Elements | None = optional("elements around the circumference", ge=4)


Times = Annotated[list[float], Field(min_length=2, max_length=100_000)]
Motion = Literal["ux", "uy", "uz", "rx", "ry", "rz"]


class PathTable(CaseTable):
    """``[load_cases.path]``: six motions in time."""

    time: Times = Field(description="s")
    ux: Times | None = optional("mm, across the axis")
    uy: Times | None = optional("mm, across the axis")
    uz: Times | None = optional("mm, along the axis")
    rx: Times | None = optional("degrees")
    ry: Times | None = optional("degrees")
    rz: Times | None = optional("degrees, about the axis")
    fx: Times | None = optional("N, in place of ux: the motion follows from the force")
    fy: Times | None = optional("N, in place of uy")
    fz: Times | None = optional("N, in place of uz")
    mx: Times | None = optional("N mm, in place of rx, about the sleeve's centre")
    my: Times | None = optional("N mm, in place of ry")
    mz: Times | None = optional("N mm, in place of rz")
    free: list[Motion] | None = optional("motions that are free of force")


def _table_or_list(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    """Leave a table to `PathTable`."""
    return value if isinstance(value, dict) else handler(value)


Delimiter = Literal[",", ";", "\t", " ", "|", "comma", "semicolon", "tab", "space", "pipe"]
#: Delimiters by their words, which a shell needs no quotes for.
DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "pipe": "|"}


# The quantities by all their names.
_DISPLACEMENT = AliasChoices("displacement", "rotation", "stretch", "strain")
_FORCE = AliasChoices("force", "moment", "stress")


class ColumnsTable(CaseTable):
    """``columns``: column by name or by number from 1."""

    time: ColumnKey | None = None
    displacement: ColumnKey | None = Field(default=None, validation_alias=_DISPLACEMENT)
    force: ColumnKey | None = Field(default=None, validation_alias=_FORCE)
    temperature: ColumnKey | None = None


class UnitsTable(CaseTable):
    """``units``: unit by quantity."""

    time: str | None = None
    displacement: str | None = Field(default=None, validation_alias=_DISPLACEMENT)
    force: str | None = Field(default=None, validation_alias=_FORCE)
    temperature: str | None = None


class FileTable(CaseTable):
    """How the file of a recording or a program is read."""

    columns: ColumnsTable = Field(default_factory=ColumnsTable)
    units: UnitsTable = Field(default_factory=UnitsTable)
    delimiter: Delimiter | None = None
    decimal: Literal[".", ","] | None = None
    reverse: list[Literal["displacement", "force"]] | None = optional(
        "columns whose sign is reversed; [] says that all signs are right"
    )
    accept: list[float | FaultKind] | None = optional(
        "measured values that look like codes for missing values, and kinds of data faults that are none"
    )
    group: ColumnKey | None = optional(
        "sheet or group of the file, by name or by number from 1",
        validation_alias=AliasChoices("group", "sheet"),
    )
    rows: dict[str, str | float] | None = optional(
        "value, by column, of the rows that belong to the recording"
    )
    sample_rate: float | None = optional("Hz; samples per second of a file without a time", gt=0)


class FrequenciesTable(CaseTable):
    """``frequency`` as a range."""

    model_config = ConfigDict(populate_by_name=False)

    first: float = Field(gt=0, alias="from", description="Hz")
    last: float = Field(gt=0, alias="to", description="Hz")
    points: int = Field(ge=2, le=10_000, description="number of frequencies")
    spacing: Literal["linear", "logarithmic"] | None = optional(
        "absent = logarithmic over more than a decade"
    )


class VibrationTable(CaseTable):
    """``[load_cases.dynamic]``: small vibrations about one or several preloads."""

    preload: Numbers | None = optional("mm or degrees; one or a list")
    preload_force: Numbers | None = optional("N or N mm; one or a list")
    amplitude: Numbers | None = optional("mm or degrees, peak; one or a list; absent = small")
    frequency: Annotated[Numbers, WrapValidator(_table_or_list)] = Field(
        description="Hz; a list, or {from, to, points, spacing}"
    )
    point: Literal["transfer", "driving"] = Field(
        default="transfer", description="force at the held sleeve, or where the bushing is driven"
    )
    motion: Motion | None = optional("of mode path: what vibrates; absent = the motion that goes furthest")


class LoadCaseTable(FileTable):
    """``[[load_cases]]``."""

    mode: str = Field(description="a mode, see bushcli list modes")
    amplitude: float | None = optional("mm or degrees; stretch - 1 for a coupon")
    path: Annotated[list[float] | None, Field(min_length=2), WrapValidator(_table_or_list)] = optional(
        "points to go through, mm or degrees; a table of six motions for mode path"
    )
    force: float | None = optional("largest force, N or N mm; the travel is found")
    force_path: list[float] | None = optional("forces to go through, N or N mm", min_length=2)
    rate: float | None = optional("mm/s or degrees/s; N/s or N mm/s of a force", gt=0)
    file: Name | None = optional("file with the path of the displacement")
    force_file: Name | None = optional("file with the path of the force")
    steps: int = Field(default=20, ge=1, le=100_000, description="steps on the longest segment of the path")
    dynamic: VibrationTable | None = optional("vibrations about preloads; a table of its own")
    temperature: Temperature | None = None


class ToleranceTable(CaseTable):
    """``tolerance``."""

    percent: float = Field(gt=0, le=100, description="of the measured stiffness and the recorded force range")
    name: Literal["D1", "D2", "D3"] | None = optional("on the drawing", alias="class")


class EffectTable(CaseTable):
    """``[[effects]]``."""

    name: str = Field(description="an effect, see bushcli list effects")
    parameters: dict[str, Value] = Field(
        default_factory=dict, description="by name, or by the name of 1/value; a choice by its word"
    )
    channels: list[Name] | None = optional(
        "channels that have it; all that it acts on when absent", min_length=1
    )
