"""Identify a law's parameters from measured curves.

A coupon is a one-element body under its own mode, so that its curve and the curve's derivatives with respect to the
parameters come from the same march as a bushing's. The least-squares problem is bounded; a trial that cannot be
solved makes the trust region shrink and is counted.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear

from bushcli.casefile import Case, Material
from bushcli.condition import Condition
from bushcli.curve import Curve
from bushcli.errors import InputError, Problem, nearest
from bushcli.recording import Recording, read_coupon
from cases.march import NotConverged
from cases.mode import modes
from cases.model import Model
from cases.simulate import Rubber, prepare, sweep
from cases.stability import coupon_limits
from forms.law import law, laws
from geometry.shape import shapes

Array = NDArray[np.float64]
Weighting = Literal["absolute", "relative"]

# More points than this on one coupon curve are reached by interpolation between as many even steps.
DENSE = 60
# A relative misfit divides by the stress, but by no less than this share of the largest: at the origin both vanish.
RELATIVE_FLOOR = 0.05
# Singular values of the column-scaled Jacobian below this share of the largest: a combination left undetermined.
UNDETERMINED = 1e-3
# Principal stretches that a bushing's rubber rarely leaves: instability within them is worth a word.
USUAL_STRETCHES = (0.5, 2.0)
# A bound counts as reached within this share of the distance between start value and bound.
AT_BOUND = 1e-6


@dataclass(frozen=True)
class Estimate:
    """An identified parameter: value and standard error, its bounds, and whether it lies on one."""

    value: float
    std: float
    lower: float
    upper: float
    at_bound: bool


@dataclass(frozen=True)
class FittedCurve:
    """A recorded curve and the identified law's answer at the same displacements."""

    name: str
    recording: Recording
    fitted: Curve
    rms_percent: float


@dataclass(frozen=True)
class Combination:
    """A direction in parameter space that the curves do not determine, in words and as weights by parameter."""

    weights: Mapping[str, float]
    singular_value: float
    text: str


@dataclass(frozen=True)
class Fit:
    """An identified law.

    Attributes
    ----------
    material : Material
        Law with the identified parameters.
    parameters
        Name -> estimate.
    correlation : shape (parameters, parameters)
    curves
        Recorded against fitted, one per coupon.
    stability
        Coupon mode -> stretches between which the law is stable (0 and inf: over the whole range scanned).
    weighting
        "absolute": every stress counts alike, relative to the coupon's largest; "relative": by its own size.
    forward_solves, sweeps, failed_solves, iterations : int
        Simulations of one coupon; evaluations of all; those that did not converge; optimiser's iterations.
    converged : bool
    singular_values
        Of the Jacobian with columns scaled by the parameters' values, largest first, relative to the largest.
    undetermined
        Combinations that the curves leave open.
    seconds : float
    conditions
        What is doubtful about the result.
    """

    material: Material
    parameters: Mapping[str, Estimate]
    correlation: Array
    curves: tuple[FittedCurve, ...]
    stability: Mapping[str, tuple[float, float]]
    weighting: Weighting
    forward_solves: int
    sweeps: int
    failed_solves: int
    iterations: int
    converged: bool
    singular_values: Array
    undetermined: tuple[Combination, ...]
    seconds: float
    conditions: tuple[Condition, ...]


Progress = Callable[[int, float, Mapping[str, float]], None]
"""Called after each evaluation with its number, the rms misfit (percent) and the parameters."""


class _Coupon:
    """One material test: its curve and the derivatives with respect to the parameters."""

    def __init__(self, recording: Recording, rubber: Rubber, weighting: Weighting) -> None:
        self.recording = recording
        # Small models: every rank of a parallel run solves the same.
        self.model: Model = prepare(shapes()["coupon"](), modes()[recording.mode], rubber, comm=MPI.COMM_SELF)
        strain = recording.displacement
        distinct = np.unique(strain)
        self.targets = distinct if len(distinct) <= DENSE else np.linspace(distinct[0], distinct[-1], DENSE)
        largest = float(np.abs(recording.force).max())
        if weighting == "absolute":
            self.scale = np.full(len(strain), largest)
        else:
            self.scale = np.maximum(np.abs(recording.force), RELATIVE_FLOOR * largest)
        # The coupon with more points must not rule over the others.
        self.scale = self.scale * np.sqrt(len(strain))

    def solve(self, parameters: Mapping[str, float]) -> tuple[Array, Array]:
        """Nominal stress at the recorded strains, shape (n,), and its derivatives, shape (n, parameters)."""
        from scipy.interpolate import CubicSpline

        self.model.set_parameters(parameters)
        history = sweep(self.model, self.targets, sensitivity=tuple(parameters))
        assert history.sensitivity is not None
        strain = self.recording.displacement
        stress = CubicSpline(history.displacement, history.force)(strain)
        return stress, np.asarray(CubicSpline(history.displacement, history.sensitivity)(strain))


