"""A spectrum of Maxwell branches whose clock advances with time and strain path: the Payne effect.

While filled rubber moves, it relaxes faster than at rest, the more so the larger the motion has been. In a step

    z = dt + (offset + a)^exponent (path p + pace dt)

passes on the clock, with p the path of local shear strain in the step and a half of the range of strain so far. At rest
branches on it are viscous; without a pace their loops do not depend on the rate in fast cycles, and their stiffness
falls with amplitude. All branches follow one clock, which is a `Branch` of its own and comes before them.

The distance between two states of strain, for p and for the range, is `forms.symmetric.distance`. The range so far is
the diameter of a surface in strain space with centre Xi and radius a: a strain that leaves it by x enlarges the radius
by x / 2, and moves the centre towards it by as much. With a rate of fading it forgets: the radius decays, and the
centre moves to the present strain.

The stress of a branch on the clock is the derivative of its incremental energy at a fixed z, so that dissipation is
never negative; but z depends on the strain at the end of the step, so that the tangent has a part V_az z_b, which is
symmetric only where overstress and path are parallel. A rate that depends on the overstress or on the dissipation at
the end of the step would have a potential and a symmetric tangent, but on measured strain sweeps of filled rubber it
leaves 18 to 25 % of the storage modulus, this one 1 % (`benchmarks/payne.md`).

References
----------
Lion and Kardelky (2004), The Payne effect in finite viscoelasticity: constitutive modelling based on fractional
derivatives and intrinsic time scales, Int. J. Plast. 20:1313-1345, doi:10.1016/j.ijplas.2003.07.001 (intrinsic time).
Chaboche, Dang Van and Cordier (1979), Modelization of the strain memory effect on the cyclic hardening of 316 stainless
steel, SMiRT-5, Berlin, paper L11/3 (the surface in strain space).
"""

from __future__ import annotations

import numpy as np
import ufl
from numpy.typing import NDArray

from forms.branch import Branch, Contribution, Internal, Step
from forms.law import Scalar
from forms.symmetric import ROUNDED, Symmetric, distance, interpolate

Array = NDArray[np.float64]

# Number of branches, which is part of the law. Against 96, eight give the first harmonic of a sine within 0.5 % of the
# spectrum's modulus over 3 decades, 1.4 % over 5, and twelve within 0.6 % over 5 (0.01 to 100 Hz, 0.01 to 20 % strain).
BRANCHES = 8


def spectrum(g: Scalar, tau: Scalar, decades: Scalar, slope: Scalar) -> tuple[Array, Array]:
    """Return moduli (over the law's) and relaxation times at rest (s) of the branches, shape (BRANCHES,) each.

    The modulus per decade is g time^slope, time in s, between tau and tau 10^-decades: branches that are faster than a
    recording change no constant. Where g is the sum of all, it correlates with the slope by -0.99 in loops and holds.

    Parameters
    ----------
    g : float or complex
        Modulus per decade at a time of 1 s, over the law's initial shear modulus, a ratio.
    tau : float or complex
        Longest time, s.
    decades : float or complex
        Width of the spectrum in powers of ten.
    slope : float or complex
        Power of the time.
    """
    # The middles of equal parts: the error falls with the square of their number.
    times = tau * 10.0 ** (-decades * (np.arange(BRANCHES) + 0.5) / BRANCHES)
    return g * decades / BRANCHES * times**slope, times


def contribution(
    step: Step, *, path: Scalar, offset: Scalar, exponent: Scalar, fading: Scalar, pace: Scalar
) -> Contribution:
    """Return the time that passes on the clock in a step, s, in the place of an energy.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    path : Scalar
        Time per shear strain at an amplitude of 1, s.
    offset : Scalar
        Shear strain that is added to the amplitude: well below it, all amplitudes thin alike.
    exponent : Scalar
        Power of the amplitude.
    fading : Scalar
        Rate at which the range so far is forgotten, 1/s.
    pace : Scalar
        Time on the clock per time at an amplitude of 1, a ratio.
    """
    passed, *_ = _clock_advance(step, path, offset, exponent, fading, pace)
    return Contribution(passed, step.strain.variables, ufl.as_ufl(0.0))


def update(
    step: Step, *, path: Scalar, offset: Scalar, exponent: Scalar, fading: Scalar, pace: Scalar
) -> Internal:
    """Return what passed on the clock in the step, and strain, centre and radius at its end.

    Parameters
    ----------
    step : Step
        State at the beginning and strain at the end of the step.
    path, offset, exponent, fading, pace : Scalar
        As in `contribution`.
    """
    passed, beyond, apart = _clock_advance(step, path, offset, exponent, fading, pace)
    Xi, radius = _faded_range(step, fading)
    centre = interpolate(Xi, step.isochoric, beyond / (2 * (apart + ROUNDED)))
    return {"passed": passed, "C": step.isochoric, "Xi": centre, "radius": radius + beyond / 2}


def _clock_advance(
    step: Step, path: Scalar, offset: Scalar, exponent: Scalar, fading: Scalar, pace: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """Return the clock's advance, how far the strain leaves its previous range, and its distance from the centre."""
    Xi, radius = _faded_range(step, fading)
    way, apart = (distance(tensor, step.isochoric) for tensor in (step.internal["C"], Xi))
    beyond = ufl.max_value(apart - radius, 0)
    # The mean of the radii at beginning and end.
    thinning = ufl.exp(exponent * ufl.ln(offset + radius + beyond / 4))
    return step.duration + thinning * (pace * step.duration + path * way), beyond, apart


def _faded_range(step: Step, fading: Scalar) -> tuple[Symmetric, Scalar]:
    """Return centre and radius of the range of strain, after it has faded during the step."""
    decay = ufl.exp(-fading * step.duration)
    return interpolate(step.internal["Xi"], step.internal["C"], 1 - decay), decay * step.internal["radius"]


BRANCH = Branch(
    name="payne",
    summary="clock of time and path, for the branches after it",
    parameters=("path", "offset", "exponent", "fading", "pace"),
    typical={"path": 1e3, "offset": 1e-3, "exponent": 1.0, "fading": 1e-3, "pace": 1.0},
    internal={"passed": "scalar", "C": "tensor", "Xi": "tensor", "radius": "scalar"},
    contribution=contribution,
    update=update,
    timed=True,
    source="Lion and Kardelky (2004), doi:10.1016/j.ijplas.2003.07.001",
    clock="shown",
)
