"""Relaxation spectrum of a table of dynamic moduli: a Prony series of as many terms as its frequencies carry, or a spring-pot.

E*(omega) = E_inf + sum E_k i omega tau_k / (1 + i omega tau_k), with relaxation times on a grid of equal steps in ln tau and
moduli E_k >= 0 that a penalty on the curvature of ln tau -> E_k keeps smooth; generalised cross-validation chooses its
weight. Sweeps at several temperatures are one curve over omega a_T: each temperature's shift a_T is identified with the
spectrum, which is eliminated (variable projection), with exact derivatives.

References
----------
Honerkamp and Weese (1993), A nonlinear regularization method for the calculation of relaxation spectra, Rheol. Acta 32:65-73,
doi:10.1007/BF00396678.
Golub and Pereyra (2003), Separable nonlinear least squares: the variable projection method, Inverse Problems 19:R1-R26,
doi:10.1088/0266-5611/19/2/201.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.dynamic.table import DynamicTable

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Terms of the series per decade of omega: two resolve a spectrum to 1 % of the modulus, because the loss of a single
#: term is 1.14 decades wide at half its height.
_PER_DECADE = 2.0
#: Decades beyond the data: slower and faster terms act on the ends of the data.
_BEYOND = 0.5
#: Weights of the penalty that are tried.
_WEIGHTS = np.concatenate([[0.0], np.geomspace(1e-4, 10.0, 11)])
_STEPS = 60
#: Temperatures closer together are one step of the chamber, K.
_KELVINS = 1.5


@dataclass(frozen=True, eq=False)
class Spectrum:
    """A relaxation spectrum at a reference temperature.

    Attributes
    ----------
    equilibrium : float
        Modulus after a long rest, MPa or N/mm.
    moduli, times : shape (k,)
        E_k in the same unit, tau_k in s.
    """

    equilibrium: float
    moduli: Array
    times: Array

    @property
    def relative(self) -> Array:
        """g_k (k,) = E_k / E_inf, as the branches of the effect viscoelasticity have them."""
        return self.moduli / self.equilibrium

    def at(self, omega: Array) -> Complex:
        """Return E* (n,) at angular frequencies (n,) in rad/s."""
        x = 1j * np.outer(omega, self.times)
        return np.asarray(self.equilibrium + (x / (1.0 + x)) @ self.moduli, dtype=np.complex128)

    def slope(self, omega: Array) -> Complex:
        """Return dE*/d ln omega (n,) at angular frequencies (n,) in rad/s."""
        x = 1j * np.outer(omega, self.times)
        return np.asarray((x / (1.0 + x) ** 2) @ self.moduli, dtype=np.complex128)

    def relaxation(self, time: Array) -> Array:
        """Return the modulus (n,) at times (n,) in s after a step of strain."""
        return np.asarray(self.equilibrium + np.exp(-np.outer(time, 1.0 / self.times)) @ self.moduli)


@dataclass(frozen=True, eq=False)
class SpectrumFit:
    """A spectrum that was identified from a table.

    Attributes
    ----------
    spectrum : Spectrum
    reference : float
        Degrees C; nan where the table has no temperatures.
    temperatures : shape (t,)
        Degrees C, of the steps of the table.
    shifts, shift_errors : shape (t,)
        log10 a_T: the frequencies at a temperature count as a_T times as high at the reference; and standard errors.
    storage_percent, loss_percent : float
        Misfit, rms relative, in %.
    rows : int
        Number of rows.
    """

    spectrum: Spectrum
    reference: float
    temperatures: Array
    shifts: Array
    shift_errors: Array
    storage_percent: float
    loss_percent: float
    rows: int


def fit_spectrum(table: DynamicTable, reference: float | None = None) -> SpectrumFit:
    """Return the spectrum of a table of frequencies.

    Parameters
    ----------
    table : DynamicTable
        Sweeps over frequency at one amplitude and preload, at one or more temperatures.
    reference : float, optional
        Temperature of the spectrum, degrees C; the step nearest to it. The middle one when None.
    """
    step, temperatures = _steps(table.temperature)
    shown = len(temperatures) // 2 if reference is None else int(np.argmin(np.abs(temperatures - reference)))
    problem = _Problem(2.0 * np.pi * table.frequency, table.storage, table.loss, step, shown)
    shifts = _overlapping(problem, len(temperatures)) if len(temperatures) > 1 else np.zeros(1)
    weight = problem.weight(shifts)
    solved = problem.solve(shifts, weight)
    for _ in range(_STEPS if len(temperatures) > 1 else 0):
        change = problem.step(shifts, solved)
        share = 1.0
        while share > 1e-3:
            tried = problem.solve(shifts + share * change, weight)
            if tried.cost < solved.cost:
                break
            share *= 0.5
        else:
            break
        done = solved.cost - tried.cost < 1e-7 * solved.cost
        shifts, solved = shifts + share * change, tried
        if done:
            break
    residual = solved.residual.reshape(2, -1)
    errors = problem.errors(shifts, solved) if len(temperatures) > 1 else np.zeros(1)
    kept = solved.values[1:] > 0.0
    return SpectrumFit(
        spectrum=Spectrum(float(solved.values[0]), solved.values[1:][kept], solved.times[kept]),
        reference=float(temperatures[shown]),
        temperatures=temperatures,
        shifts=shifts / np.log(10.0),
        shift_errors=errors / np.log(10.0),
        storage_percent=100.0 * float(np.sqrt(np.mean(residual[0] ** 2))),
        loss_percent=100.0 * float(np.sqrt(np.mean(residual[1] ** 2))),
        rows=len(table),
    )


def relaxed(time: Array, modulus: Array) -> Spectrum:
    """Return the spectrum of a relaxation test.

    Parameters
    ----------
    time : shape (n,)
        s after the step.
    modulus : shape (n,)
        MPa.
    """
    times = _grid(1.0 / time)
    design = np.column_stack([np.ones(len(time)), np.exp(-np.outer(time, 1.0 / times))]) / modulus[:, None]
    weight, values = _regularised(design, np.ones(len(time)), None)
    kept = values[1:] > 0.0
    return Spectrum(float(values[0]), values[1:][kept], times[kept])


def _steps(temperature: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the step of temperature of each row (n,), and their mean temperatures (t,), rising."""
    if np.isnan(temperature).any():
        return np.zeros(len(temperature), dtype=np.intp), np.array([np.nan])
    order = np.argsort(temperature, kind="stable")
    step = np.empty(len(temperature), dtype=np.intp)
    step[order] = np.concatenate([[0], np.cumsum(np.diff(temperature[order]) > _KELVINS)])
    return step, np.array([float(np.mean(temperature[step == k])) for k in range(step.max() + 1)])


