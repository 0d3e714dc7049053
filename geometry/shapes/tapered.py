"""Tapered: the bonds inside and outside have different lengths; the free ends are conical or hollowed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import override

from geometry.blocks import Array
from geometry.ring import Ring


class Tapered(Ring):
    """Rubber ring with straight conical ends, or with ends hollowed by a parabola of given depth."""

    name: ClassVar[str] = "tapered"
    summary: ClassVar[str] = "rubber ring with conical or hollowed (concave) free ends"
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"inner_radius": 12.0, "outer_radius": 22.0, "inner_length": 40.0, "outer_length": 30.0},
        {
            "inner_radius": 12.0,
            "outer_radius": 22.0,
            "inner_length": 40.0,
            "outer_length": 36.0,
            "profile": "concave",
            "profile_depth": 4.0,
        },
    )

    inner_length: float = Field(gt=0, description="bonded length on the inner sleeve, mm")
    outer_length: float = Field(gt=0, description="bonded length on the outer sleeve, mm")
    profile: Literal["straight", "concave"] = Field(default="straight", description="form of the free ends")
    profile_depth: float = Field(
        default=0.0, ge=0, description="how deep each end is hollowed, midway between the bonds, mm"
    )

    @model_validator(mode="after")
    def _ends(self) -> Any:
        if self.profile == "straight" and self.profile_depth > 0:
            raise ValueError('profile_depth needs profile = "concave"')
        if self.profile == "concave" and self.profile_depth == 0:
            raise ValueError('profile = "concave" needs profile_depth > 0 (mm)')
        if float(self.half_length(np.linspace(0.0, 1.0, 101, dtype=np.float64)).min()) <= 0:
            raise ValueError(f"profile_depth = {self.profile_depth:g} mm hollows the rubber through")
        return self

    @override
    def half_length(self, s: Array) -> Array:
        straight = 0.5 * (self.inner_length + s * (self.outer_length - self.inner_length))
        return straight - self.profile_depth * 4.0 * s * (1.0 - s)
