"""A clock that overstress drives: a Maxwell branch on it relaxes the faster, the more its spring is stretched.

The time of relaxation is tau (f / STRAIN)^-exponent, f the amount of shear of the branch's spring. Chains and filler
slip by activated jumps, which stress helps: rubber relaxes with a power of the time over decades, and its stress
depends on a small power of the rate, 1 / (1 + exponent). An exponent of zero is a Maxwell branch, a large one friction.

While the spring is not stretched further f' = -f (f / STRAIN)^exponent / tau, so that after a time t

    ln(f / f_begin) = -x,   x = ln(1 + exponent (t / tau) (f_begin / STRAIN)^exponent) / exponent,

and tau x passes on the clock. In a step, f_begin is the shear that the spring would have in its middle, had it not
relaxed. That is exact in a hold, of second order in motion, and stable at any step: a fast flow ends the step on the
same stretch from wherever it began.

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
from forms.symmetric import distance, interpolate

#: Shear of the spring at which tau is the relaxation time: that of overstress in bushings, so that tau and exponent
#: correlate little.
STRAIN = 0.2
# Shear below which nothing slips: its logarithm is taken.
LEAST = 1e-6


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
    middle = interpolate(step.internal["C"], step.isochoric, 0.5)
    shear = distance(step.internal["Ci"], middle) + LEAST
    faster = ufl.exp(exponent * ufl.ln(shear / STRAIN))
    return tau / exponent * ufl.ln(1 + exponent * step.duration / tau * faster)


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
