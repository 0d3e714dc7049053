"""The truth: the drawn values, and the file that keeps them for the scorer."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

Kind = Literal["none", "single", "pair", "outside"]
Size = Literal["hidden", "faint", "clear", "large"]

# Limits of strength in standard errors: chi square falls by the square. Only poor programs may be below FAINT.
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
        Seed of the random generator; number of the attempt, since earlier ones could not be solved or seen.
    kind : {"none", "single", "pair", "outside"}
    program : str
        Program of the first channel: "rich", "ramp" or "loop".
    coupons : bool
        Whether there are coupon tests, which fix the law.
    specimen : Specimen
    effects : mapping
        Name -> parameter -> value, in N, mm, MPa, s, rad.
    strength : mapping
        By how many standard errors each effect changes the recordings beyond what the law's parameters and the other
        effect can imitate: by a nonlinear fit (`refit`) where the program is rich, else to first order in the law.
    look_alikes : tuple of str
        Other effects that stay within 4 standard errors of these recordings when the law's parameters are refitted;
        "nothing" where the law alone does.
    mesh : float
        Error of the default mesh in standard errors, beyond what the law's parameters can imitate.
    noise : mapping
        Standard deviation of the force's noise by channel, percent of the recorded range.
    step : mapping
        For an outside effect: first cycle with the changed stiffness, and the factor.
    seconds : float
        Time that making it took.
    given_up : tuple of str
        Reasons why earlier attempts were given up.
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
        """Name of its folder, which reveals nothing."""
        return f"{self.seed:07d}"

    @property
    def rich(self) -> bool:
        """Whether the program is rich."""
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
