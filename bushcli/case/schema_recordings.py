"""Schema of the tables of recordings and coupon tests, which most simulated cases do not have."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from bushcli.case.schema import ColumnKey, FileTable, Motion, Name, Temperature


class RecordingTable(FileTable):
    """``[[recordings]]``."""

    mode: str | None = Field(
        default=None, description="a mode, see bushcli list modes; absent = the mode in the name of the file"
    )
    file: Name = Field(description="file of a test rig, or a pattern of files, relative to the case file")
    kind: Literal["curve", "dynamic"] | None = Field(
        default=None,
        description="dynamic = a table of dynamic stiffness, or loops of sine bursts; absent = a curve",
    )
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
    stress: Literal["engineering", "true", "pressure"] | None = Field(
        default=None, description="stress of the file; absent = what the name of its column says"
    )
    strain: Literal["engineering", "true", "volume"] | None = Field(
        default=None,
        description="strain of the file; true = logarithmic; absent = what the name of its column says",
    )

    temperature: Temperature | None = None
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

    branch: Literal["loading", "unloading", "both"] | None = Field(
        default=None, description="samples to which a law is fitted; absent = loading"
    )
    largest_stretch: float | None = Field(
        default=None, gt=0, description="points beyond this stretch are left out of the fit"
    )
