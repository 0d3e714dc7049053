"""A spring and a dashpot in series at finite strain (Maxwell branch): stress that relaxes in time."""

from __future__ import annotations

from dataclasses import replace

import ufl

from forms.branch import Branch, Contribution, Internal, Step
from forms.law import Scalar
from forms.symmetric import Symmetric, cube_root

# Below this the closed forms of the weights lose digits, while their series is exact to rounding.
SERIES_BELOW = 0.02
# A step without duration: short enough to be elastic, long enough to divide by.
SHORTEST = 1e-9


def contribution(step: Step, *, g: Scalar, tau: Scalar) -> Contribution:
    """Return the incremental energy of a neo-Hookean spring of modulus g mu behind a dashpot of time tau.

    The stored energy is g mu / 2 (tr(C' Ci^-1) - 3), C' the isochoric right Cauchy-Green tensor and Ci the unimodular
    one of the dashpot, which follows Ci' = (C' - tr(C' Ci^-1) Ci / 3) / tau. That is a linear equation for a multiple
    of Ci, M' = s C' / tau with s = (det M)^(1/3), so that, with C' linear over the step,

        M = N + a C'_end,   N = exp(-y) Ci + b C'_begin,   Ci_end = M / (det M)^(1/3),

    and a, b integrals of s = exp(k t / tau), k = tr(C' Ci^-1) / 3 at the beginning, over its value exp(y) at the end.
    The stress at the end, g mu / 2 Ci_end^-1, is the derivative of 3 g mu / (2 a) (det M)^(1/3): the step has a
    potential. The step is of second order, exact for a hold at small strain, and its dissipation is never negative.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    g : Scalar
        Modulus of the spring over the initial shear modulus, a ratio.
    tau : Scalar
        Relaxation time, s.

    References
    ----------
    Simo and Hughes (1998), Computational Inelasticity, chapter 10, doi:10.1007/b98904. Lion (1997), A physically based
    method to represent the thermo-mechanical behaviour of elastomers, Acta Mech. 123:1-25, doi:10.1007/BF01178397 (the
    model). Shutov, Landgraf and Ihlemann (2013), An explicit solution for implicit time stepping in multiplicative
    finite strain viscoelasticity, Comput. Methods Appl. Mech. Eng. 265:213-225, doi:10.1016/j.cma.2013.07.004 (its
    first-order step, b = 0 and a = t / tau here). The potential and the second-order weights are derived here.
    """
    strain = step.strain
    a, N = _increment(step, tau)
    s = ufl.exp(-2 / 3 * ufl.ln(strain.J))
    first = ufl.variable(N.adjugate().dot(step.metric))
    second = ufl.variable(N.dot(step.metric.adjugate()))
    cube = N.det() + a * (s * first + a * (s * s * second + a))
    stiffness = g * step.shear_modulus
    Ci = update(step, g=g, tau=tau)["Ci"]
    stored = stiffness / 2 * (Ci.adjugate().dot(step.isochoric) - 3)
    return Contribution(
        3 * stiffness / (2 * a) * cube_root(cube), (*strain.volume_measures, first, second), stored
    )


def update(step: Step, *, g: Scalar, tau: Scalar) -> Internal:
    """Return the dashpot's tensor and the isochoric right Cauchy-Green tensor at the end of the step.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    g : Scalar
        Modulus of the spring over the initial shear modulus, a ratio.
    tau : Scalar
        Relaxation time, s.
    """
    a, N = _increment(step, tau)
    C = step.isochoric
    M = N + a * C
    return {"Ci": (1 / cube_root(M.det())) * M, "C": C}


def _increment(step: Step, tau: Scalar) -> tuple[Scalar, Symmetric]:
    """Return a, the weight of C' at the end of the step, and N (see `contribution`)."""
    Ci, C = step.internal["Ci"], step.internal["C"]
    k = ufl.max_value(Ci.adjugate().dot(C) / 3, 1)
    y = ufl.max_value(k * step.duration / tau, SHORTEST)
    decay = ufl.exp(-y)
    small = ufl.lt(y, SERIES_BELOW)
    end = ufl.conditional(
        small,
        y * (1 / 2 - y * (1 / 6 - y * (1 / 24 - y * (1 / 120 - y * (1 / 720 - y / 5040))))),
        (y - 1 + decay) / y,
    )
    start_weight = ufl.conditional(
        small,
        y * (1 / 2 - y * (1 / 3 - y * (1 / 8 - y * (1 / 30 - y * (1 / 144 - y / 840))))),
        (1 - (1 + y) * decay) / y,
    )
    return end / k, decay * Ci + (start_weight / k) * C


BRANCH = Branch(
    name="maxwell",
    summary="spring of g times the law's initial shear modulus that relaxes with time constant tau",
    parameters=("g", "tau"),
    typical={"g": 0.2, "tau": 4.0},
    internal={"Ci": "tensor", "C": "tensor"},
    contribution=contribution,
    update=update,
    timed=True,
    source="Lion (1997), doi:10.1007/BF01178397; Shutov et al. (2013), doi:10.1016/j.cma.2013.07.004",
)

#: The same on the clock before it.
PACED = replace(BRANCH, clock="followed")