def _grid(omega: Array) -> Array:
    """Return relaxation times (k,) in s for angular frequencies, equally spaced in their logarithm."""
    low, high = -np.log10(omega.max()) - _BEYOND, -np.log10(omega.min()) + _BEYOND
    return np.logspace(low, high, max(int(_PER_DECADE * (high - low)) + 1, 2))


@dataclass(frozen=True, eq=False)
class _Solved:
    """Times (k,), values E_inf and E_k (k + 1,), relative residual (2 n,), design (2 n, k + 1), cost with the penalty."""

    times: Array
    values: Array
    residual: Array
    design: Array
    cost: float


@dataclass(frozen=True, eq=False)
class _Problem:
    """Rows of a table: omega, storage, loss and step of temperature (n,), and the step whose shift is zero."""

    omega: Array
    storage: Array
    loss: Array
    step_of: NDArray[np.intp]
    shown: int

    def _design(self, shifts: Array, times: Array) -> Array:
        x = np.outer(self.omega * np.exp(shifts[self.step_of]), times)
        storage = np.column_stack([np.ones(len(x)), x**2 / (1.0 + x**2)]) / self.storage[:, None]
        loss = np.column_stack([np.zeros(len(x)), x / (1.0 + x**2)]) / self.loss[:, None]
        return np.vstack([storage, loss])

    def weight(self, shifts: Array) -> float:
        """Return the weight of the penalty by cross-validation."""
        design = self._design(shifts, _grid(self.omega * np.exp(shifts[self.step_of])))
        return _regularised(design, np.ones(len(design)), None)[0]

    def solve(self, shifts: Array, weight: float) -> _Solved:
        """Return the spectrum for given shifts."""
        times = _grid(self.omega * np.exp(shifts[self.step_of]))
        design = self._design(shifts, times)
        _, values = _regularised(design, np.ones(len(design)), weight)
        residual = design @ values - 1.0
        penalty = weight * _curvature(design) @ values
        return _Solved(times, values, residual, design, float(residual @ residual + penalty @ penalty))

    def _derivative(self, shifts: Array, solved: _Solved) -> Array:
        """Return the derivative (2 n, t - 1) of the residual by the free shifts, the spectrum held or eliminated."""
        spectrum = Spectrum(float(solved.values[0]), solved.values[1:], solved.times)
        slope = spectrum.slope(self.omega * np.exp(shifts[self.step_of]))
        both = np.concatenate([slope.real / self.storage, slope.imag / self.loss])
        step = np.concatenate([self.step_of, self.step_of])
        free = [k for k in range(len(shifts)) if k != self.shown]
        by_shift = np.column_stack([both * (step == k) for k in free])
        active = solved.design[:, solved.values > 0.0]
        span, _ = np.linalg.qr(active)
        return np.asarray(by_shift - span @ (span.T @ by_shift), dtype=np.float64)

    def step(self, shifts: Array, solved: _Solved) -> Array:
        """Return the step (t,) of the shifts by Gauss and Newton, at most one decade."""
        derivative = self._derivative(shifts, solved)
        found, *_ = np.linalg.lstsq(derivative, -solved.residual, rcond=1e-8)
        change = np.zeros(len(shifts))
        change[np.arange(len(shifts)) != self.shown] = found
        return change * min(1.0, np.log(10.0) / max(float(np.abs(change).max()), 1e-300))

    def errors(self, shifts: Array, solved: _Solved) -> Array:
        """Return the standard errors (t,) of the shifts, natural logarithms."""
        derivative = self._derivative(shifts, solved)
        free = max(len(solved.residual) - np.count_nonzero(solved.values) - derivative.shape[1], 1)
        variance = float(solved.residual @ solved.residual) / free
        found = np.zeros(len(shifts))
        covariance = variance * np.linalg.pinv(derivative.T @ derivative)
        found[np.arange(len(shifts)) != self.shown] = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return found


