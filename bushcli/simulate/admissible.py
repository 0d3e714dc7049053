"""Checks before a simulation: an unstable law, or a travel beyond the thickness of the rubber, is refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bushcli.case import Case, Material
from bushcli.case.checks import moduli
from bushcli.errors import InputError, Problem
from bushcli.faults import DataFault
from bushcli.recording import Recording
from cases.mode import modes
from forms.law import law

# Every rubber is stable between these stretches.
SMALL_STRAIN = (0.9, 1.1)


def check_material(case: Case, material: Material) -> None:
    """Refuse a material without parameters, with too small a bulk modulus, or unstable (Drucker) at small strain.

    Parameters
    ----------
    case : Case
        Case; the message names its file.
    material : Material
        Law and parameters to check.

    Raises
    ------
    InputError
    """
    where = case.path.name
    if not material.parameters:
        what, expected = "material.parameters are not given", "give them, or [[coupons]] to fit them to"
        raise InputError(Problem(where, what, "", expected))
    for finding in moduli(material):
        raise InputError(Problem(where, finding.what, "", finding.expected))
    # This import loads UFL, which a case whose law is still to be fitted does not need.
    from cases.stability import coupon_limits

    for mode, (low, high) in coupon_limits(law(material.law), dict(material.parameters)).items():
        if low > SMALL_STRAIN[0] or high < SMALL_STRAIN[1]:
            what = (
                f"material.parameters make {material.law} unstable: in {mode} deformation it is stable only "
            )
            what += f"between stretches {low:.3g} and {high:.3g}"
            expected = f"stable at least between {SMALL_STRAIN[0]:g} and {SMALL_STRAIN[1]:g}"
            raise InputError(Problem(where, what, "", expected))


def check_travel(case: Case, recordings: Sequence[Recording], faults: Sequence[DataFault]) -> None:
    """Refuse a recording that travels further across the axis than the rubber is thick: units or bushing are wrong.

    Parameters
    ----------
    case : Case
    recordings : sequence of Recording
        Recordings of the bushing, mm.
    faults : sequence of DataFault
        Faults of the recordings; the remedy of a fatal one goes into the message.

    Raises
    ------
    InputError
    """
    remedies = {fault.channel: fault.remedy for fault in reversed(faults) if fault.fatal}
    usual = "displacement in mm of the bushing in [geometry]; units = { displacement = ... } for another unit"
    gap = case.geometry.gap
    if gap is None:
        return
    for recording in recordings:
        furthest = float(np.abs(recording.displacement).max())
        mode, wall = modes()[recording.mode], case.geometry.wall
        across = mode.moves_across(furthest, 0.0 if wall is None else wall.facing)
        if across >= gap:
            angle = f"{math.degrees(furthest):.4g} degrees, which moves an end of the inner sleeve by "
            moved = f"{angle if mode.rotational else ''}{across:.4g} mm"
            what = f"goes to {moved}, but the rubber is only {gap:.4g} mm thick"
            expected = remedies.get(recording.name, usual)
            raise InputError(Problem(str(recording.source), what, "", expected))
