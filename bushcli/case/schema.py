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


class Table(BaseModel):
    """A table of the case file: unknown keys are refused, numbers are not read from texts."""

    model_config = ConfigDict(frozen=True, defer_build=True, extra="forbid", strict=True, allow_inf_nan=False)


class MaterialTable(Table):
    """``[material]``."""

    law: str = Field(description="a law, see bushcli list laws")
    # The one key that may be infinite; build.py refuses every other infinity and every nan.
    bulk_modulus: float = Field(
        default=float("inf"), gt=0, allow_inf_nan=True, description="MPa, inf = incompressible"
    )
    parameters: dict[str, float] = Field(default_factory=dict, description="by name, MPa or 1")
    terms: int | None = Field(
        default=None, ge=1, description="number of terms to fit, when no parameters are given"
    )


class MeshTable(Table):
    """``[mesh]``."""

    elements_across: Elements | None = Field(
        default=None, ge=2, description="rubber elements from sleeve to sleeve"
    )
    elements_along: Elements | None = Field(default=None, ge=2, description="rubber elements along the axis")
    elements_around: Elements | None = Field(
        default=None, ge=4, description="elements around the circumference"
    )


Times = Annotated[list[float], Field(min_length=2, max_length=100_000)]
Motion = Literal["ux", "uy", "uz", "rx", "ry", "rz"]


class PathTable(Table):
    """``[load_cases.path]``: six motions in time."""

    time: Times = Field(description="s")
    ux: Times | None = Field(default=None, description="mm, across the axis")
    uy: Times | None = Field(default=None, description="mm, across the axis")
    uz: Times | None = Field(default=None, description="mm, along the axis")
    rx: Times | None = Field(default=None, description="degrees")
    ry: Times | None = Field(default=None, description="degrees")
    rz: Times | None = Field(default=None, description="degrees, about the axis")
    free: list[Motion] | None = Field(default=None, description="motions that are free of force")


def _table_or_list(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    """Leave a table to `PathTable`."""
    return value if isinstance(value, dict) else handler(value)


class ColumnsTable(Table):
    """``columns``: column by name or by number from 1."""

    time: ColumnKey | None = None
    displacement: ColumnKey | None = Field(
        default=None, validation_alias=AliasChoices("displacement", "rotation", "stretch", "strain")
    )
    force: ColumnKey | None = Field(default=None, validation_alias=AliasChoices("force", "moment", "stress"))


class UnitsTable(Table):
    """``units``: unit by quantity."""

    time: str | None = None
    displacement: str | None = Field(
        default=None, validation_alias=AliasChoices("displacement", "rotation", "stretch", "strain")
    )
    force: str | None = Field(default=None, validation_alias=AliasChoices("force", "moment", "stress"))


class FileTable(Table):
    """How the file of a recording or a program is read."""

    columns: ColumnsTable = Field(default_factory=ColumnsTable)
    units: UnitsTable = Field(default_factory=UnitsTable)
    delimiter: Literal[",", ";", "\t", " ", "comma", "semicolon", "tab", "space"] | None = None
    decimal: Literal[".", ","] | None = None
    reverse: list[Literal["displacement", "force"]] | None = Field(
        default=None, min_length=1, description="columns whose sign is reversed"
    )
    accept: list[float] | None = Field(
        default=None, description="measured values that look like codes for missing values"
    )
    group: ColumnKey | None = Field(
        default=None,
        validation_alias=AliasChoices("group", "sheet"),
        description="sheet or group of the file, by name or by number from 1",
    )
    sample_rate: float | None = Field(
        default=None, gt=0, description="Hz; samples per second of a file without a time"
    )


class LoadCaseTable(FileTable):
    """``[[load_cases]]``."""

    mode: str = Field(description="a mode, see bushcli list modes")
    amplitude: float | None = Field(default=None, description="mm or degrees; stretch - 1 for a coupon")
    path: Annotated[list[float] | None, Field(min_length=2), WrapValidator(_table_or_list)] = Field(
        default=None, description="points to go through, mm or degrees; a table of six motions for mode path"
    )
    rate: float | None = Field(default=None, gt=0, description="mm/s or degrees/s")
    file: Name | None = Field(default=None, description="file with the path of the displacement")
    steps: int = Field(default=20, ge=1, le=100_000, description="steps on the longest segment of the path")


class RecordingTable(FileTable):
    """``[[recordings]]``."""

    mode: str | None = Field(
        default=None, description="a mode, see bushcli list modes; absent = the mode in the name of the file"
    )
    file: Name = Field(description="file of a test rig, or a pattern of files, relative to the case file")
    name: Name | None = Field(default=None, description="name of the channel; absent = the mode")
    cycles: list[Annotated[int, Field(ge=1)]] | None = Field(default=None, min_length=1)
    rate: float | None = Field(
        default=None, gt=0, description="mm/s, degrees/s or 1/s; speed of a test without a time"
    )
    conditioning: int = Field(
        default=0, ge=0, le=10_000, description="number of first cycles that only condition the specimen"
    )
    standard: Literal["ASTM D575", "ISO 37", "ISO 7743", "SAE J1636"] | None = Field(
        default=None,
        description="standard that the test claims to follow; bushcli check says where it does not",
    )
    gauge_length: float | None = Field(
        default=None, gt=0, description="mm; for a coupon file with travel in place of strain"
    )
    area: float | None = Field(
        default=None, gt=0, description="mm2; for a coupon file with force in place of stress"
    )
    width: float | None = Field(default=None, gt=0, description="mm; with thickness, instead of area")
    thickness: float | None = Field(default=None, gt=0, description="mm; with width, instead of area")
    diameter: float | None = Field(default=None, gt=0, description="mm; instead of area")
    stress: Literal["engineering", "true"] | None = Field(default=None, description="stress of the file")
    strain: Literal["engineering", "true"] | None = Field(
        default=None, description="strain of the file; true = logarithmic"
    )

    motions: dict[str, ColumnKey] | None = Field(
        default=None, min_length=1, description="of mode path: column by motion, ux to rz"
    )
    forces: dict[str, ColumnKey] | None = Field(
        default=None, min_length=1, description="of mode path: column by reaction, fx to mz"
    )
    free: list[Motion] | None = Field(
        default=None, description="of mode path: motions that were free of force"
    )


class CouponTable(RecordingTable):
    """``[[coupons]]``."""

    largest_stretch: float | None = Field(
        default=None, gt=0, description="points beyond this stretch are left out of the fit"
    )


class ToleranceTable(Table):
    """``tolerance``."""

    percent: float = Field(gt=0, le=100, description="of the measured stiffness and the recorded force range")
    name: Literal["D1", "D2", "D3"] | None = Field(default=None, alias="class", description="on the drawing")


class EffectTable(Table):
    """``[[effects]]``."""

    name: str = Field(description="an effect, see bushcli list effects")
    parameters: dict[str, Value] = Field(
        default_factory=dict, description="by name, or by the name of 1/value; a choice by its word"
    )
    channels: list[Name] | None = Field(
        default=None, min_length=1, description="channels that have it; all that it acts on when absent"
    )
