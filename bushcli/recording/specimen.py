"""Coupons: force and travel, or true stress and strain, -> stretch - 1 and nominal stress.

In uniaxial, equibiaxial and planar tests the rubber keeps its volume: the deformed area normal to a load is the
undeformed area divided by the stretch along this load. That does not hold in a volumetric test.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError
from bushcli.recording.source import Source
from cases.mode import Mode

Array = NDArray[np.float64]

#: No rubber reaches a larger logarithmic strain: exp(3) = 20.
_LARGEST_STRAIN = 3.0


def nominal(source: Source, mode: Mode, moved: Array, forced: Array) -> tuple[Array, Array]:
    """Return stretch - 1 and nominal stress in MPa of a coupon.

    Parameters
    ----------
    source : Source
    mode : Mode
    moved : (n,) array
        Travel in mm where the source has a gauge length, else stretch - 1, or the logarithmic strain.
    forced : (n,) array
        Force in N where the source has an area, else stress in MPa.

    Raises
    ------
    RecordingError
        When a stretch would not be positive, or a logarithmic strain is beyond any rubber.
    """
    specimen = source.specimen
    if mode.specimen != "coupon":
        return moved, forced
    strain = moved if specimen.gauge_length is None else moved / specimen.gauge_length
    stress = forced if specimen.area is None else forced / specimen.area
    if specimen.strain == "true":
        if np.abs(strain).max() > _LARGEST_STRAIN:
            what = (
                f"reaches a logarithmic strain of {np.abs(strain).max():.3g}, beyond that of a stretch of 20"
            )
            raise RecordingError(
                Problem(str(source.file), what, "", "if it is in percent, give its unit in units")
            )
        strain = np.expm1(strain)
    if (strain <= -1.0).any():
        length = f"{specimen.gauge_length:g} mm"
        what = f"the travel of {moved.min():.4g} mm compresses a specimen of {length} to zero length"
        expected = "gauge_length in mm; the travel must start at 0"
        raise RecordingError(Problem(str(source.file), what, "", expected))
    if specimen.stress == "true":
        stress = stress / (1.0 + strain)
    return np.asarray(strain), np.asarray(stress)
