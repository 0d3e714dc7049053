"""Relaxation spectrum of a table of dynamic moduli: a Prony series of as many terms as its frequencies carry.

E*(omega) = E_inf + sum E_k i omega tau_k / (1 + i omega tau_k), with relaxation times on a grid of equal steps in
ln tau and moduli E_k >= 0 that a penalty on the curvature of ln tau -> E_k keeps smooth; generalised cross-validation
chooses its weight. Sweeps at several temperatures are one curve over omega a_T: each temperature's shift a_T, and the
lag of the rig exp(i omega t), are identified with the spectrum, which is eliminated (variable projection), with exact
derivatives.

References
----------
Honerkamp and Weese (1993), A nonlinear regularization method for the calculation of relaxation spectra, Rheol. Acta
32:65-73, doi:10.1007/BF00396678.
Golub and Pereyra (2003), Separable nonlinear least squares: the variable projection method, Inverse Problems 19:R1-R26,
doi:10.1088/0266-5611/19/2/201.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.library.temperature import GAS, ZERO
from bushcli.inverse.certainty import invert_information
from bushcli.recording.dynamic.table import DynamicTable

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Times on the grid per decade of omega, of which many terms are zero: as many as make `_TERMS` together, within these
#: limits. Measured without noise, rms of the loss that is left with 3, 5, 8: of a rubber with two branches 2.6, 1.2,
#: 0.5 %, of one with a term per decade 0.4, 0.4, 0.1 %. On a master curve of 25 decades, 8 cost ten times as much as 3
#: and leave twice as much.
_PER_DECADE, _TERMS = (3.0, 8.0), 40
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
    def relative_moduli(self) -> Array:
        """g_k (k,) = E_k / E_inf, as the branches of `viscoelasticity` have them."""
        return np.asarray(self.moduli / self.equilibrium, dtype=np.float64)

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
        decayed = np.exp(-np.outer(time, 1.0 / self.times)) @ self.moduli
        return np.asarray(self.equilibrium + decayed, dtype=np.float64)


@dataclass(frozen=True)
class SpringPot:
    """E*(omega) = E_inf + E_1 (i omega)^beta, omega in rad/s at the reference temperature, and its misfit in %.

    Koeller (1984), Applications of fractional calculus to the theory of viscoelasticity, J. Appl. Mech. 51:299-307,
    doi:10.1115/1.3167616.
    """

    equilibrium: float
    modulus: float
    exponent: float
    storage_percent: float
    loss_percent: float


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
    lag, lag_error : float
        s; time by which the rig shows the force too early: it adds omega t to the loss angle; and its standard error.
    storage_percent, loss_percent : float
        Misfit, rms relative, in %.
    rows : int
        Number of rows.
    spring_pot : SpringPot
        Fitted to the same rows, with the same shifts and lag.
    """

    spectrum: Spectrum
    reference: float
    temperatures: Array
    shifts: Array
    shift_errors: Array
    lag: float
    lag_error: float
    storage_percent: float
    loss_percent: float
    rows: int
    spring_pot: SpringPot

    @cached_property
    def wlf(self) -> tuple[float, float, float] | None:
        """C1, C2 (K) of Williams, Landel and Ferry for the shifts, and what they miss, decades rms; None without."""
        if len(self.temperatures) < 3:
            return None
        from scipy.optimize import least_squares

        above = self.temperatures - self.reference

        def shift_misfits(p: Array) -> Array:
            C1, C2 = np.exp(p)
            return np.asarray(-C1 * above / np.maximum(C2 + above, 1.0) - self.shifts)

        # From constants about a reference some 50 K above the glass transition, doi:10.1021/ja01619a008.
        fit = least_squares(shift_misfits, np.log([8.86, 101.6 + max(0.0, -above.min())]))
        C1, C2 = map(float, np.exp(fit.x))
        return C1, C2, float(np.sqrt(np.mean(fit.fun**2)))

    @cached_property
    def arrhenius(self) -> tuple[float, float] | None:
        """Activation energy (kJ/mol) of the shifts, and what it misses, decades rms; None without shifts."""
        if len(self.temperatures) < 2:
            return None
        inverse = 1.0 / (self.temperatures + ZERO) - 1.0 / (self.reference + ZERO)
        per_energy = inverse / (GAS * np.log(10.0))
        energy = float(per_energy @ self.shifts / (per_energy @ per_energy))
        return energy, float(np.sqrt(np.mean((energy * per_energy - self.shifts) ** 2)))

    def at(self, frequency: Array, temperature: Array) -> Complex:
        """Return E* (n,) as the rig shows it.

        Parameters
        ----------
        frequency : shape (n,)
            Hz.
        temperature : shape (n,)
            Degrees C; between the steps log a_T is a straight line, beyond them it is held.
        """
        delay = np.exp(2j * np.pi * frequency * self.lag)
        return self.spectrum.at(2.0 * np.pi * self.reduced_frequencies(frequency, temperature)) * delay

    def reduced_frequencies(self, frequency: Array, temperature: Array) -> Array:
        """Return the frequencies (n,) in Hz that are the same at the reference temperature.

        Parameters
        ----------
        frequency, temperature : shape (n,)
            As for `at`, in Hz and degrees C.
        """
        if len(self.temperatures) < 2:
            return frequency
        shifts = np.interp(temperature, self.temperatures, self.shifts)
        return np.asarray(frequency * 10.0**shifts, dtype=np.float64)


