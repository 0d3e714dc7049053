"""Consistent systems of units for finite-element programs, which themselves know no units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bushcli.errors import InputError, Problem, nearest

_POUND_FORCE = 4.4482216152605  # N, exact: 0.45359237 kg times 9.80665 m/s2
_INCH = 0.0254  # m, exact


@dataclass(frozen=True)
class UnitSystem:
    """A consistent system of units: force, length and time; the unit of mass follows from them."""

    name: str  # as on the command line
    force: float  # N
    length: float  # m
    time: float  # s
    # Names for comments and tables.
    force_name: str
    length_name: str
    time_name: str
    stress_name: str
    density_name: str

    def of_stress(self, megapascal: float) -> float:
        """Convert a stress or an energy density from MPa."""
        return megapascal * 1e6 * self.length**2 / self.force

    def of_time(self, seconds: float) -> float:
        """Convert a time from s."""
        return seconds / self.time

    def of_frequency(self, hertz: float) -> float:
        """Convert a frequency from Hz to cycles per unit of time."""
        return hertz * self.time

    def of_density(self, kilogram_per_cubic_metre: float) -> float:
        """Convert a density from kg/m3: the unit of mass is force time^2 / length."""
        return kilogram_per_cubic_metre * self.length**4 / (self.force * self.time**2)

    def of_length(self, millimetre: float) -> float:
        """Convert a length from mm."""
        return millimetre * 1e-3 / self.length

    def of_force(self, newton: float) -> float:
        """Convert a force from N."""
        return newton / self.force

    def of_moment(self, newton_millimetre: float) -> float:
        """Convert a moment from N mm."""
        return newton_millimetre * 1e-3 / (self.force * self.length)

    @property
    def moment_name(self) -> str:
        """Name of the unit of moment."""
        return f"{self.force_name} {self.length_name}"


SYSTEMS: Mapping[str, UnitSystem] = MappingProxyType(
    {
        system.name: system
        for system in (
            UnitSystem("N-mm-s", 1.0, 1e-3, 1.0, "N", "mm", "s", "MPa", "t/mm3"),
            UnitSystem("SI", 1.0, 1.0, 1.0, "N", "m", "s", "Pa", "kg/m3"),
            UnitSystem("kN-mm-ms", 1e3, 1e-3, 1e-3, "kN", "mm", "ms", "GPa", "kg/mm3"),
            UnitSystem("N-mm-ms", 1.0, 1e-3, 1e-3, "N", "mm", "ms", "MPa", "g/mm3"),
            UnitSystem("lbf-in-s", _POUND_FORCE, _INCH, 1.0, "lbf", "in", "s", "psi", "lbf s2/in4"),
        )
    }
)


def unit_system(name: str) -> UnitSystem:
    """Return the system of units called ``name``, in upper or lower case.

    Raises
    ------
    InputError
        When there is no such system; the message names the nearest.
    """
    for system in SYSTEMS.values():
        if system.name.casefold() == name.casefold():
            return system
    raise InputError(
        Problem("--units", f'"{name}" is not a system of units', nearest(name, SYSTEMS), ", ".join(SYSTEMS))
    )
