"""Curve -> CSV with the column names that `read_recording` reads back; degrees outside."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from bushcli.curve.curve import Curve
from cases.mode import modes


def write_curve_csv(path: str | Path, curve: Curve) -> None:
    """Write a curve with columns such as ``time_s,displacement_mm,force_N``; without time where it has none.

    Parameters
    ----------
    path : path
        An existing file is replaced.
    curve : Curve
    """
    mode = modes()[curve.mode]
    if mode.sheared:
        names, q = ["shear_strain", "shear_stress_MPa"], curve.displacement
    elif mode.specimen == "coupon":
        names, q = ["stretch", "nominal_stress_MPa"], 1.0 + curve.displacement
    elif mode.rotational:
        names, q = ["rotation_deg", "moment_Nmm"], curve.displacement * (180.0 / math.pi)
    else:
        names, q = ["displacement_mm", "force_N"], curve.displacement
    columns = [q, curve.force]
    if curve.time is not None:
        names, columns = ["time_s", *names], [curve.time, *columns]
    # Twelve digits exceed the precision of any measurement, and 30 degrees are written as 30.
    rows = "".join(",".join(f"{value:.12g}" for value in row) + "\n" for row in np.column_stack(columns))
    Path(path).write_text(",".join(names) + "\n" + rows, encoding="utf-8")