def fit_spectrum(table: DynamicTable, reference: float | None = None, lag: bool = True) -> SpectrumFit:
    """Return the spectrum of a table of frequencies."""
    step, temperatures = _steps(table.temperature)
    count = len(temperatures)
    shown = count // 2 if reference is None else int(np.argmin(np.abs(temperatures - reference)))
    free = np.array([k != shown for k in range(count)] + [lag and count > 2])
    problem = _Problem(2.0 * np.pi * table.frequency, table.storage, table.loss, step, free)
    shifts = np.append(problem.overlapping_shifts(shown) if count > 1 else np.zeros(count), 0.0)
    # The weight of the penalty again at the end: at the first shifts the sweeps do not join.
    for _ in range(2):
        weight = problem.weight(shifts)
        shifts, solved = problem.minimise(shifts, weight)
    errors, (storage, loss) = problem.errors(shifts, solved), misfit_percent(solved.residual)
    return SpectrumFit(
        spectrum=_spectrum(solved.values, solved.times),
        reference=float(temperatures[shown]),
        temperatures=temperatures,
        shifts=shifts[:-1] / np.log(10.0),
        shift_errors=errors[:-1] / np.log(10.0),
        lag=float(shifts[-1]),
        lag_error=float(errors[-1]),
        storage_percent=storage,
        loss_percent=loss,
        rows=len(table),
        spring_pot=problem.spring_pot(shifts),
    )


def relaxation_spectrum(time: Array, modulus: Array) -> Spectrum:
    """Return the spectrum of a relaxation test: moduli (n,) in MPa at times (n,) in s after the step."""
    times = _grid(np.asarray(1.0 / time, dtype=np.float64))
    design = np.column_stack([np.ones(len(time)), np.exp(-np.outer(time, 1.0 / times))]) / modulus[:, None]
    return _spectrum(_regularise(design, None)[1], times)


def _spectrum(values: Array, times: Array) -> Spectrum:
    """Return the spectrum of values (k + 1,) >= 0 at times (k,), without the terms that are zero."""
    positive = values[1:] > 0.0
    return Spectrum(float(values[0]), values[1:][positive], times[positive])


def misfit_percent(residual: Array) -> tuple[float, float]:
    """Return the rms in % of relative misfits (2 n,): of storage, then of loss."""
    storage, loss = 100.0 * np.sqrt(np.mean(residual.reshape(2, -1) ** 2, axis=1))
    return float(storage), float(loss)


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
    per_decade = min(max(_TERMS / (high - low), _PER_DECADE[0]), _PER_DECADE[1])
    return np.logspace(low, high, max(int(per_decade * (high - low)) + 1, 2))


@dataclass(frozen=True, eq=False)
class _Solved:
    """Times (k,) in s, E_inf and E_k (k + 1,), relative residual (2 n,), design (2 n, k + 1), cost with the penalty."""

    times: Array
    values: Array
    residual: Array
    design: Array
    cost: float


