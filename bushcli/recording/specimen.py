"""Coupons: force and travel, or true stress and strain, -> stretch - 1 and nominal stress.

In uniaxial, equibiaxial and planar tests the rubber keeps its volume: the deformed area normal to a load is the
undeformed area divided by the stretch along this load. In a volumetric test all three stretches are J^(1/3), and a
face grows by J^(2/3): the nominal stress is J^(2/3) times the true one, which is minus the pressure. In simple shear,
strain and stress are the amount of shear and the shear stress.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.source import Source

Array = NDArray[np.float64]
_Curve = tuple[Array, Array]

#: No rubber reaches a larger logarithmic strain: exp(3) = 20.
_LARGEST_STRAIN = 3.0
_IN_PERCENT = "if it is in percent, give its unit in units"


def nominal(source: Source, moved: Array, forced: Array, strain_form: str, stress_form: str) -> _Curve:
    """Return stretch - 1 and nominal stress in MPa of a coupon."""
    specimen, mode = source.specimen, source.deformation
    strain = np.asarray(moved / (1.0 if specimen.gauge_length is None else specimen.gauge_length))
    stress = np.asarray(forced / (1.0 if specimen.area is None else specimen.area))
    if strain_form == "true":
        if np.abs(strain).max() > _LARGEST_STRAIN:
            largest = np.abs(strain).max()
            what = f"reaches a logarithmic strain of {largest:.3g}, beyond that of a stretch of 20"
            raise source.refusal(what, _IN_PERCENT)
        strain = np.expm1(strain)
    if not mode.sheared and (strain <= -1.0).any():
        what, expected = f"a strain of {strain.min():.4g} compresses the specimen to zero size", _IN_PERCENT
        if specimen.gauge_length is not None:
            what = f"the travel of {moved.min():.4g} mm compresses a specimen of {specimen.gauge_length:g} mm"
            what, expected = f"{what} to zero length", "gauge_length in mm; the travel must start at 0"
        raise source.refusal(what, expected)
    if mode.needs_compressibility:
        volume = 1.0 + strain if strain_form == "volume" else (1.0 + strain) ** 3
        stress = -stress if stress_form == "pressure" else stress
        stress = stress if stress_form == "engineering" else stress * volume ** (2.0 / 3.0)
        grows, pulled = (abs(values.min()) < values.max() for values in (volume - 1.0, stress))
        # Rubber cavitates at a tension of some MPa from all sides: what is positive is compression.
        if (grows or pulled) and source.reverse is None:
            signs = "pressure is negative in compression"
            if grows:
                signs = f"volume increases {'under tension from all sides' if pulled else 'in compression'}"
            what = f"by the signs of the columns the {signs}: nobody tests rubber like that"
            turned = (("displacement", grows), ("force", pulled))
            listed = ", ".join(f'"{name}"' for name, holds in turned if holds)
            right = "reverse = [] if the signs are right"
            expected = f"reverse = [{listed}] in the table of the case file, or {right}"
            raise source.refusal(what, expected)
        strain = volume ** (1.0 / 3.0) - 1.0
    elif stress_form == "true" and not mode.sheared:
        stress = stress / (1.0 + strain)
    return strain, stress
