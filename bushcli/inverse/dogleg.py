"""Unbounded dogleg trust region with finite differences, as in the literature: a baseline for comparison.

It follows the published flowchart. Gradient and Gauss-Newton Hessian come from forward differences with one step for
all parameters. The Newton step is taken if the Hessian is positive definite and the step lies within the trust region,
else the dogleg through the Cauchy point (without a positive definite Hessian, a step down the gradient). The ratio of
actual to predicted reduction accepts or rejects the step; a rejection shrinks the radius, and three rejections in a row
end the search. There are no bounds, no scaling and no exact derivatives: a comparison shows what those are worth.

References
----------
Powell (1970), A hybrid method for nonlinear equations, in: Rabinowitz (ed.), Numerical Methods for Nonlinear Algebraic
Equations, Gordon and Breach, 87-114.
Nocedal and Wright (2006), Numerical Optimization, Springer, chapter 4, doi:10.1007/978-0-387-40065-5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.local import Minimum
from bushcli.inverse.problem import LeastSquaresProblem

Array = NDArray[np.float64]

# Step of the finite differences, equal for all parameters, in their own unit (MPa), as in the literature.
STEP = 1e-3
# First and largest radius, in the unit of the parameters: judgement.
RADIUS, LARGEST_RADIUS = 0.1, 1.0
# Gain over the predicted one from which a step is accepted, and from which the radius grows: usual values (Nocedal and
# Wright 2006, doi:10.1007/978-0-387-40065-5, algorithm 4.1).
ACCEPTED, GOOD = 0.1, 0.75
# Rejected trials in a row that end the search, and relative gradient that ends it.
REJECTIONS, GRADIENT = 3, 1e-8


def minimise_by_dogleg(problem: LeastSquaresProblem, start: Array, max_iterations: int = 50) -> Minimum:
    """Minimise half the squared misfit without bounds.

    A parameter set that cannot be solved ends the search if a derivative needs it, and counts as a rejection if it is
    a trial.
    """
    x, radius, rejections = start.copy(), RADIUS, 0
    value = problem.residual(x)
    message = "the start cannot be solved"
    iteration, converged = 0, False
    while np.isfinite(value).all():
        if iteration >= max_iterations:
            message = f"stopped after {iteration} iterations"
            break
        iteration += 1
        slope = np.column_stack(
            [(problem.residual(x + STEP * unit) - value) / STEP for unit in np.eye(len(x))]
        )
        if not np.isfinite(slope).all():
            message = "the model could not be solved at a point of a finite difference"
            break
        gradient, hessian = slope.T @ value, slope.T @ slope
        if np.linalg.norm(gradient) < GRADIENT:
            message, converged = "the gradient vanishes", True
            break
        step = _dogleg(gradient, hessian, radius)
        trial = problem.residual(x + step)
        predicted = -(gradient @ step + 0.5 * step @ hessian @ step)
        actual = 0.5 * (value @ value - trial @ trial) if np.isfinite(trial).all() else -np.inf
        ratio = actual / predicted
        if ratio > ACCEPTED:
            rejections = 0
            if ratio > GOOD and np.isclose(np.linalg.norm(step), radius):
                radius = min(2.0 * radius, LARGEST_RADIUS)
            small = actual <= 1e-10 * 0.5 * (value @ value)
            x, value = x + step, trial
            if small:
                message, converged = "the misfit no longer falls", True
                break
            continue
        rejections += 1
        radius *= 0.25
        if rejections >= REJECTIONS:
            message = f"{REJECTIONS} rejected steps in a row"
            break
    return Minimum(start, x, problem.cost(x), iteration, converged, message)


def _dogleg(gradient: Array, hessian: Array, radius: float) -> Array:
    """Return the step within the radius on the path gradient - Cauchy point - Newton point."""
    try:
        np.linalg.cholesky(hessian)
        newton = -np.linalg.solve(hessian, gradient)
    except np.linalg.LinAlgError:
        return np.asarray(-radius * gradient / np.linalg.norm(gradient))
    if np.linalg.norm(newton) <= radius:
        return np.asarray(newton)
    cauchy = -(gradient @ gradient) / (gradient @ hessian @ gradient) * gradient
    length = np.linalg.norm(cauchy)
    if length >= radius:
        return np.asarray(radius / length * cauchy)
    leg = newton - cauchy
    a, b, c = leg @ leg, 2.0 * cauchy @ leg, cauchy @ cauchy - radius**2
    share = (-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    return np.asarray(cauchy + share * leg)
