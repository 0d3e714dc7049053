"""Voided: a plain or tapered bushing with two kidney voids through its length, which soften one radial direction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator
from typing_extensions import override

from geometry.ring import Void
from geometry.shapes.tapered import Tapered


class Voided(Tapered):
    """Two opposite voids, each between two radii over an angle, with radial end walls.

    The dimensions of the rubber are those of `plain` (length) or of `tapered` (inner_length, outer_length).
    """

    name: ClassVar[str] = "voided"
    summary: ClassVar[str] = (
        "two opposite kidney voids in a plain (length) or tapered (inner_length, outer_length) bushing"
    )
    axisymmetric: ClassVar[bool] = False
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = tuple(
        {
            "inner_radius": 12.0,
            "outer_radius": 22.0,
            "length": 40.0,
            "void_inner_radius": 14.0,
            "void_outer_radius": 19.0,
            "void_angle": 70.0,
            "void_orientation": orientation,
        }
        for orientation in ("along", "across")
    )

    void_inner_radius: float = Field(gt=0, description="inner radius of the voids, mm")
    void_outer_radius: float = Field(gt=0, description="outer radius of the voids, mm")
    void_angle: float = Field(gt=0, lt=180, description="angle of each void about the axis, degrees")
    void_orientation: Literal["along", "across"] = Field(
        default="along",
        description="direction of the radial load: along the line through the voids, or across it",
    )

    @model_validator(mode="before")
    @classmethod
    def _one_length(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "length" not in data:
            return data
        if {"inner_length", "outer_length"} & data.keys():
            raise ValueError("give either length, or inner_length and outer_length")
        length = data["length"]
        other_values = {key: value for key, value in data.items() if key != "length"}
        return other_values | {"inner_length": length, "outer_length": length}

    @model_validator(mode="after")
    def _inside_the_rubber(self) -> Any:
        if self.void_inner_radius >= self.void_outer_radius:
            raise ValueError("void_inner_radius must be smaller than void_outer_radius (mm)")
        if self.void_inner_radius <= self.inner_radius:
            raise ValueError(
                f"void_inner_radius = {self.void_inner_radius:g} cuts the inner sleeve "
                f"(inner_radius = {self.inner_radius:g}): rubber must remain between them"
            )
        if self.void_outer_radius >= self.outer_radius:
            raise ValueError(
                f"void_outer_radius = {self.void_outer_radius:g} cuts the outer sleeve "
                f"(outer_radius = {self.outer_radius:g}): rubber must remain between them"
            )
        return self

    @override
    def voids(self) -> tuple[Void, ...]:
        low, high = (
            (r - self.inner_radius) / self.thickness for r in (self.void_inner_radius, self.void_outer_radius)
        )
        half = 0.5 * math.radians(self.void_angle)
        first_angle = 0.0 if self.void_orientation == "along" else 0.5 * math.pi
        turn = 2 * math.pi
        centres = (first_angle, first_angle + math.pi)
        return tuple(Void((low, high), ((c - half) % turn, (c - half) % turn + 2 * half)) for c in centres)