@dataclass(frozen=True, eq=False)
class _Problem:
    """Rows of a table: omega, storage, loss and step of temperature (n,); which shifts, and the lag, are free (t + 1,).

    The parameters (t + 1,) are ln a_T of each step and the lag in s.
    """

    omega: Array
    storage: Array
    loss: Array
    step_of: NDArray[np.intp]
    free: NDArray[np.bool_]

    def reduced_frequencies(self, shifts: Array) -> Array:
        """Return the angular frequencies (n,) at the reference temperature."""
        return np.asarray(self.omega * np.exp(shifts[self.step_of]), dtype=np.float64)

    def relative_rows(self, modulus: Complex) -> Array:
        """Return real and imaginary parts (2 n, ...) over the measured ones."""
        parts = np.stack([modulus.real.T / self.storage, modulus.imag.T / self.loss], axis=-2)
        return np.asarray(parts.reshape(*parts.shape[:-2], -1).T, dtype=np.float64)

    def design(self, shifts: Array, times: Array) -> Array:
        """Return the relative response (2 n, k + 1) of the equilibrium and of each term."""
        x = 1j * np.outer(self.reduced_frequencies(shifts), times)
        terms = np.column_stack([np.ones(len(x), dtype=complex), x / (1.0 + x)])
        return self.relative_rows(terms * np.exp(1j * self.omega * shifts[-1])[:, None])

    def weight(self, shifts: Array) -> float:
        """Return the weight of the penalty by cross-validation."""
        return _regularise(self.design(shifts, _grid(self.reduced_frequencies(shifts))), None)[0]

    def solve(self, shifts: Array, weight: float) -> _Solved:
        """Return the spectrum for given parameters."""
        times = _grid(self.reduced_frequencies(shifts))
        design = self.design(shifts, times)
        _, values = _regularise(design, weight)
        residual = design @ values - 1.0
        penalty = weight * _curvature(design) @ values
        return _Solved(times, values, residual, design, float(residual @ residual + penalty @ penalty))

    def derivative(self, shifts: Array, solved: _Solved) -> Array:
        """Return the derivative (2 n, p) of the residual by the free parameters, at a given spectrum."""
        spectrum = Spectrum(float(solved.values[0]), solved.values[1:], solved.times)
        delay = np.exp(1j * self.omega * shifts[-1])
        slope = spectrum.slope(self.reduced_frequencies(shifts)) * delay
        modulus = spectrum.at(self.reduced_frequencies(shifts)) * delay
        columns = [slope * (self.step_of == k) for k in range(len(shifts) - 1)] + [1j * self.omega * modulus]
        return self.relative_rows(np.column_stack(columns))[:, self.free]

    def _projected_derivative(self, shifts: Array, solved: _Solved) -> Array:
        """Return the derivative (2 n, p) with the spectrum eliminated (Kaufman's approximation)."""
        derivative = self.derivative(shifts, solved)
        span, _ = np.linalg.qr(solved.design[:, solved.values > 0.0])
        return np.asarray(derivative - span @ (span.T @ derivative), dtype=np.float64)

    def step(self, shifts: Array, solved: _Solved) -> Array:
        """Return the step (t + 1,) of the parameters by Gauss and Newton, at most one decade."""
        derivative = self._projected_derivative(shifts, solved)
        scale = np.linalg.norm(derivative, axis=0)
        scaled, *_ = np.linalg.lstsq(derivative / scale, -solved.residual, rcond=1e-8)
        change = np.zeros(len(shifts))
        change[self.free] = scaled / scale
        return change * min(1.0, np.log(10.0) / max(float(np.abs(change).max()), 1e-300))

    def errors(self, shifts: Array, solved: _Solved) -> Array:
        """Return the standard errors (t + 1,) of the parameters."""
        spread = np.zeros(len(shifts))
        if not self.free.any():
            return spread
        derivative = self._projected_derivative(shifts, solved)
        values = np.count_nonzero(solved.values) + derivative.shape[1]
        variance = float(solved.residual @ solved.residual) / max(len(solved.residual) - values, 1)
        inverse, _ = invert_information(derivative.T @ derivative)
        spread[self.free] = np.sqrt(np.maximum(variance * np.diag(inverse), 0.0))
        return spread

    def minimise(self, shifts: Array, weight: float) -> tuple[Array, _Solved]:
        """Return the shifts of the least cost, by Gauss and Newton with halved steps, and the spectrum there.

        SciPy's least_squares cannot: the grid of times, and with it the number of rows, follows the shifts.
        """
        solved = self.solve(shifts, weight)
        for _ in range(_STEPS if self.free.any() else 0):
            change, share = self.step(shifts, solved), 1.0
            candidate = self.solve(shifts + change, weight)
            while candidate.cost >= solved.cost and share > 1e-3:
                share *= 0.5
                candidate = self.solve(shifts + share * change, weight)
            if candidate.cost >= solved.cost:
                break
            done = solved.cost - candidate.cost < 1e-7 * solved.cost
            shifts, solved = shifts + share * change, candidate
            if done:
                break
        return shifts, solved

    def overlapping_shifts(self, shown: int) -> Array:
        """Return first shifts (t,), natural logarithms: neighbouring sweeps overlap in ln E'."""
        shifts = np.zeros(len(self.free) - 1)
        for sweeps in (range(shown, len(shifts)), range(shown, -1, -1)):
            for neighbour, k in pairwise(sweeps):
                shifts[k] = shifts[neighbour] + self._shift_between(neighbour, k)
        return shifts

    def _shift_between(self, first: int, other: int) -> float:
        """Return ln a of the second sweep relative to the first, by their storage moduli over their common range."""
        curves = []
        for k in (first, other):
            rows = np.flatnonzero(self.step_of == k)
            order = rows[np.argsort(self.omega[rows])]
            curves.append((np.log(self.omega[order]), np.log(self.storage[order])))
        (x1, y1), (x2, y2) = curves
        slope = 0.5 * (np.polyfit(x1, y1, 1)[0] + np.polyfit(x2, y2, 1)[0])
        return float((np.mean(y2) - np.mean(y1)) / max(slope, 1e-3) - (np.mean(x2) - np.mean(x1)))

    def spring_pot(self, shifts: Array) -> SpringPot:
        """Return the spring-pot of the rows at given shifts: E_inf and E_1 are linear, the exponent is searched for."""
        from scipy.optimize import minimize_scalar, nnls

        delay = np.exp(1j * self.omega * shifts[-1])[:, None]

        def fit_exponent(exponent: float) -> tuple[Array, Array]:
            power = (1j * self.reduced_frequencies(shifts)) ** exponent
            design = self.relative_rows(np.column_stack([np.ones(len(power), dtype=complex), power]) * delay)
            values, _ = nnls(design, np.ones(len(design)))
            return values, design @ values - 1.0

        def misfit(exponent: float) -> float:
            return float(np.sum(fit_exponent(exponent)[1] ** 2))

        exponent = float(minimize_scalar(misfit, bounds=(1e-3, 0.999), method="bounded").x)
        values, residual = fit_exponent(exponent)
        return SpringPot(float(values[0]), float(values[1]), exponent, *misfit_percent(residual))


