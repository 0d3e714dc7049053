"""Source of a measured curve: its file, and how the file has to be read.

`bushcli.case` makes sources from the case file, and `bushcli.recording` reads them; neither has to import the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from bushcli.errors import Problem, RecordingError
from cases.mode import Mode, modes

#: What a case file writes as the column of a time that is not to be read.
NO_TIME = "none"
#: Degrees C between which rubber is tested: from below its glass transition to what silicone and fluorine rubber stand.
#: Room temperature in kelvins is beyond it.
WARM = (-150.0, 250.0)
#: Quantities of a column, as in the ``columns`` and ``units`` keys of a case file.
Quantity = Literal["time", "displacement", "force"]
#: Kinds of the defects of a recording that have no physical cause, see `bushcli.faults`.
FaultKind = Literal[
    "sign", "position", "unit", "swapped", "clipped", "spikes", "stuck", "time", "extremes", "no_signal", "temperature",
    "loss_angle", "amplitude", "order",
]  # fmt: skip


@dataclass(frozen=True)
class SixColumns:
    """A recorded path of six motions; a source is one of its reactions.

    Attributes
    ----------
    motions : mapping of str to str or int
        Column of each recorded motion, "ux" to "rz"; the others are zero.
    chosen : mapping of str to str
        Columns that the case file names, "ux" to "mz".
    free : tuple of int
        Indices of motions that were free of force.
    name : str
        Name of the whole recording.
    """

    motions: Mapping[str, str | int]
    free: tuple[int, ...] = ()
    name: str = ""
    chosen: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Specimen:
    """Conversion of a coupon's file that does not hold nominal stress and stretch.

    Attributes
    ----------
    gauge_length : float, optional
        mm; the file holds a travel, which is divided by it.
    area : float, optional
        Undeformed cross-section, mm2; the file holds a force, which is divided by it.
    stress : {"engineering", "true", "pressure"}, optional
        True stress is force over deformed area; a pressure is that of a volumetric test, positive in compression. None:
        what the name of the column says.
    strain : {"engineering", "true", "volume"}, optional
        True strain is the logarithm of the stretch; the change of volume, or the volume ratio J, is that of a
        volumetric test. None: what the name of the column says.
    """

    gauge_length: float | None = None
    area: float | None = None
    stress: Literal["engineering", "true", "pressure"] | None = None
    strain: Literal["engineering", "true", "volume"] | None = None


@dataclass(frozen=True)
class Source:
    r"""A recorded curve in a file.

    Attributes
    ----------
    mode : str
        Name of the deformation mode; it determines the meaning of the columns.
    file : Path
    name : str
        Name of the channel; the mode's name when empty.
    columns : mapping of Quantity to str or int
        Column by name or by 1-based number; a column that is not given is found by its name. A time may be `NO_TIME`.
    units : mapping of Quantity to str
        Unit by quantity; it overrides what the file says. See `UNITS` and `bushcli.recording.header.units`.
    delimiter : str, optional
        "," ";" "\t" or " " (any white space); recognised from the file when None.
    decimal : {".", ","}, optional
        Recognised from the file when None.
    reverse : tuple of Quantity, optional
        Columns whose sign is reversed after reading; None where the case file says nothing about signs.
    cycles : tuple of int, optional
        1-based numbers of the cycles to use; all when None.
    branch : {"loading", "unloading", "both"}, optional
        Of a coupon: samples to which a law is fitted; loading, where there is any, if the case does not say it.
    largest_stretch : float, optional
        Points of a coupon at larger stretches are left out.
    accept : tuple of float
        Values that look like codes for missing ones, such as -9999, but were measured.
    accepted_faults : tuple of str
        Kinds of data faults (`bushcli.faults`) that the user has looked at and that are none.
    group : str or int, optional
        Sheet or group of the file, by name or by number from 1; found by its columns when None.
    rows : mapping of str to str or float
        Value, by column, of the rows that belong to the recording; of a file with many recordings one below the other.
    between : callable, optional
        Whether a line that is no row may stand between the names and the last row: it states a condition of the rows
        below it.
    sample_rate : float, optional
        Samples per second, Hz, of a file without a time.
    rate : float, optional
        Speed of the test without a time: mm/s, rad/s, or 1/s of a coupon.
    conditioning : int
        Number of first cycles that condition the specimen; they are simulated but not compared.
    specimen : Specimen
        Dimensions and measures of a coupon.
    standard : str, optional
        Name of the standard that the test claims to follow, see `bushcli.standards`.
    six : SixColumns, optional
        The path of six motions to which it belongs.
    temperature : float, optional
        Degrees C.
    temperature_column, temperature_unit : str or int, str
        Column of a temperature that changes along the recording, and its unit where the case gives it.
    """

    mode: str
    file: Path
    name: str = ""
    columns: Mapping[Quantity, str | int] = field(default_factory=dict)
    units: Mapping[Quantity, str] = field(default_factory=dict)
    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    cycles: tuple[int, ...] | None = None
    branch: Literal["loading", "unloading", "both"] | None = None
    largest_stretch: float | None = None
    reverse: tuple[Quantity, ...] | None = None
    accept: tuple[float, ...] = ()
    accepted_faults: tuple[str, ...] = ()
    group: str | int | None = None
    rows: Mapping[str, str | float] = field(default_factory=dict)
    between: Callable[[str], object] | None = None
    sample_rate: float | None = None
    rate: float | None = None
    conditioning: int = 0
    specimen: Specimen = Specimen()
    standard: str | None = None
    six: SixColumns | None = None
    temperature: float | None = None
    temperature_column: str | int | None = None
    temperature_unit: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "file", Path(self.file))

    def contents(self) -> bytes:
        """Return the present contents of the file (`bushcli.runtime.canonical`)."""
        return self.file.read_bytes()

    def refusal(self, what: str, remedy: str = "") -> RecordingError:
        """Return an error about the file.

        Parameters
        ----------
        what, remedy : str
            What is wrong, and what to do.
        """
        return RecordingError(Problem(str(self.file), what, "", remedy))

    def dimension(self, quantity: Quantity) -> str:
        """Return the key of `UNITS` that applies to a column of the file."""
        sizes = {"displacement": self.specimen.gauge_length, "force": self.specimen.area}
        mode = self.deformation
        raw = mode.specimen == "coupon" and sizes.get(quantity) is not None
        return dimension(quantity, "bushing" if raw else mode.specimen, mode.rotational and not raw)

    @property
    def deformation(self) -> Mode:
        """The deformation mode; it is refused if there is none of its name."""
        if self.mode not in modes():
            raise self.refusal(f'"{self.mode}" is not a mode', ", ".join(modes()))
        return modes()[self.mode]

    @property
    def is_untimed(self) -> bool:
        """Whether the case says that the time of the file is not to be read."""
        return self.columns.get("time") == NO_TIME

    @property
    def label(self) -> str:
        """The channel's name."""
        return self.name or self.mode