class _Problem:
    """Misfit of all coupons and its Jacobian; remembers the last point, which the optimiser asks for twice."""

    def __init__(self, coupons: list[_Coupon], names: tuple[str, ...], progress: Progress | None) -> None:
        self.coupons, self.names, self.progress = coupons, names, progress
        self.sweeps = self.solves = self.failed = 0
        self.size = sum(len(c.recording.displacement) for c in coupons)
        self._at: Array | None = None
        self._value: tuple[Array, Array] = (np.empty(0), np.empty((0, 0)))

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        if self._at is None or not np.array_equal(self._at, x):
            self._at, self._value = x.copy(), self._evaluate(x)
        return self._value

    def _evaluate(self, x: Array) -> tuple[Array, Array]:
        self.sweeps += 1
        parameters = dict(zip(self.names, map(float, x), strict=True))
        values, slopes = [], []
        for coupon in self.coupons:
            self.solves += 1
            try:
                stress, slope = coupon.solve(parameters)
            except NotConverged:
                # Not a number on purpose: the trust region takes it as a step too far and shrinks.
                self.failed += 1
                return np.full(self.size, np.nan), np.full((self.size, len(x)), np.nan)
            values.append((stress - coupon.recording.force) / coupon.scale)
            slopes.append(slope / coupon.scale[:, None])
        value = np.concatenate(values)
        if self.progress is not None:
            self.progress(self.sweeps, 100 * float(np.sqrt(np.sum(value**2) / len(self.coupons))), parameters)
        return value, np.concatenate(slopes)


def fit_coupons(
    case: Case,
    model: str | None = None,
    *,
    weighting: Weighting = "relative",
    progress: Progress | None = None,
) -> Fit:
    """Identify a law on all coupon tests of a case together.

    Parameters
    ----------
    case
        Its coupons are read; its material gives the law, the bulk modulus and, where present, the start values.
    model
        Law to use instead of the case's.
    weighting
        "relative": the misfit in stress over the stress itself, which serves the moderate strains of a bushing;
        "absolute": over the coupon's largest stress.
    progress
        Called after each evaluation.

    Raises
    ------
    InputError
        The case has no coupons, one cannot be read, or the start cannot be solved.

    """
    begin = time.perf_counter()
    if not case.coupons:
        raise InputError(Problem(case.path.name, "there are no [[coupons]] to fit a law to"))
    material = case.material
    if model is not None and model != material.law:
        material = Material(model, material.bulk_modulus)
    if material.law not in laws():
        raise InputError(
            Problem(
                "--model", f'"{material.law}" is not a law', nearest(material.law, laws()), ", ".join(laws())
            )
        )
    chosen = law(material.law)
    names = material.parameter_names
    start = np.array([material.parameters.get(name, chosen.parameter(name).start) for name in names])
    lower = np.array([chosen.parameter(name).lower for name in names])
    upper = np.array([chosen.parameter(name).upper for name in names])
    rubber = Rubber(chosen, dict(zip(names, start, strict=True)), material.bulk_modulus)
    coupons = [_Coupon(read_coupon(source), rubber, weighting) for source in case.coupons]
    problem = _Problem(coupons, names, progress)
    start = _scaled(problem, start, lower, upper, [name in chosen.linear for name in names])
    if not np.isfinite(problem.evaluate(start)[0]).all():
        tried = ", ".join(f"{name} = {value:g}" for name, value in zip(names, start, strict=True))
        raise InputError(
            Problem(
                case.path.name,
                f"{chosen.name} cannot be solved on these coupons from {tried}",
                "",
                "other start values in [material.parameters]",
            )
        )
    result = least_squares(
        lambda x: problem.evaluate(x)[0],
        start,
        jac=lambda x: problem.evaluate(x)[1],
        bounds=(lower, upper),
        x_scale="jac",
        method="trf",
        ftol=1e-10,
        xtol=1e-10,
        gtol=1e-12,
        max_nfev=200,
    )
    value, slope = problem.evaluate(result.x)
    curves = tuple(_fitted(coupon, result.x, names) for coupon in coupons)
    covariance = _covariance(value, slope)
    spread = np.sqrt(np.diag(covariance))
    at_bound = [_at_bound(*row) for row in zip(result.x, lower, upper, strict=True)]
    parameters = {
        name: Estimate(float(result.x[i]), float(spread[i]), float(lower[i]), float(upper[i]), at_bound[i])
        for i, name in enumerate(names)
    }
    identified = Material(
        chosen.name, material.bulk_modulus, {n: e.value for n, e in parameters.items()}, material.terms
    )
    singular, undetermined = _directions(slope, result.x, names)
    limits = coupon_limits(chosen, dict(identified.parameters))
    fit = Fit(
        material=identified,
        parameters=parameters,
        correlation=covariance / np.outer(spread, spread),
        curves=curves,
        stability=limits,
        weighting=weighting,
        forward_solves=problem.solves,
        sweeps=problem.sweeps,
        failed_solves=problem.failed,
        iterations=int(result.njev),
        converged=bool(result.status > 0),
        singular_values=singular,
        undetermined=undetermined,
        seconds=time.perf_counter() - begin,
        conditions=(),
    )
    return _with_conditions(fit)