def _curvature(design: Array) -> Array:
    """Return the penalty's rows: second differences of the moduli, in units of the mean modulus of the data."""
    count = design.shape[1] - 1
    scale = float(np.mean(design[:, 0][design[:, 0] > 0.0]))
    return scale * np.diff(np.eye(count + 1)[1:], 2, axis=0) if count > 2 else np.zeros((0, count + 1))


def _regularise(design: Array, weight: float | None) -> tuple[float, Array]:
    """Return the weight of the penalty and the values (k + 1,) >= 0; the weight by cross-validation where it is None.

    The design (n, k + 1) is relative to what was measured.

    Generalised cross-validation (Golub, Heath and Wahba 1979, doi:10.1080/00401706.1979.10489751), with the degrees of
    freedom of the terms that are not zero.
    """
    from scipy.optimize import nnls

    rows = _curvature(design)
    target = np.concatenate([np.ones(len(design)), np.zeros(len(rows))])
    trials = []
    for trial_weight in _WEIGHTS if weight is None else [weight]:
        penalised = np.vstack([design, trial_weight * rows])
        values, _ = nnls(penalised, target, maxiter=100 * design.shape[1])
        residual, active = design @ values - 1.0, values > 0.0
        free = 0.0
        if weight is None:
            normal, inner = (part[:, active].T @ part[:, active] for part in (penalised, design))
            free = float(np.trace(np.linalg.lstsq(normal, inner, rcond=None)[0]))
        score = float(residual @ residual) / max(1.0 - free / len(design), 1e-3) ** 2
        trials.append((score, float(trial_weight), values))
    return min(trials, key=lambda trial: trial[0])[1:]
