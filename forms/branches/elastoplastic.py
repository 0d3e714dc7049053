"""A spring behind a slider at finite strain: friction between filler particles, the same at every rate."""

from __future__ import annotations

import ufl

from forms.branch import Branch, Contribution, Internal, Step
from forms.law import Scalar
from forms.symmetric import Symmetric, cube_root

# The knee at the slip strain is rounded over this share of it on both sides, to keep the tangent continuous.
ROUNDING = 0.01
# Elastic strain (squared) below which its root is not taken: the root's slope is infinite at zero.
TINY = 1e-12


def contribution(step: Step, *, g: Scalar, slip: Scalar) -> Contribution:
    """Return the incremental energy of a neo-Hookean spring of modulus g mu that slips at the shear strain `slip`.

    The stored energy is g mu / 2 (tr(C' Ci^-1) - 3) with the slider's unimodular tensor Ci, which yields when the
    deviator of C' Ci^-1 is as large as slip (half the trace of its square: slip^2; in simple shear at a shear of
    `slip`, in tension at a true stress of 3^(1/2) g mu slip) and then follows the flow of the Maxwell branch with a
    multiplier a in place of time: Ci_end = (Ci + a C') / D, D = (det(Ci + a C'))^(1/3). The incremental energy

        3 g mu / 2 (D - 1) / a + g mu / 2 slip^2 a

    is stationary at the a that meets the yield condition. At small a, or small strain, that is a = f / slip - 1, f^2
    half the trace of the square, zero below (a parabola rounds the knee). Taking this closed form, in the energy
    itself, keeps the step explicit and its tangent symmetric; it is first order in the step. The rounding belongs to
    the step, not to the material: with steps much shorter than `ROUNDING` of slip, the knee is lower by that share.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    g : Scalar
        Modulus of the spring over the initial shear modulus, a ratio.
    slip : Scalar
        Shear strain at which the slider yields, dimensionless.

    References
    ----------
    Austrell, Olsson and Jonsson (2001), A method to analyse the non-linear dynamic behaviour of carbon-black-filled
    rubber components using standard FE codes, in Constitutive Models for Rubber II, Balkema (overlay of elastoplastic
    branches). Ortiz and Stainier (1999), doi:10.1016/S0045-7825(98)00219-9 (incremental energy). The closed form is
    derived here.
    """
    strain = step.strain
    s = ufl.exp(-2 / 3 * ufl.ln(strain.J))
    inverse = step.internal["Ci"].adjugate()
    trace = ufl.variable(inverse.dot(step.metric))
    size = ufl.variable(_deviator(step.metric, inverse))
    # All in quantities of the order of the spring's strain squared: added to 1, slip^2 would be lost to rounding.
    first, square = s * trace - 3, s * s * size
    second = 2 * first + first * first / 3 - square  # tr(Ci C'^-1) - 3, because det C' = det Ci = 1
    a = _multiplier(square, slip)
    # D^3 = (1 + a)^3 + a first + a^2 second; (D - 1) / a has no division by a.
    part = first + a * second
    c = cube_root(1 + a * part / (1 + a) ** 3)
    stiffness = g * step.shear_modulus
    incremental = stiffness / 2 * (3 * part / ((1 + a) ** 2 * (c * c + c + 1)) + slip * slip * a)
    end = update(step, g=g, slip=slip)["Ci"]
    stored = stiffness / 2 * (end.adjugate().dot(step.isochoric) - 3)
    return Contribution(incremental, (*strain.volume_measures, trace, size), stored)


def update(step: Step, *, g: Scalar, slip: Scalar) -> Internal:
    """Return the slider's tensor at the end of the step.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    g : Scalar
        Modulus of the spring over the initial shear modulus, a ratio.
    slip : Scalar
        Shear strain at which the slider yields, dimensionless.
    """
    Ci, C = step.internal["Ci"], step.isochoric
    M = Ci + _multiplier(_deviator(C, Ci.adjugate()), slip) * C
    return {"Ci": (1 / cube_root(M.det())) * M}


def _deviator(A: Symmetric, B: Symmetric) -> Scalar:
    """Half the trace of the squared deviator of A B."""
    a, b = A.rows(), B.rows()
    P = [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    pairs = ((0, 1), (1, 2), (2, 0))
    return sum((P[i][i] - P[j][j]) ** 2 / 6 + P[i][j] * P[j][i] for i, j in pairs)


def _multiplier(square: Scalar, slip: Scalar) -> Scalar:
    x = ufl.sqrt(ufl.max_value(square, TINY)) / slip - 1
    rounded = (x + ROUNDING) ** 2 / (4 * ROUNDING)
    return ufl.conditional(ufl.gt(x, ROUNDING), x, ufl.conditional(ufl.gt(x, -ROUNDING), rounded, 0 * x))


BRANCH = Branch(
    name="elastoplastic",
    summary="spring of g times the law's initial shear modulus that slips at a strain of its own, at any rate",
    parameters=("g", "slip"),
    typical={"g": 0.2, "slip": 0.08},
    internal={"Ci": "tensor"},
    contribution=contribution,
    update=update,
    timed=False,
    source="Austrell, Olsson and Jonsson (2001), Constitutive Models for Rubber II",
)
