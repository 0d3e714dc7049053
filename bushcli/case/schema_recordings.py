"""Schema of the tables of recordings and coupon tests, which most simulated cases do not have."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from bushcli.case.schema import ColumnKey, FileTable, Motion, Name, Temperature, optional


class RecordingTable(FileTable):
    """``[[recordings]]``."""

    mode: str | None = optional("a mode, see bushcli list modes; absent = the mode in the name of the file")
    file: Name = Field(description="file of a test rig, or a pattern of files, relative to the case file")
    kind: Literal["curve", "dynamic"] | None = optional(
        "dynamic = a table of dynamic stiffness, or loops of sine bursts; absent = a curve"
    )
    name: Name | None = optional("name of the channel; absent = the mode")
    cycles: list[Annotated[int, Field(ge=1)]] | None = Field(default=None, min_length=1)
    rate: float | None = optional("mm/s, degrees/s or 1/s; speed of a test without a time", gt=0)
    conditioning: int = Field(
        default=0, ge=0, le=10_000, description="number of first cycles that only condition the specimen"
    )
    standard: Literal["ASTM D575", "ISO 37", "ISO 7743", "SAE J1636"] | None = optional(
        "standard that the test claims to follow; bushcli check says where it does not"
    )
    gauge_length: float | None = optional("mm; for a coupon file with travel in place of strain", gt=0)
    area: float | None = optional("mm2; for a coupon file with force in place of stress", gt=0)
    width: float | None = optional("mm; with thickness, instead of area", gt=0)
    thickness: float | None = optional("mm; with width, instead of area", gt=0)
    diameter: float | None = optional("mm; instead of area", gt=0)
    stress: Literal["engineering", "true", "pressure"] | None = optional(
        "stress of the file; absent = what the name of its column says"
    )
    strain: Literal["engineering", "true", "volume"] | None = optional(
        "strain of the file; true = logarithmic; absent = what the name of its column says"
    )

    temperature: Temperature | None = None
    motions: dict[str, ColumnKey] | None = optional("of mode path: column by motion, ux to rz", min_length=1)
    forces: dict[str, ColumnKey] | None = optional("of mode path: column by reaction, fx to mz", min_length=1)
    free: list[Motion] | None = optional("of mode path: motions that were free of force")


class CouponTable(RecordingTable):
    """``[[coupons]]``."""

    branch: Literal["loading", "unloading", "both"] | None = optional(
        "samples to which a law is fitted; absent = loading"
    )
    largest_stretch: float | None = optional("points beyond this stretch are left out of the fit", gt=0)
