"""Sums of powers of the principal stretches in closed form, differentiable twice at any deformation.

``tr(C^beta)`` is an analytic function of the invariants of C, also where eigenvalues coincide; the
eigenvalues themselves are not, and their textbook formulas lose their derivatives there. So no eigenvalue is
used where it is not smooth:

- A pair of eigenvalues a + d, a - d enters by its mean a and by d^2, never by d: as a binomial series where d
  is small.
- Of three eigenvalues the best separated one (the largest, or the smallest) is a smooth function of the
  invariants; the other two are such a pair.
- Where all three nearly coincide, a binomial series in the invariants of the deviator takes over.

Every branch is evaluated with arguments that keep it finite, because UFL differentiates a conditional into a
sum with factors 0 and 1, in which an infinity in the branch not taken would become NaN.

Rounding is relative to the largest eigenvalue: where C has eigenvalues c1 >> c2 near c3 the small ones lose a
factor (c1 / c2)^2. Measured at a uniaxial stretch of 6 (c1 / c2 = 216), exponent -4: 3e-11 in the first
derivative.

References
----------
Habera and Zilian (2021), Symbolic spectral decomposition of 3x3 matrices, arXiv:2111.02117.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import ufl

from forms.law import Scalar

# Half difference of a pair over its mean, below which the series is used. The second derivative of the closed
# form loses eps / PAIR^3 = 2e-12 (times the square of the ratio of the third eigenvalue to the pair, if that
# is large), that of the series, cut after eight terms, 2e-9 at the exponent 25 of the stretches and 1e-12 at
# 10.
PAIR = 5e-2
# Largest deviatoric eigenvalue of C over its mean, below which all three count as near. Both sides lose less
# than 1e-8 in the second derivative there, at the same exponent.
SPHERE = 1e-3

# Interval of z = sqrt((1 + r)/2) for 0 <= r <= 1.
_CENTRE, _HALF_WIDTH = (1 + np.sqrt(0.5)) / 2, (1 - np.sqrt(0.5)) / 2


def power_trace(m: Scalar, J2: Scalar, J3: Scalar, beta: Scalar) -> Scalar:
    """Return tr(C^beta) of a symmetric positive definite 3x3 tensor.

    Parameters
    ----------
    m : UFL scalar
        tr C / 3.
    J2, J3 : UFL scalar
        Invariants of the deviator S = C - m 1: tr(S^2) / 2 and det S.
    beta : UFL scalar
        Exponent; half the exponent of the stretches.
    """
    near = ufl.lt(4 / 3 * J2, SPHERE**2 * m * m)
    x, y = J2 / (m * m), J3 / (m * m * m)
    # Power sums of the deviator: p_2 = 2 J2, p_3 = 3 J3, p_n = J2 p_(n-2) + J3 p_(n-3).
    b = _binomials(beta, 5)
    sphere = _power(m, beta) * (3 + b[2] * 2 * x + b[3] * 3 * y + b[4] * 2 * x * x + b[5] * 5 * x * y)

    J2, J3 = ufl.conditional(near, m * m / 16, J2), ufl.conditional(near, 0.0, J3)
    q = ufl.sqrt(J2 / 3)
    sign = ufl.conditional(ufl.lt(J3, 0.0), -1.0, 1.0)
    t = _cosine_of_third(sign * J3 / (2 * q * q * q))
    s = 2 * sign * q * t
    apart = _power(m + s, beta) + pair_power_trace(m - s / 2, J2 - 3 / 4 * s * s, beta)
    return ufl.conditional(near, sphere, apart)


def pair_power_trace(a: Scalar, d2: Scalar, beta: Scalar) -> Scalar:
    """Return (a + d)^beta + (a - d)^beta, a > d >= 0.

    Parameters
    ----------
    a : UFL scalar
        Mean of the pair.
    d2 : UFL scalar
        Square of its half difference.
    beta : UFL scalar
        Exponent.
    """
    y = d2 / (a * a)
    near = ufl.lt(y, PAIR**2)
    b = _binomials(beta, 14)
    series: Scalar = b[14]
    for coefficient in b[12::-2]:
        series = series * y + coefficient
    w = ufl.sqrt(ufl.conditional(near, 1 / 16, y))
    apart = _power(1 + w, beta) + _power(1 - w, beta)
    return _power(a, beta) * ufl.conditional(near, 2 * series, apart)


def _cosine_of_third(r: Scalar) -> Scalar:
    """Return cos(arccos(r) / 3), 0 <= r <= 1 (and a little beyond, by rounding)."""
    x = (ufl.sqrt((1 + r) / 2) - _CENTRE) / _HALF_WIDTH
    coefficients = _coefficients()
    total = coefficients[-1] * x + coefficients[-2]
    for coefficient in coefficients[-3::-1]:
        total = total * x + coefficient
    return total


@cache
def _coefficients() -> tuple[float, ...]:
    """Return cos(arccos(r) / 3) for 0 <= r <= 1 as a polynomial in z = sqrt((1 + r)/2), scaled to -1 ... 1.

    The arc cosine has no derivative at r = 1, the composition has. In r itself the singularity at r = -1 would require
    degree 21; in z (half the angle) 12 is enough.
    """
    interpolated = np.polynomial.Chebyshev.interpolate(
        lambda z: np.cos(2 / 3 * np.arccos(np.minimum(z, 1.0))), 12, domain=[np.sqrt(0.5), 1.0]
    )
    return tuple(float(c) for c in np.polynomial.chebyshev.cheb2poly(interpolated.coef))


def _binomials(beta: Scalar, order: int) -> list[Scalar]:
    """Return the binomial coefficients (beta over n), n = 0 ... order."""
    b: list[Scalar] = [1.0]
    for n in range(order):
        b.append(b[n] * (beta - n) / (n + 1))
    return b


def _power(x: Scalar, beta: Scalar) -> Scalar:
    """Return x^beta, x > 0; as an exponential its derivatives reuse the one logarithm."""
    return ufl.exp(beta * ufl.ln(x))