#: Factor from a unit to the internal one (N, mm, MPa, s, rad), by the measured quantity. Of the three ways to
#: write the deformation of a coupon, "stretch" is the ratio of lengths, "strain" and "percent" are the
#: nominal strain.
UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "length": {"mm": 1.0, "m": 1e3, "cm": 10.0, "um": 1e-3, "in": 25.4},
    "angle": {"deg": math.pi / 180.0, "rad": 1.0, "mrad": 1e-3},
    "force": {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605},
    "moment": {"Nmm": 1.0, "Nm": 1e3, "kNm": 1e6, "Ncm": 10.0, "lbfin": 112.9848290276167},
    "strain": {"stretch": 1.0, "strain": 1.0, "percent": 0.01},
    "stress": {"MPa": 1.0, "kPa": 1e-3, "Pa": 1e-6, "GPa": 1e3, "psi": 6.894757293168e-3},
}


def dimension(quantity: Quantity, specimen: str, rotational: bool) -> str:
    """Return the key of `UNITS` that applies to a column of a recording.

    Parameters
    ----------
    quantity : Quantity
        Time, displacement or force.
    specimen : str
        "bushing" or "coupon".
    rotational : bool
        Whether the displacement is an angle.
    """
    kinds = {"displacement": ("strain", "angle", "length"), "force": ("stress", "moment", "force")}
    if quantity == "time":
        return "time"
    return kinds[quantity][0 if specimen == "coupon" else 1 if rotational else 2]
