"""By how many standard errors an effect shows beyond the changes that the law's parameters can make.

With d the change of the noise-free curves over the noise, and J their derivatives by the parameters that are fitted,
the strength is the norm of the rest of d after a least-squares fit of J: chi square falls by its square when the
effect is added to a refitted law. It is exact in the effect, to first order in the law. The uncertain common factor of
a channel's forces, by calibration and mesh, counts as noise that its samples share.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rest_beside(change: Array, taken: Sequence[Array]) -> Array:
    """Rest of a change (n,) after a fit of multiples of the columns in `taken`, (n,) or (n, k) each."""
    columns = [np.reshape(column, (len(change), -1)) for column in taken]
    if not columns:
        return change
    J = np.hstack(columns)
    size = np.linalg.norm(J, axis=0)
    J = J[:, size > 0] / size[size > 0]
    return np.asarray(change - J @ np.linalg.lstsq(J, change, rcond=1e-10)[0])


def beside_a_factor(rows: Array, force: Array, spread: float) -> Array:
    """Multiply (n,) or (n, k) by the inverse root of 1 + s^2 F F', the covariance of noise and a common factor.

    Parameters
    ----------
    rows, force : shape (n,) or (n, k), and (n,)
        Divided by the noise.
    spread
        Standard deviation s of the factor.
    """
    unit = force / max(float(np.linalg.norm(force)), 1e-300)
    share = 1.0 - 1.0 / np.sqrt(1.0 + spread**2 * float(force @ force))
    return np.asarray(rows - share * np.multiply.outer(unit, unit @ rows))


def strength(change: Array, taken: Sequence[Array]) -> float:
    """Norm of the rest of a change, in standard errors."""
    return float(np.linalg.norm(rest_beside(change, taken)))


def apart(change: Array, other: Array, taken: Sequence[Array], one_sided: bool) -> float:
    """Distance of a change from any amplitude of another effect and any parameters of the law, in standard errors."""
    d, g = rest_beside(change, taken), rest_beside(other, taken)
    along = float(d @ g) / max(float(g @ g), 1e-300)
    if one_sided:
        along = max(along, 0.0)
    return float(np.linalg.norm(d - along * g))
