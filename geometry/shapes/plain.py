"""Plain: a rubber annulus, bonded inside and outside over its whole length."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field
from typing_extensions import override

from geometry.blocks import Array
from geometry.ring import Ring


class Plain(Ring):
    """Rubber annulus with plane free ends."""

    name: ClassVar[str] = "plain"
    summary: ClassVar[str] = "rubber annulus with plane free ends"
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"inner_radius": 12.0, "outer_radius": 22.0, "length": 40.0},
    )

    length: float = Field(gt=0, description="bonded length, mm")

    @override
    def half_length(self, s: Array) -> Array:
        return np.full_like(s, 0.5 * self.length)
