"""What is concealed: the values that are drawn, and the file in which they wait for the scorer."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

Kind = Literal["none", "single", "pair", "outside"]
Size = Literal["hidden", "faint", "clear", "large"]

# Standard errors beside the law's parameters: chi square falls by the square. Below FAINT only poor programs may be.
FAINT, CLEAR, LARGE, LARGEST = 6.0, 12.0, 40.0, 120.0


@dataclass(frozen=True)
class Specimen:
    """Bushing, rubber and channels.

    Attributes
    ----------
    shape : str
    dimensions : mapping
        mm.
    law : str
    parameters : mapping
        MPa, 1.
    bulk_modulus : float
        MPa; inf = incompressible.
    amplitude : mapping
        Largest displacement by channel, which is called by its mode; mm or rad.
    """

    shape: str
    dimensions: Mapping[str, float]
    law: str
    parameters: Mapping[str, float]
    bulk_modulus: float
    amplitude: Mapping[str, float]


@dataclass(frozen=True)
class Truth:
    """A recording's secret.

    Attributes
    ----------
    seed, attempt : int
        Of the random generator; the attempt grows when the one before could not be solved or seen.
    kind : {"none", "single", "pair", "outside"}
    program : str
        Of the first channel: "rich", "ramp" or "loop".
    coupons : bool
        Whether there are coupon tests, which hold the law.
    specimen : Specimen
    effects : mapping
        Name -> parameter -> value, in N, mm, MPa, s, rad.
    strength : mapping
        By how many standard errors each effect changes the recordings beside what the law's parameters, and the other
        effect, can do: fitted in earnest (`refit`) where the program is rich, else to first order in the law.
    look_alikes : tuple of str
        Other effects that would stay within 4 standard errors of these recordings, the law's parameters refitted;
        "nothing" where the law alone would.
    mesh : float
        By how many standard errors the default mesh is off, beside what the law's parameters can do.
    noise : mapping
        Standard deviation of the force's noise by channel, percent of the recorded range.
    step : mapping
        Of an outside effect: first cycle with the other stiffness, and the factor.
    seconds : float
        That making it took.
    given_up : tuple of str
        Why the attempts before it were given up.
    """

    seed: int
    attempt: int
    kind: Kind
    program: str
    coupons: bool
    specimen: Specimen
    effects: Mapping[str, Mapping[str, float]]
    strength: Mapping[str, float]
    look_alikes: tuple[str, ...]
    mesh: float
    noise: Mapping[str, float]
    step: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    given_up: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Of its folder, which says nothing."""
        return f"{self.seed:07d}"

    @property
    def rich(self) -> bool:
        """Whether the program tells much."""
        return self.program == "rich"

    @property
    def size(self) -> Size | None:
        """Class of the weakest effect; None without one."""
        if not self.strength:
            return None
        weakest = min(self.strength.values())
        if weakest < FAINT:
            return "hidden"
        return "faint" if weakest < CLEAR else "clear" if weakest < LARGE else "large"


def write_truth(truth: Truth, file: Path) -> None:
    """Write a truth as JSON."""
    file.write_text(json.dumps(asdict(truth), indent=1) + "\n", encoding="utf-8")


def read_truth(file: Path) -> Truth:
    """Read what `write_truth` wrote."""
    data: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    data["specimen"] = Specimen(**data["specimen"])
    return Truth(**data | {key: tuple(data[key]) for key in ("look_alikes", "given_up")})
