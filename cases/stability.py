"""Whether a law is stable in given states of deformation, and its stresses in coupon tests.

Drucker's postulate for an isotropic incompressible solid: d tau_i d e_i > 0 for every change of the principal
log strains that keeps the volume. With e3 = -e1 - e2 and W(e1, e2) that is a positive definite Hessian of W,
for tau_1 - tau_3 = dW/de1 and tau_2 - tau_3 = dW/de2 at the pressure held constant. Fitted laws often violate
it just outside the range of their data.

The law is evaluated by the same compiled UFL as in the body. Nothing here communicates: every rank of a
parallel run evaluates for itself.

References
----------
Ogden (1997), Non-Linear Elastic Deformations, Dover, sections 6.2 and 7.2.
Reese and Wriggers (1997), Material instabilities of an incompressible elastic cube under triaxial tension,
Int. J. Solids Struct. 34:3433-3454, doi:10.1016/S0020-7683(96)00203-7.
Dassault Systemes, Abaqus Theory Guide, 4.6.1 (Hyperelastic material behavior): the same criterion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cases.kernels import kernel
from cases.mode import modes
from forms.answers import principal_moduli
from forms.law import Law, UnknownName

Array = NDArray[np.float64]

# Stretches that are tried at once, on a path to the first unstable one; arbitrary.
_CHUNK = 512


@cache
def paths() -> Mapping[str, tuple[float, float]]:
    """Return the log strains (e1, e2) of each mode of an incompressible coupon per log stretch of a driven axis.

    Simple shear is not among them: its states are those of the planar mode, turned.
    """
    strains_by_mode = {}
    for mode in modes().values():
        if mode.specimen == "coupon" and not mode.needs_compressibility and not mode.sheared:
            strains: dict[str, float] = dict.fromkeys((face[-1] for face in mode.driven), 1.0)
            strains |= dict.fromkeys((face[-1] for face in mode.held if face.startswith("face_")), 0.0)
            # The free axes keep the volume.
            free = [axis for axis in "xyz" if axis not in strains]
            strains |= dict.fromkeys(free, -sum(strains.values()) / max(len(free), 1))
            strains_by_mode[mode.name] = (strains["x"], strains["y"])
    return strains_by_mode


def _evaluate(law: Law, parameters: Mapping[str, float], strains: Array) -> Array:
    """Return W_1, W_2, W_11, W_12, W_22 in MPa, shape (n, 5), at ``strains`` (e1, e2), shape (n, 2)."""
    names = tuple(sorted(parameters))
    values = np.array([float(parameters[name]) for name in names])
    inputs = {"strain": np.ascontiguousarray(strains, dtype=np.float64), "parameters": values}
    return kernel(principal_moduli(law, names))(len(strains), inputs)


def moduli(law: Law, parameters: Mapping[str, float], stretches: ArrayLike) -> Array:
    """Return the tangent moduli d2W/de_i de_j in the principal log strains, at constant volume.

    Parameters
    ----------
    law : Law
    parameters : mapping
        Name -> value, in the units of the law.
    stretches : array_like, shape (n, 3)
        Principal stretches; their volume ratio is divided out.

    Returns
    -------
    ndarray, shape (n, 2, 2)
        In MPa; NaN where the law has no energy (Gent beyond locking).
    """
    logs = np.log(np.asarray(stretches, dtype=np.float64).reshape(-1, 3))
    strains = (logs - logs.mean(axis=1, keepdims=True))[:, :2]
    return np.asarray(_evaluate(law, parameters, strains)[:, [2, 3, 3, 4]].reshape(-1, 2, 2))


def stable(law: Law, parameters: Mapping[str, float], stretches: ArrayLike) -> NDArray[np.bool_]:
    """Return whether Drucker's postulate holds in each state, shape (n,); parameters as for `moduli`.

    Parameters
    ----------
    law : Law
        The law.
    parameters : Mapping[str, float]
        Values by name, in the units of the law.
    stretches : ArrayLike
        Principal stretches, shape (n, 3).
    """
    H = moduli(law, parameters, stretches)
    # Both tests are false for NaN. A 2x2 matrix is positive definite when its trace and determinant are
    # positive.
    determinant = H[:, 0, 0] * H[:, 1, 1] - H[:, 0, 1] ** 2
    return np.asarray((H[:, 0, 0] + H[:, 1, 1] > 0) & (determinant > 0))


def nominal_stress(law: Law, parameters: Mapping[str, float], mode: str, stretch: ArrayLike) -> Array:
    """Return the nominal stress (MPa) of an incompressible coupon, in the shape of ``stretch``.

    ``mode`` is uniaxial, equibiaxial (stress in either direction) or planar (stress in the stretched
    direction).

    Parameters
    ----------
    law : Law
        The law.
    parameters : Mapping[str, float]
        Values by name, in the units of the law.
    mode : str
        uniaxial, equibiaxial (stress in either direction) or planar (stress in the stretched direction).
    stretch : ArrayLike
        Stretch in the loaded direction, any shape.

    Raises
    ------
    UnknownName
        When there is no such coupon mode.
    """
    path = _path(mode)
    stretch = np.asarray(stretch, dtype=np.float64)
    slopes = _evaluate(law, parameters, np.log(stretch).reshape(-1, 1) * path)[:, :2]
    # Work per volume is the number of driven faces times P d(stretch).
    return np.asarray((slopes @ path).reshape(stretch.shape) / (modes()[mode].shares * stretch))


def coupon_limits(
    law: Law,
    parameters: Mapping[str, float],
    names: Sequence[str] | None = None,
    lower: float = 0.1,
    upper: float = 10.0,
) -> dict[str, tuple[float, float]]:
    """Return for each coupon mode the interval of stretch around 1 in which the law is stable.

    Parameters
    ----------
    law : Law
        The law.
    parameters : Mapping[str, float]
        Values by name, in the units of the law.
    names : sequence of str, optional
        Coupon modes other than volumetric ones; all of them if not given.
    lower : float
        Least stretch that is searched, a ratio; the default is what Abaqus searches.
    upper : float
        Largest stretch that is searched, a ratio.

    Returns
    -------
    dict
        Mode -> (least, largest stable stretch), to 1e-4; 0 and inf where the law is stable as far as
        searched, (1, 1) where it is not stable even undeformed.
    """
    return {
        mode: (_limit(law, parameters, mode, lower, 0.0), _limit(law, parameters, mode, upper, float("inf")))
        for mode in (paths() if names is None else names)
    }


def _limit(law: Law, parameters: Mapping[str, float], mode: str, end: float, beyond: float) -> float:
    """Return the last stable stretch on the way from 1 to ``end``, or ``beyond``."""
    path = _path(mode)
    low, high = 0.0, float(np.log(end))
    while True:
        e = np.linspace(low, high, _CHUNK)
        strains = e[:, None] * path
        is_stable = stable(law, parameters, np.exp(np.column_stack((strains, -strains.sum(axis=1)))))
        if is_stable.all():
            return beyond
        first_unstable = int(np.argmin(is_stable))
        if first_unstable == 0:
            return 1.0
        if abs(e[first_unstable] - e[first_unstable - 1]) < 1e-5:
            return float(np.exp(e[first_unstable - 1]))
        low, high = float(e[first_unstable - 1]), float(e[first_unstable])


def _path(mode: str) -> NDArray[Any]:
    if mode not in paths():
        raise UnknownName(mode, "coupon mode with a closed stress", tuple(paths()))
    return np.array(paths()[mode])