def _scaled(problem: _Problem, start: Array, lower: Array, upper: Array, linear: list[bool]) -> Array:
    """Start with the parameters in which the stress is linear at their best values for the others' start values.

    A coupon's stress at given stretch is exactly linear in them if incompressible: one solve takes out any error of
    scale. Where the start cannot be solved, the others are enlarged: locking laws lock later.
    """
    free = np.array(linear)
    for enlarged in (1.0, 3.0, 10.0, 30.0):
        trial = np.where(free, start, np.clip(start * enlarged, lower, upper))
        value, slope = problem.evaluate(trial)
        if np.isfinite(value).all():
            break
    else:
        return start
    if not free.any():
        return trial
    wanted = slope[:, free] @ trial[free] - value
    size = np.linalg.norm(slope[:, free], axis=0)
    best = lsq_linear(slope[:, free] / size, wanted, (lower[free] * size, upper[free] * size))
    scaled = trial.copy()
    scaled[free] = np.clip(best.x / size, lower[free], upper[free])
    return scaled if np.isfinite(problem.evaluate(scaled)[0]).all() else trial


def _fitted(coupon: _Coupon, x: Array, names: tuple[str, ...]) -> FittedCurve:
    stress, _ = coupon.solve(dict(zip(names, map(float, x), strict=True)))
    recording = coupon.recording
    rms = float(np.sqrt(np.mean((stress - recording.force) ** 2)) / np.ptp(recording.force))
    return FittedCurve(
        recording.name, recording, Curve(recording.mode, recording.displacement, stress), 100 * rms
    )


def _covariance(value: Array, slope: Array) -> Array:
    """Covariance of the estimates from the misfit itself; the pseudo-inverse leaves open what is undetermined."""
    freedom = max(len(value) - slope.shape[1], 1)
    return np.asarray(np.linalg.pinv(slope.T @ slope) * (value @ value) / freedom)


def _at_bound(value: float, lower: float, upper: float) -> bool:
    return bool(
        min(value - lower, upper - value)
        <= AT_BOUND * max(abs(value), abs(lower) if np.isfinite(lower) else 0)
    )


def _directions(slope: Array, x: Array, names: tuple[str, ...]) -> tuple[Array, tuple[Combination, ...]]:
    """Singular values of the Jacobian per relative change of each parameter, and the combinations left open."""
    scaled = slope * np.where(x == 0, 1.0, x)
    _, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    relative = singular / singular[0]
    combinations = []
    for size, row in zip(relative, rows, strict=True):
        if size >= UNDETERMINED:
            continue
        parts = {name: float(w) for name, w in zip(names, row, strict=True) if abs(w) > 0.1}
        joined = " and ".join(parts)
        text = (
            f"{joined} alone is not determined"
            if len(parts) == 1
            else f"{joined} are only determined together: they can change in the ratio "
            + " : ".join(f"{w:+.2f}" for w in parts.values())
            + " (relative to their values) with hardly any change of the curves"
        )
        combinations.append(Combination(parts, float(size), text))
    return relative, tuple(combinations)


def _with_conditions(fit: Fit) -> Fit:
    found = []
    chosen = law(fit.material.law)
    tested = {curve.recording.mode for curve in fit.curves}
    if chosen.basis != "I1" and len(tested - {"volumetric"}) == 1:
        found.append(
            Condition(
                "one_coupon_mode",
                f"{chosen.name} depends on more than I1, and only {', '.join(tested)} tests are given: what it "
                "predicts in other modes is not determined",
                "add a coupon test of another mode, or use a law in I1 alone (yeoh, arruda_boyce, gent, neo_hookean)",
            )
        )
    for name, estimate in fit.parameters.items():
        if estimate.at_bound:
            found.append(
                Condition(
                    "at_bound",
                    f"{name} = {estimate.value:g} lies on its bound ({estimate.lower:g} to {estimate.upper:g})",
                    "the law asks for a value that makes no sense: choose another law, or check the coupons' units",
                )
            )
    for mode, (low, high) in fit.stability.items():
        reached = [c.recording.displacement + 1 for c in fit.curves if c.recording.mode == mode]
        largest = max((float(r.max()) for r in reached), default=None)
        if largest is not None and high < largest:
            found.append(
                Condition(
                    "unstable_law",
                    f"the fitted law is unstable in {mode} deformation beyond stretch {high:.3g}, "
                    "inside the test's range",
                    "choose another law, or leave out the part of the test that it cannot follow",
                )
            )
        elif high < max(USUAL_STRETCHES[1], largest or 0.0) or low > USUAL_STRETCHES[0]:
            found.append(
                Condition(
                    "unstable_outside_data",
                    f"the fitted law is stable in {mode} deformation only between stretches {low:.3g} and {high:.3g}",
                    "do not use it beyond; `bushcli direct` checks the states that the bushing reaches",
                )
            )
    for combination in fit.undetermined:
        found.append(
            Condition(
                "undetermined",
                combination.text,
                "add a coupon test of another mode or of larger stretch, or use a law with fewer parameters",
            )
        )
    if not fit.converged:
        found.append(
            Condition(
                "not_converged",
                f"the fit stopped after {fit.sweeps} evaluations",
                "give start values in [material.parameters]",
            )
        )
    return replace(fit, conditions=tuple(found))
