"""Softening of rubber that has been stretched before (Mullins effect), after Ogden and Roxburgh."""

from __future__ import annotations

import math

import ufl

from forms.branch import Branch, Contribution, Internal, Step
from forms.law import Scalar

# In a hold W equals W_max except for rounding, which differs between residual, tangent and derivatives. They agree if
# all of them use the virgin curve there; softening therefore begins lower by this share of W_max, which changes the
# stress by as little. For the same reason W becomes the new W_max only beyond this share: kernels that decided a tie
# differently would count the derivatives of both, or of neither (measured with DOLFINx 0.11: dW_max twice as large
# after a hold).
TIE = 1e-8


def contribution(step: Step, *, inverse_r: Scalar, m: Scalar, beta: Scalar) -> Contribution:
    """Return the energy for the stress eta dW/dF with eta = 1 - (1/r) erf((W_max - W) / (m + beta W_max)).

    W is the law's isochoric energy, W_max the largest that the point has seen. Beyond it eta = 1: the virgin curve
    goes on. With x = (W_max - W) / s and s = m + beta W_max the integral of -(1/r) erf(x) over W is
    (1/r) s (x erf x + (exp(-x^2) - 1) / sqrt(pi)). Its value at W = 0 is the energy dissipated, the area of the loop.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    inverse_r : Scalar
        Largest share by which the stress softens, 1/r.
    m : Scalar
        Energy, in units of the shear modulus, at which softening sets in.
    beta : Scalar
        Share of the largest energy that widens the softening, dimensionless.

    References
    ----------
    Ogden and Roxburgh (1999), A pseudo-elastic model for the Mullins effect in filled rubber, Proc. R. Soc. Lond. A
    455:2861-2877, doi:10.1098/rspa.1999.0431. The scale m + beta W_max: Mars (2004), Evaluation of a pseudo-elastic
    model for the Mullins effect, Tire Sci. Technol. 32:120-145, doi:10.2346/1.2186778.
    """
    peak = step.internal["peak"]
    scale = m + beta * peak
    softened = _softening((1 - TIE) * peak - step.law_energy, scale, inverse_r)
    end = update(step, inverse_r=inverse_r, m=m, beta=beta)["peak"]
    dissipated = _softening((1 - TIE) * end, m + beta * end, inverse_r)
    return Contribution(softened, None, softened - dissipated)


def update(step: Step, *, inverse_r: Scalar, m: Scalar, beta: Scalar) -> Internal:
    """Return the largest energy so far.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    inverse_r : Scalar
        Largest share by which the stress softens, 1/r.
    m : Scalar
        Energy, in units of the shear modulus, at which softening sets in.
    beta : Scalar
        Share of the largest energy that widens the softening, dimensionless.
    """
    peak = step.internal["peak"]
    return {"peak": ufl.conditional(ufl.gt(step.law_energy, (1 + TIE) * peak), step.law_energy, peak)}


def _softening(below: Scalar, scale: Scalar, inverse_r: Scalar) -> Scalar:
    x = ufl.max_value(below, 0) / scale
    return inverse_r * scale * (x * ufl.erf(x) + (ufl.exp(-x * x) - 1) / math.sqrt(math.pi))


BRANCH = Branch(
    name="ogden_roxburgh",
    summary="below the largest energy so far the stress is multiplied by 1 - (1/r) erf((W_max - W) / (m + beta W_max))",
    parameters=("inverse_r", "m", "beta"),
    typical={"inverse_r": 0.35, "m": 0.05, "beta": 0.15},
    internal={"peak": "scalar"},
    contribution=contribution,
    update=update,
    timed=False,
    source="Ogden and Roxburgh (1999), doi:10.1098/rspa.1999.0431",
)
