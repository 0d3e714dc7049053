"""Source of a table of dynamic stiffness: its files, and what the case file says about them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from bushcli.recording.quantities import DYNAMIC
from bushcli.recording.source import FaultKind
from cases.mode import Mode, modes

#: Columns of a table, as in the ``columns`` and ``units`` keys of a case file.
COLUMNS = tuple(key for key in DYNAMIC if key not in ("modulus", ""))
#: Hz; rubber's moduli have been measured up to some kHz in bushings, and at 1e5 Hz the wave in a soft rubber is shorter
#: than an element of the default mesh.
HIGHEST = 1e5
#: Columns of the raw loops.
LOOP_COLUMNS = ("time", "displacement", "force")


@dataclass(frozen=True)
class DynamicSource:
    """Files with a table of dynamic stiffness, or with the loops that it is made from.

    Attributes
    ----------
    mode : str
        Name of the deformation mode.
    files : tuple of Path
        One file, or one for each condition.
    name : str
        Name of the channel.
    pattern : str
        The files as the case file names them.
    columns : mapping of str to str or int
        Column by name or by 1-based number, see `COLUMNS` and `LOOP_COLUMNS`; the others are found by their names.
    units : mapping of str to str
        Unit by column; it overrides what the file says.
    delimiter : str, optional
    decimal : {".", ","}, optional
        Both are recognised from the file when None.
    group : str or int, optional
        Sheet or group of the file.
    rows : mapping of str to str or float
        Value, by column, of the rows that belong to the table.
    amplitude_is : {"peak", "double", "rms"}, optional
        What the file calls amplitude: the peak, the whole travel of a cycle, or the root mean square of the sine.
    stiffness_is : {"magnitude", "storage"}, optional
        What the file calls stiffness or modulus: |K*| or K'.
    loss_angle_is : {"loss", "complement"}, optional
        Whether the file has the loss angle, or 90 degrees minus it.
    across : {"amplitude", "preload"}, optional
        What a length in the names of the columns is.
    quantity : {"E", "G"}, optional
        Modulus of a coupon.
    frequency, amplitude, preload, preload_force, temperature : float, optional
        Of the whole file: Hz; mm, rad or strain (peak); mm, rad or strain; N, N mm or MPa; degrees C.
    accepted_faults : tuple of FaultKind
        Kinds of faults that the case file says are none.
    amplitude_factor : float
        On all amplitudes, where a diagnosis supposes that the file means others than are read.
    """

    mode: str
    files: tuple[Path, ...]
    name: str = ""
    pattern: str = ""
    columns: Mapping[str, str | int] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    group: str | int | None = None
    rows: Mapping[str, str | float] = field(default_factory=dict)
    amplitude_is: Literal["peak", "double", "rms"] | None = None
    stiffness_is: Literal["magnitude", "storage"] | None = None
    loss_angle_is: Literal["loss", "complement"] | None = None
    across: Literal["amplitude", "preload"] | None = None
    quantity: Literal["E", "G"] | None = None
    frequency: float | None = None
    amplitude: float | None = None
    preload: float | None = None
    preload_force: float | None = None
    temperature: float | None = None
    accepted_faults: tuple[FaultKind, ...] = ()
    amplitude_factor: float = 1.0

    @property
    def deformation(self) -> Mode:
        """The deformation mode."""
        return modes()[self.mode]

    @property
    def label(self) -> str:
        """The channel's name."""
        return self.name or self.mode
