"""Checks before a simulation: an unstable law, or a travel beyond the thickness of the rubber, is refused."""

from __future__ import annotations

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
    if not material.parameters:
        raise InputError(
            Problem(
                case.path.name,
                "material.parameters are not given",
                "",
                "give them, or [[coupons]] to fit them to",
            )
        )
    for finding in moduli(material):
        raise InputError(Problem(case.path.name, finding.what, "", finding.expected))
    # This import loads UFL, which a case whose law is still to be fitted does not need.
    from cases.stability import coupon_limits

    model = law(material.law)
    for mode, (low, high) in coupon_limits(model, dict(material.parameters)).items():
        if low > SMALL_STRAIN[0] or high < SMALL_STRAIN[1]:
            raise InputError(
                Problem(
                    case.path.name,
                    f"material.parameters make {material.law} unstable: in {mode} deformation it is stable only "
                    f"between stretches {low:.3g} and {high:.3g}",
                    "",
                    f"stable at least between {SMALL_STRAIN[0]:g} and {SMALL_STRAIN[1]:g}",
                )
            )


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
    gap = case.geometry.gap
    if gap is None:
        return
    for recording in recordings:
        furthest = float(np.abs(recording.displacement).max())
        if modes()[recording.mode].sideways * furthest >= gap:
            raise InputError(
                Problem(
                    str(recording.source),
                    f"goes to {furthest:.4g} mm, but the rubber is only {gap:.4g} mm thick",
                    "",
                    remedies.get(
                        recording.name,
                        "displacement in mm of the bushing in [geometry]; units = { displacement = ... } for another "
                        "unit",
                    ),
                )
            )
