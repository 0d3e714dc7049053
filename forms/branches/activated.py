"""A clock that overstress drives: a Maxwell branch on it relaxes the faster, the more its spring is stretched.

The time of relaxation is tau (f / STRAIN)^-exponent, f the amount of shear of the branch's spring. Chains and filler
slip by activated jumps, which stress helps: rubber relaxes with a power of the time over decades, and its stress
depends on a small power of the rate, 1 / (1 + exponent). An exponent of zero is a Maxwell branch, a large one friction.

While the strain stands still f' = -f (f / STRAIN)^exponent / tau, so that after a time t

    ln(f / f_begin) = -x,   x = ln(1 + exponent (t / tau) (f_begin / STRAIN)^exponent) / exponent,

and tau x passes on the clock: exact in a hold at small strain, however long. In motion a step is divided into `PARTS`.
In each of them the spring, a e + b d with its strain e at the beginning of the step and the change d of the strain, is
taken as it would be in the middle of the part, had it not relaxed there; it then relaxes by x. The step is of second
order, and stable at any length. With the steps of a fit (12 in a leg to a shear of one) the stress of the branch errs
by 0.5 to 2.5 % of its largest (rms) where it flows at a shear of 0.3 to 0.1 in the spring, without parts by 5 to 26 %
(in one dimension, exponent 3).

As that of the Payne effect the clock depends on the strain at the end of the step, and the stress of the branch is the
derivative of its incremental energy at a fixed advance: dissipation is never negative, and the tangent has a skew part.

References
----------
Bergstroem and Boyce (1998), Constitutive modeling of the large strain time-dependent behavior of elastomers, J. Mech.
Phys. Solids 46:931-954, doi:10.1016/S0022-5096(97)00075-6 (power of the stress, without their power of the creep).
"""

from __future__ import annotations

from dataclasses import replace

import ufl

from forms.branch import Branch, Contribution, Internal, Step
from forms.branches import maxwell
from forms.law import Scalar
from forms.symmetric import distance

#: Shear of the spring at which tau is the relaxation time. Judgement: overstress in bushings is of this order, so that
#: tau and exponent can be identified apart.
STRAIN = 0.2
#: Parts of a step in motion. The errors above are 0.7 and 3.7 % with four, 0.5 and 2.1 % with eight.
PARTS = 6
# Added to the shear, because its logarithm is taken: far below any strain that is measured. Judgement.
LEAST = 1e-6
# Below this the share of a change of strain that remains is computed by its series, which is exact to rounding there.
SERIES_BELOW = 1e-3


def contribution(step: Step, *, tau: Scalar, exponent: Scalar) -> Contribution:
    """Return the time that passes on the clock in a step, s, in the place of an energy.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    tau : Scalar
        Relaxation time at a shear of `STRAIN` in the spring, s.
    exponent : Scalar
        Power of the shear in the rate of relaxation, more than zero.
    """
    return Contribution(_advance(step, tau, exponent), step.strain.variables, ufl.as_ufl(0.0))


def update(step: Step, *, tau: Scalar, exponent: Scalar) -> Internal:
    """Return what passed on the clock in the step, and the strains of dashpot and branch at its end.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    tau, exponent : Scalar
        As in `contribution`.
    """
    passed = _advance(step, tau, exponent)
    return {"passed": passed, **maxwell.update(replace(step, duration=passed), g=1.0, tau=tau)}


def _advance(step: Step, tau: Scalar, exponent: Scalar) -> Scalar:
    # Squares of e, of d and of e + d, amounts of shear.
    Ci, begin, end = step.internal["Ci"], step.internal["C"], step.isochoric
    ee, dd, whole = (distance(A, B) ** 2 for A, B in ((Ci, begin), (begin, end), (Ci, end)))
    ed = (whole - ee - dd) / 2
    rate = exponent * step.duration / (PARTS * tau)
    a, b, passed = ufl.as_ufl(1.0), ufl.as_ufl(0.0), ufl.as_ufl(0.0)
    for _ in range(PARTS):
        middle = b + 0.5 / PARTS
        square = a * a * ee + 2 * a * middle * ed + middle * middle * dd
        shear = ufl.sqrt(ufl.max_value(square, 0) + LEAST**2)
        x = ufl.ln(1 + rate * ufl.exp(exponent * ufl.ln(shear / STRAIN))) / exponent
        decay = ufl.exp(-x)
        remaining = ufl.conditional(
            ufl.lt(x, SERIES_BELOW), 1 - x * (1 / 2 - x * (1 / 6 - x / 24)), (1 - decay) / x
        )
        a, b, passed = decay * a, decay * b + remaining / PARTS, passed + x
    return tau * passed


BRANCH = Branch(
    name="activated",
    summary="clock of overstress, for the branch after it",
    parameters=("tau", "exponent"),
    typical={"tau": 10.0, "exponent": 3.0},
    internal={"passed": "scalar", "Ci": "tensor", "C": "tensor"},
    contribution=contribution,
    update=update,
    timed=True,
    source="Bergstroem and Boyce (1998), doi:10.1016/S0022-5096(97)00075-6",
    clock="shown",
)