def _curvature(design: Array) -> Array:
    """Return the penalty's rows: second differences of the moduli, in units of the mean modulus of the data."""
    count = design.shape[1] - 1
    scale = float(np.mean(design[:, 0][design[:, 0] > 0.0]))
    return scale * np.diff(np.eye(count + 1)[1:], 2, axis=0) if count > 2 else np.zeros((0, count + 1))


def _regularised(design: Array, target: Array, weight: float | None) -> tuple[float, Array]:
    """Return the weight of the penalty and the values (k + 1,) >= 0; the weight by cross-validation where it is None.

    Generalised cross-validation with the degrees of freedom of the terms that are not zero (Golub, Heath and Wahba 1979,
    doi:10.1080/00401706.1979.10489751).
    """
    from scipy.optimize import nnls

    rows = _curvature(design)
    best: tuple[float, float, Array] | None = None
    for one in _WEIGHTS if weight is None else [weight]:
        penalised = np.vstack([design, one * rows])
        values, _ = nnls(penalised, np.concatenate([target, np.zeros(len(rows))]), maxiter=100 * design.shape[1])
        if weight is not None:
            return float(one), values
        active = values > 0.0
        residual = design @ values - target
        normal = penalised[:, active].T @ penalised[:, active]
        free = float(np.trace(np.linalg.lstsq(normal, design[:, active].T @ design[:, active], rcond=None)[0]))
        score = float(residual @ residual) / max(1.0 - free / len(target), 1e-3) ** 2
        if best is None or score < best[0]:
            best = score, float(one), values
    assert best is not None
    return best[1], best[2]


def _overlapping(problem: _Problem, count: int) -> Array:
    """Return first shifts (t,), natural logarithms: neighbouring sweeps overlap in ln E'."""
    shifts = np.zeros(count)
    for sense in (1, -1):
        ends = range(problem.shown + sense, count if sense > 0 else -1, sense)
        for k in ends:
            shifts[k] = shifts[k - sense] + _shift_between(problem, k - sense, k)
    return shifts


def _shift_between(problem: _Problem, one: int, other: int) -> float:
    """Return ln a of the second sweep relative to the first, by their storage moduli over their common range."""
    curves = []
    for k in (one, other):
        rows = np.flatnonzero(problem.step_of == k)
        order = rows[np.argsort(problem.omega[rows])]
        curves.append((np.log(problem.omega[order]), np.log(problem.storage[order])))
    (x1, y1), (x2, y2) = curves
    slope = 0.5 * (np.polyfit(x1, y1, 1)[0] + np.polyfit(x2, y2, 1)[0])
    return float((np.mean(y2) - np.mean(y1)) / max(slope, 1e-3) - (np.mean(x2) - np.mean(x1)))
