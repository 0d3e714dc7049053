"""Target rates of a design: "axial=350", "radial.secant@2=2500 +- 10 %", "radial.tangent@500N=2700"."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

from bushcli.case.tolerance import toleranced_number
from bushcli.errors import InputError, Problem, nearest
from cases.mode import modes

KINDS = ("initial", "secant", "tangent", "force", "travel")
EXAMPLES = 'axial=350, radial.secant@2=2500, radial.secant@500N=2500, "axial=350 +- 10 %"'
# A number and what stands behind it.
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)\Z")


@dataclass(frozen=True)
class Target:
    """A target rate of a design."""

    name: str  # as the user wrote it, without the value
    mode: str
    kind: str  # "initial" (stiffness at rest), "secant", "tangent", "force", or "travel" (at a load)
    travel: float  # mm or rad; nan for the initial stiffness and at a load
    value: float  # N/mm or N mm/rad, N or N mm
    deviation: float = math.nan  # that is allowed, in the same unit; nan where none is given
    load: float = math.nan  # N or N mm; nan where a travel is given

    @property
    def per_shown(self) -> float:
        """Ratio of displayed to internal value: stiffnesses of a rotation are displayed per degree."""
        if self.kind == "force" or not modes()[self.mode].rotational:
            return 1.0
        return math.degrees(1.0) if self.kind == "travel" else math.radians(1.0)

    @property
    def unit(self) -> str:
        """Displayed unit."""
        return unit_of(self.mode, self.kind)


def unit_of(mode: str, kind: str) -> str:
    """Return the displayed unit of a kind of rate or answer: mm, deg, N, N mm, N/mm, N mm/deg, MPa."""
    definition = modes()[mode]
    if definition.specimen == "coupon" and kind != "travel":
        return "MPa"
    travel, force = ("deg", "N mm") if definition.rotational else ("mm", "N")
    return {"travel": travel, "force": force}.get(kind, f"{force}/{travel}")


def place_of(where: str, mode: str, text: str) -> tuple[float, bool]:
    """Return what stands behind an "@", a travel (mm, degrees) or a load (N, N mm), and whether it is a load.

    Raises
    ------
    InputError
        There is no number, or its unit is neither that of a travel nor that of a load.
    """
    kind = modes()[mode]
    travel, loads = (
        ("deg", {"Nmm": 1.0, "Nm": 1e3, "kNm": 1e6}) if kind.rotational else ("mm", {"N": 1.0, "kN": 1e3})
    )
    units = " or ".join(loads)
    expected = f"@2 or @2{travel} for a travel, @500 with {units} for a load"
    if kind.specimen == "coupon":
        travel, loads, expected = "", {}, "@0.5 for a stretch of 1.5, or for a shear of 0.5"
    match = _NUMBER.match(text)
    if match is None:
        raise InputError(Problem(where, "has no number after @", "", expected))
    unit = match[2].replace(" ", "")
    if unit.startswith(","):
        pointed = f"@{text.strip().replace(',', '.')}"
        raise InputError(Problem(where, "has a decimal comma", pointed, expected))
    if unit not in ("", travel, *loads):
        what = f"{unit} is not the unit of a travel or of a load in mode {mode}"
        raise InputError(Problem(where, what, nearest(unit, [travel, *loads]), expected))
    return float(match[1]) * loads.get(unit, 1.0), unit in loads


def target(text: str) -> Target:
    """Return the target that ``NAME=VALUE`` defines.

    Raises
    ------
    InputError
        There is no such mode or rate, or no number.
    """
    where = f"--target {text}"
    name, equals, wanted = text.partition("=")
    name, wanted = name.strip(), wanted.strip()
    rate, at, travel = name.partition("@")
    mode, dot, kind = rate.partition(".")
    kind = kind if dot else "secant" if at else "initial"
    names = [
        definition.name
        for definition in modes().values()
        if definition.specimen == "bushing" and definition.follow is None
    ]
    if not equals or not name:
        raise InputError(Problem(where, "is not NAME=VALUE", "", EXAMPLES))
    if mode not in names:
        raise InputError(Problem(where, f"{mode} is not a mode", nearest(mode, names), ", ".join(names)))
    if kind not in KINDS:
        what = f"{kind} is not a kind of rate"
        raise InputError(Problem(where, what, nearest(kind, KINDS), ", ".join(KINDS)))
    if (kind == "initial") == bool(at):
        what = "has a travel, but an initial stiffness has none" if at else f"{kind} needs a travel"
        raise InputError(Problem(where, what, "", EXAMPLES))
    q, loaded = place_of(where, mode, travel) if at else (math.nan, False)
    if (kind == "travel" and not loaded) or (kind == "force" and loaded):
        what = "force needs a travel" if loaded else "travel needs a load"
        unit = "Nmm" if modes()[mode].rotational else "N"
        raise InputError(Problem(where, what, "", f"{mode}.force@5=1800, {mode}.travel@500{unit}=1.2"))
    tolerance = toleranced_number(wanted)
    try:
        value = tolerance.nominal if tolerance else float(wanted)
    except ValueError:
        raise InputError(Problem(where, f"{wanted or 'nothing'} is no number", "", EXAMPLES)) from None
    if not (value > 0.0 and math.isfinite(value)) or (at and not (math.isfinite(q) and q != 0.0)):
        what = "needs a value above 0, and a travel or load that is not 0"
        raise InputError(Problem(where, what, "", EXAMPLES))
    deviation = tolerance.deviation if tolerance else math.nan
    turn = math.radians(1.0) if modes()[mode].rotational else 1.0
    place = (math.nan, q) if loaded else (q * turn, math.nan)
    raw = Target(name, mode, kind, place[0], value, load=place[1])
    return replace(raw, value=value / raw.per_shown, deviation=deviation / raw.per_shown)
