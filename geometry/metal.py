"""Elastic constants of plates and sleeves, as a case file gives them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Protocol

from pydantic import BaseModel, ConfigDict, Field, model_validator

from geometry.errors import GeometryError

#: Young's modulus of bodies that do not deform, MPa.
RIGID = 1e7


class Metal(Protocol):
    """Elastic constants of a metal body."""

    @property
    def youngs_modulus(self) -> float:
        """Young's modulus of the metal, MPa."""

    @property
    def poissons_ratio(self) -> float:
        """Poisson's ratio of the metal."""

    @property
    def density(self) -> float:
        """Density of the metal, kg/m3."""


class Plate(BaseModel):
    """An elastic metal body of any form, inside the rubber or on its side."""

    model_config = ConfigDict(frozen=True, defer_build=True, extra="forbid", allow_inf_nan=False)

    youngs_modulus: float = Field(default=210000.0, gt=0, description="Young's modulus, MPa (steel)")
    poissons_ratio: float = Field(default=0.3, ge=0, lt=0.5, description="Poisson's ratio (steel)")
    # EN 1993-1-1, 3.2.6.
    density: float = Field(
        default=7850.0, ge=500, le=25000, description="density (steel), kg/m3; for vibrations only"
    )
    rigid: bool = Field(default=False, description="true = does not deform, whatever its modulus")

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Plate:
        if self.rigid and "youngs_modulus" in self.model_fields_set:
            raise ValueError("has rigid = true and a youngs_modulus: give one of them")
        return self

    @property
    def metal(self) -> Plate:
        """Metal used in the computation: a rigid plate is fifty times as stiff as steel."""
        return self.model_copy(update={"youngs_modulus": RIGID}) if self.rigid else self


def is_rigid(metal: Metal) -> bool:
    """Whether the case calls a body rigid."""
    return isinstance(metal, Plate) and metal.rigid


def metal_text(metal: Metal) -> str:
    """Return the words for a body of metal: its modulus, or that it is rigid."""
    if is_rigid(metal):
        return f"rigid, computed with E = {metal.youngs_modulus:g} MPa"
    return f"metal, E = {metal.youngs_modulus:g} MPa"


def metals(
    plates: Mapping[str, Plate], regions: Iterable[str], known_names: Iterable[str], where: str
) -> dict[str, Metal]:
    """Return the metal of each region other than the rubber.

    Parameters
    ----------
    plates
        Plates of the case, by name.
    regions
        Meshed regions.
    known
        Names that the case may give a metal, meshed or not.
    where
        File or key of the case, for messages.

    Raises
    ------
    GeometryError
        The case gives a metal to a body that does not exist.
    """
    names = [name for name in known_names if name != "rubber"]
    for name in plates:
        if name not in names:
            choices = ", ".join(names) or "there are none"
            raise GeometryError(where, f'geometry.plates: there is no plate or sleeve "{name}"', choices)
    return {name: plates.get(name, Plate()).metal for name in regions if name != "rubber"}
