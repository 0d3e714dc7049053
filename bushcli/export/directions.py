"""Directions of a bushing's forces, and the modes whose results stand for them; the bushing's axis is z."""

from __future__ import annotations

from cases.mode import modes

#: Forces and moments on the inner sleeve, in the order of a stiffness matrix's rows.
FORCES = ("FX", "FY", "FZ", "TX", "TY", "TZ")


def mode_of(direction: str) -> str:
    """Return the name of the mode whose curve stands for a direction FX to TZ."""
    return next(mode.name for mode in modes().values() if direction in mode.directions)
