"""Where a measured curve is, and how its file is to be read.

Written by the case file, read by `bushcli.recording`; it stands below both, so that neither needs the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

#: What a column may hold, as in the ``columns`` and ``units`` keys of a case file.
Quantity = Literal["time", "displacement", "force"]


@dataclass(frozen=True)
class Source:
    """A recorded curve in a text file.

    Attributes
    ----------
    mode : str
        Name of the deformation mode; it decides what the columns mean.
    file : Path
    name : str
        Of the channel; the mode's name when empty.
    columns : mapping of Quantity to str or int
        Column by name or by 1-based number; what is not given is found by its name.
    units : mapping of Quantity to str
        Unit by quantity; it overrides what the file says. See `bushcli.recording.columns.UNITS`.
    delimiter : str, optional
        "," ";" "\\t" or " " (any white space); found out when None.
    decimal : {".", ","}, optional
        Found out when None.
    cycles : tuple of int, optional
        1-based numbers of the cycles to use; all when None.
    """

    mode: str
    file: Path
    name: str = ""
    columns: Mapping[Quantity, str | int] = field(default_factory=dict)
    units: Mapping[Quantity, str] = field(default_factory=dict)
    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    cycles: tuple[int, ...] | None = None

    @property
    def label(self) -> str:
        """The channel's name."""
        return self.name or self.mode
