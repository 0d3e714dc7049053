"""Display of numbers: units of a mode for the user (mm, degrees, N, N mm), and significant digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.document import Array
from bushcli.runtime.digits import with_decimals
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.simulate.response import SixCurve


@dataclass(frozen=True)
class Quantities:
    """Names and units of a mode's displacement and force, and the conversion from internal units."""

    displacement: str
    displacement_unit: str
    force: str
    force_unit: str
    stiffness_unit: str
    per_internal: float = 1.0  # ratio of displayed to internal displacement: degrees per radian, else 1
    rest: float = 0.0  # displayed value of the undeformed state: 1 for the stretch of a coupon, else 0
    csv_names: tuple[str, str] = ("displacement_mm", "force_N")  # columns of displacement and force

    def convert(self, displacement: Array) -> Array:
        """Convert a displacement from internal units (mm, rad, stretch - 1) to mm, degrees, stretch."""
        return self.rest + self.per_internal * displacement

    def at(self, displacement: float) -> float:
        """Convert one displacement from internal units to mm, degrees, stretch."""
        return self.rest + self.per_internal * float(displacement)

    def stiffness(self, internal: float) -> float:
        """Convert a stiffness from N/mm, N mm/rad or MPa to N/mm, N mm/degree or MPa."""
        return internal / self.per_internal

    @property
    def rate_unit(self) -> str:
        """Unit of a rate of the displacement."""
        return f"{self.displacement_unit or '1'}/s"

    @property
    def displacement_label(self) -> str:
        """Label of an axis for the displacement."""
        return f"{self.displacement} [{self.displacement_unit}]".removesuffix(" []")

    @property
    def force_label(self) -> str:
        """Label of an axis for the force."""
        return f"{self.force} [{self.force_unit}]"

    @property
    def labels(self) -> tuple[str, str]:
        """Labels of the axes of a curve."""
        return self.displacement_label, self.force_label


_TRANSLATION = Quantities("displacement", "mm", "force", "N", "N/mm")
_DEGREES, _ANGLE = 180.0 / math.pi, ("rotation_deg", "moment_Nmm")
_ROTATION = Quantities("rotation", "deg", "moment", "N mm", "N mm/deg", _DEGREES, csv_names=_ANGLE)
_STRESS = ("stretch", "nominal_stress_MPa")
_COUPON = Quantities("stretch", "", "nominal stress", "MPa", "MPa", rest=1.0, csv_names=_STRESS)
_SHEAR = ("shear_strain", "shear_stress_MPa")
_SHEARED = Quantities("amount of shear", "", "shear stress", "MPa", "MPa", csv_names=_SHEAR)


def quantities(mode: str) -> Quantities:
    """Return names and units of displacement and force of a mode."""
    definition = modes()[mode]
    if definition.specimen == "coupon":
        return _SHEARED if definition.sheared else _COUPON
    return _ROTATION if definition.rotational else _TRANSLATION


def number(value: float | None, digits: int = 3, limits: Sequence[float] = ()) -> str:
    """Return a number in decimal notation, with an exponent only below 1e-4 and from 1e7 on."""
    if value is None or math.isnan(value):
        return "-"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    if value == 0.0:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:.{digits - 1}e}"
    magnitude = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    # All digits before the decimal point are shown: 1234, not 1230, which a reader could take for the exact value.
    return with_decimals(value, *limits, decimals=max(digits - 1 - magnitude, 0))


def with_std(value: float, std: float) -> str:
    """Return a value and its standard error, as many digits as the error permits: "0.1175 ± 0.0002"."""
    if not math.isfinite(std) or std <= 0:
        return number(value, 4)
    if max(abs(value), std) < 1e-4:
        return f"{number(value, 2)} ± {number(std, 2)}"
    decimals = max(1 - math.floor(math.log10(float(f"{std:.1e}"))), 0)
    return f"{value:.{decimals}f} ± {std:.{decimals}f}"


def percent(value: float | None, limit: float | None = None) -> str:
    """Return a percentage as text: one decimal below ten, and enough to show on which side of a limit it is."""
    if value is None or not math.isfinite(value):
        return "-"
    limits, decimals = [] if limit is None else [limit], 2 if abs(value) < 1 else 1 if abs(value) < 10 else 0
    return f"{with_decimals(value, *limits, decimals=decimals)} %"


def interval(low: float, high: float, text_of: Callable[[float], str] = number) -> str:
    """Return an interval in words: "0.1 to 0.3", "below 0.3", "above 0.1", "all"; an end that is not finite is open."""
    if not math.isfinite(low):
        return f"below {text_of(high)}" if math.isfinite(high) else "all"
    return f"{text_of(low)} to {text_of(high)}" if math.isfinite(high) else f"above {text_of(low)}"


def channel_label(name: str, held_out: bool) -> str:
    """Return the name of a channel, with "(held out)" where it was not used in a fit."""
    return f"{name} (held out)" if held_out else name


def join_names(names: list[str]) -> str:
    """Join names as in a sentence: a, b and c."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else ""


MOTION_UNITS, FORCE_UNITS = ("mm",) * 3 + ("deg",) * 3, ("N",) * 3 + ("N mm",) * 3
# Forces or moments that are all below this share of the largest value of both, in N and N mm, are rounding errors:
# Newton's method leaves 1e-9 of it in the moment of a free tilt.
_ROUNDING = 1e-6


def shown_motion(six: SixCurve) -> Array:
    """Return the motions in mm and degrees, shape (n, 6)."""
    return np.hstack([six.motion[:, :3], np.degrees(six.motion[:, 3:])])


def largest_reactions(force: Array) -> tuple[float, float]:
    """Return the largest force (N) and the largest moment (N mm) of reactions of shape (n, 6).

    It is infinite where all of them are rounding errors, as moments are if each belongs to a free or symmetric motion.
    """
    largest = float(np.abs(force).max())
    forces, moments = (float(np.abs(force[:, part]).max()) for part in (slice(0, 3), slice(3, 6)))
    threshold = _ROUNDING * largest
    return (forces if forces > threshold else np.inf), (moments if moments > threshold else np.inf)
