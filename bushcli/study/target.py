"""Target rates of a design: "axial=350", "radial.secant@2=2500 +- 10 %", "radial.tangent@500N=2700"."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

from bushcli.case.toleranced import toleranced
from bushcli.errors import InputError, Problem, nearest
from cases.mode import modes

KINDS = ("initial", "secant", "tangent", "force", "travel")
EXAMPLES = 'axial=350, radial.secant@2=2500, radial.secant@500N=2500, "axial=350 +- 10 %"'
_LOAD = re.compile(r"(.+?)\s*(N|Nmm|N mm)\Z")


@dataclass(frozen=True)
class Target:
    """A target rate of a design.

    Attributes
    ----------
    name : str
        As the user wrote it, without the value.
    kind : str
        "initial" (stiffness at rest), "secant" (stiffness over the travel), "tangent" (stiffness there), "force", or
        "travel" (at a load).
    travel : float
        mm or rad; nan for the initial stiffness and at a load.
    value : float
        Target value: N/mm or N mm/rad, N or N mm.
    deviation : float
        Allowed deviation, in the same unit; nan where none is given.
    load : float
        N or N mm; nan where a travel is given.
    """

    name: str
    mode: str
    kind: str
    travel: float
    value: float
    deviation: float = math.nan
    load: float = math.nan

    @property
    def per_shown(self) -> float:
        """Ratio of displayed to internal value: stiffnesses of a rotation are displayed per degree."""
        if self.kind == "force" or not modes()[self.mode].rotational:
            return 1.0
        return math.degrees(1.0) if self.kind == "travel" else math.radians(1.0)

    @property
    def unit(self) -> str:
        """Displayed unit."""
        turned = modes()[self.mode].rotational
        force = "N mm" if turned else "N"
        if self.kind == "travel":
            return "deg" if turned else "mm"
        return force if self.kind == "force" else f"{force}/{'deg' if turned else 'mm'}"


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
    known = [one.name for one in modes().values() if one.specimen == "bushing" and one.follow is None]
    if not equals or not name:
        raise InputError(Problem(where, "is not NAME=VALUE", "", EXAMPLES))
    if mode not in known:
        raise InputError(Problem(where, f"{mode} is not a mode", nearest(mode, known), ", ".join(known)))
    if kind not in KINDS:
        raise InputError(
            Problem(where, f"{kind} is not a kind of rate", nearest(kind, KINDS), ", ".join(KINDS))
        )
    if (kind == "initial") == bool(at):
        what = "has a travel, but an initial stiffness has none" if at else f"{kind} needs a travel"
        raise InputError(Problem(where, what, "", EXAMPLES))
    loaded = _LOAD.match(travel.strip())
    unit = "Nmm" if modes()[mode].rotational else "N"
    if (kind == "travel" and not loaded) or (kind == "force" and loaded):
        what = "force needs a travel" if loaded else "travel needs a load"
        raise InputError(Problem(where, what, "", f"{mode}.force@5=1800, {mode}.travel@500{unit}=1.2"))
    if loaded and loaded[2].replace(" ", "") != unit:
        raise InputError(
            Problem(where, f"{loaded[2]} is not the unit of a load in mode {mode}", "", f"@500{unit}")
        )
    found = toleranced(wanted)
    try:
        value, deviation = (found.nominal, found.deviation) if found else (float(wanted), math.nan)
        q = float(loaded[1] if loaded else travel) if at else math.nan
    except ValueError:
        raise InputError(Problem(where, "has no number", "", EXAMPLES)) from None
    if not (value > 0.0 and math.isfinite(value)) or (at and not (math.isfinite(q) and q != 0.0)):
        raise InputError(
            Problem(where, "needs a value above 0, and a travel or load that is not 0", "", EXAMPLES)
        )
    turn = math.radians(1.0) if modes()[mode].rotational else 1.0
    place = (math.nan, q) if loaded else (q * turn, math.nan)
    raw = Target(name, mode, kind, place[0], value, load=place[1])
    return replace(raw, value=value / raw.per_shown, deviation=deviation / raw.per_shown)
