"""One-dimensional laws of filled rubber on measured strain sweeps and loops: what each leaves, with how many constants.

python -m benchmarks.payne sweep FILE [STIFFNESS_UNIT STRAIN_UNIT]  strain sweeps of a coupon, a fit per temperature
python -m benchmarks.payne heated FILE STIFFNESS_UNIT STRAIN_UNIT DEGREES...  one set for all, fitted at some
python -m benchmarks.payne loops SLOW.csv FAST.csv                 two recordings of one specimen: time, travel, force
python -m benchmarks.payne relax FILE                              frequency -> relaxation and back, of sweeps

The files are not part of the project. `payne.md` has what was measured.

The law that is tried: a spectrum of Maxwell branches on a clock of time and path, dz = dt + |d gamma| C phi(a), where a
is the amplitude: half of the range that the motion has had so far. In time the branches are integrated exactly for a
strain that is linear within a step; at a steady sine the first harmonic is that of the same integration over half a
cycle, because h(T/2) = -h(0).
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import gamma

from bushcli.faults.dynamic import table_faults
from bushcli.inverse.spectrum import fit_spectrum, relaxation_spectrum
from bushcli.recording import read_recording
from bushcli.recording.dynamic.read import read_dynamic
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.recording.source import Source
from geometry.shape import shapes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

BRANCHES, STEPS = 24, 64
#: Random starts of each fit.
STARTS = 4


def power_law(p: Array) -> tuple[Array, Array]:
    """H ~ tau^nu between tau_max e^-width and tau_max: ln tau_max, width, nu -> times (s) and shares."""
    x = np.linspace(-math.exp(p[1]), 0.0, BRANCHES)
    share = np.exp(p[2] * x)
    return np.exp(p[0] + x), share / share.sum()


def modified_power_law(p: Array) -> tuple[Array, Array]:
    """Spectrum of E(t) = (1 + t/tau0)^-nu: ln tau0, ln nu (Williams 1964, doi:10.1016/0032-3861(64)90172-1)."""
    nu, last = math.exp(min(max(p[1], -6.0), 1.0)), 26.0
    x = np.linspace(-2.0, last, BRANCHES)
    step = x[1] - x[0]
    share = np.exp(-nu * x - np.exp(-x)) / gamma(nu) * step
    share[-1] += math.exp(-nu * (last + 0.5 * step)) / nu / gamma(nu)  # the slower ones
    return np.exp(p[0] + x), share


def cole_cole(p: Array) -> tuple[Array, Array]:
    """Spectrum of w/(1 + w), w = (i omega tau0)^beta: ln tau0, logit beta."""
    beta = 1.0 / (1.0 + math.exp(-p[1]))
    x = np.linspace(-13.0, 13.0, BRANCHES)
    height = np.sin(beta * np.pi) / (np.cosh(beta * x) + np.cos(beta * np.pi)) / (2.0 * np.pi)
    return np.exp(p[0] + x), height * (x[1] - x[0])


Shares = Callable[[Array], tuple[Array, Array]]
Speed = Callable[[Array, Array], Array]
Harmonic = Callable[[Array, Array, Callable[[Array], Array], Array, Array], Complex]
#: Spectra: shares of the branches by their constants, and ranges of the constants' starts.
SPECTRA: dict[str, tuple[Shares, list[tuple[float, float]]]] = {
    "power law": (power_law, [(-2.0, 11.0), (1.8, 2.8), (-0.2, 0.2)]),
    "modified power law": (modified_power_law, [(-3.0, 4.0), (-3.0, 0.0)]),
    "Cole-Cole": (cole_cole, [(-2.0, 4.0), (-2.0, 0.5)]),
}
#: phi(a) of the clock: constants and ranges of their starts, natural logarithms; a in units of the data.
RATES: dict[str, tuple[Speed, list[tuple[float, float]]]] = {
    "C (1 + a/a0)^m": (
        lambda a, p: np.exp(p[0]) * (1.0 + a / np.exp(p[1])) ** np.exp(p[2]),
        [(2.0, 8.0), (-6.0, -2.0), (-0.5, 1.2)],
    ),
    "C a^m": (lambda a, p: np.exp(p[0]) * a ** np.exp(p[1]), [(-2.0, 8.0), (-0.5, 0.7)]),
}


def steady_harmonic(
    amplitude: Array, omega: Array, rate: Callable[[Array], Array], times: Array, shares: Array
) -> Complex:
    """Return the first harmonic (n,) of the branches over the amplitude (n,) in a steady sine.

    ``rate`` is C phi of an amplitude (n, STEPS). The integral is over half a cycle, from one reversal to the next.
    """
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, STEPS + 1)
    step = turn[1] - turn[0]
    sine = np.sin(turn)
    whole = np.repeat(amplitude[:, None], STEPS, axis=1)
    clock = step / omega[:, None] + whole * np.diff(sine) * rate(whole)
    ratio = clock[:, :, None] / times
    decay, gain = np.exp(-ratio), -np.expm1(-ratio) / ratio
    h = np.zeros((len(amplitude), STEPS + 1, len(times)))
    for i in range(STEPS):
        h[:, i + 1] = h[:, i] * decay[:, i] + gain[:, i] * (sine[i + 1] - sine[i])
    left = np.exp(-np.concatenate([np.zeros_like(ratio[:, :1]), np.cumsum(ratio, axis=1)], axis=1))
    h += (-h[:, -1] / (1.0 + left[:, -1]))[:, None] * left
    stress = h @ shares
    weights = np.full(STEPS + 1, step)
    weights[[0, -1]] *= 0.5
    cosine = np.cos(turn)
    return np.asarray(
        (2.0 / np.pi) * ((stress * sine) @ weights + 1j * ((stress * cosine) @ weights)), dtype=np.complex128
    )


def mean_clock(
    amplitude: Array, omega: Array, rate: Callable[[Array], Array], times: Array, shares: Array
) -> Complex:
    """Return the same with the clock's mean speed, 1 + 4 a f C phi: the closed form that thins the spectrum."""
    speed = 1.0 + 4.0 * amplitude * omega / (2.0 * np.pi) * rate(amplitude)
    x = 1j * (omega / speed)[:, None] * times
    return np.asarray((x / (1.0 + x)) @ shares, dtype=np.complex128)


@dataclass(frozen=True)
class ResponseFit:
    """Misfit of storage and loss in %, and the constants."""

    storage: float
    loss: float
    constants: Array


def fit_response(
    response: Callable[[Array], Complex], table: DynamicTable, starts: list[tuple[float, float]]
) -> ResponseFit:
    """Fit E_inf + E_1 response(p): E_inf and E_1 are linear, relative misfits."""
    count, rng = len(table), np.random.default_rng(0)

    def residual(p: Array) -> Array:
        with np.errstate(all="ignore"):
            unit_response = response(p)
        rows = [np.concatenate([np.full(count, 1.0) / table.storage, np.zeros(count)])]
        rows += [np.concatenate([unit_response.real / table.storage, unit_response.imag / table.loss])]
        design = np.column_stack(rows)
        if not np.isfinite(design).all():
            return np.full(2 * count, 10.0)
        values = np.linalg.lstsq(design, np.ones(2 * count), rcond=None)[0]
        return np.asarray(design @ values - 1.0)

    fits = [
        least_squares(residual, [rng.uniform(*ends) for ends in starts], max_nfev=60, x_scale="jac")
        for _ in range(STARTS)
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    rms = 100.0 * np.sqrt(np.mean(best.fun.reshape(2, -1) ** 2, axis=1))
    return ResponseFit(float(rms[0]), float(rms[1]), np.asarray(best.x))


def _branches(
    n: int, shape: Shares, speed: Speed, harmonic: Harmonic, p: Array, amplitude: Array, omega: Array
) -> Complex:
    """Return the response of a spectrum with n constants on a clock with the others."""
    return harmonic(amplitude, omega, lambda a: speed(a, p[n:]), *shape(p[:n]))


def laws() -> Iterator[tuple[str, int, Callable[[Array, Array, Array], Complex], list[tuple[float, float]]]]:
    """Yield name, number of constants, response(p, amplitude, omega) and starts of the laws of a sweep."""
    for harmonic, of in ((steady_harmonic, "path clock"), (mean_clock, "its mean speed")):
        for spectrum, (shape, first) in SPECTRA.items():
            for law, (speed, second) in RATES.items():
                response = partial(_branches, len(first), shape, speed, harmonic)
                yield f"{spectrum}, {of}, {law}", 2 + len(first) + len(second), response, [*first, *second]

    def kraus(p: Array, amplitude: Array, omega: Array) -> Complex:
        x = (amplitude / np.exp(p[0])) ** np.exp(p[1])
        return np.asarray((1.0 + 1j * np.exp(p[2]) * (x + np.exp(p[3]))) / (1.0 + x**2))

    yield "Kraus", 6, kraus, [(-6.0, -3.0), (-1.0, 0.5), (-2.0, 0.0), (-3.0, 0.0)]

    def sliders(p: Array, amplitude: Array, omega: Array) -> Complex:
        total = np.zeros(len(amplitude), dtype=complex)
        for share, slip in zip((1.0, np.exp(p[0]), np.exp(p[1])), np.exp(np.cumsum(p[2:5])), strict=True):
            part = np.minimum(slip / amplitude, 1.0)
            turned = np.arccos(1.0 - 2.0 * part)
            total += share * ((turned - 0.5 * np.sin(2.0 * turned)) + 4j * part * (1.0 - part)) / np.pi
        return total

    yield "three sliders", 7, sliders, [(-1.0, 1.0), (-1.0, 1.0), (-8.0, -5.0), (0.5, 2.5), (0.5, 2.5)]


def strain_sweeps(file: str, stiffness: str, strain: str) -> tuple[list[DynamicTable], list[str]]:
    """Return the strain sweeps in a file, rows off their curve left out, and what is wrong with them."""
    units = {"amplitude": strain, "storage": stiffness, "loss": stiffness}
    table = read_dynamic(DynamicSource("uniaxial", (Path(file),), "sweep", units=units, amplitude_is="peak"))
    faults = table_faults(shapes()["coupon"](), [table])
    bad = np.any([fault.samples for fault in faults if fault.kind == "spikes"], axis=0)
    table = table.rows(np.broadcast_to(~bad, len(table)))
    return [table.rows(rows) for rows in table.conditions()], [
        f"{fault.kind}: {fault.where}" for fault in faults
    ]


#: What follows the temperature, each as exp(k (1/T - 1/Tr)): the relaxing modulus and the exponent nu of the spectrum;
#: the clock's time ("dt": the path counts as at the reference); all relaxation times.
HEATED = ("E_1", "E_1, nu", "E_1, all times", "E_1, dt", "dt, nu", "E_1, nu, dt")


def heated(file: str, stiffness: str, strain: str, *degrees: str) -> Iterator[str]:
    """Yield what one set of constants, fitted to the sweeps at some temperatures, leaves of all of them."""
    curves, said = strain_sweeps(file, stiffness, strain)
    yield from said
    known = [any(abs(c.temperature.mean() - float(degree)) < 2.0 for degree in degrees) for c in curves]
    at = [
        f"{c.temperature.mean():.0f} degC{'' if k else ' (held out)'}"
        for c, k in zip(curves, known, strict=True)
    ]
    yield "| spectrum | with the temperature | constants | " + " | ".join(at) + " | k, 1000 K |"
    yield "| --- " * (len(curves) + 4) + "|"
    for name in ("modified power law", "power law"):
        for varied in HEATED:
            constants, left, powers = _at_all(name, varied.split(", "), curves, np.array(known))
            rms = 100.0 * np.sqrt([np.mean(misfit.reshape(2, -1) ** 2, axis=1) for misfit in left])
            cells = " | ".join(f"{storage:.1f}, {loss:.1f}" for storage, loss in rms)
            yield f"| {name} | {varied} | {constants} | {cells} | {', '.join(f'{k:.2f}' for k in powers)} |"


def _at_all(
    name: str, varied: list[str], curves: list[DynamicTable], known: NDArray[np.bool_]
) -> tuple[int, list[Array], Array]:
    """Return number of constants, relative misfit of each curve (2 n,), and k of what follows the temperature."""
    (shape, first), (speed, second) = SPECTRA[name], RATES["C (1 + a/a0)^m"]
    n = len(first)

    def rows(p: Array, c: DynamicTable) -> Array:
        inverse = 1e3 / (c.temperature.mean() + 273.15) - 1e3 / 293.15
        by = dict.fromkeys(("E_1", "nu", "all times", "dt"), 1.0)
        by |= {key: math.exp(k * inverse) for key, k in zip(varied, p[-len(varied) :], strict=True)}
        own = p[:n].copy()
        # The last constant of a spectrum is nu, or its logarithm.
        own[-1] = own[-1] + math.log(by["nu"]) if name == "modified power law" else own[-1] * by["nu"]
        times, shares = shape(own)
        slower = by["dt"] * by["all times"]

        def rate(a: Array) -> Array:
            return by["dt"] * speed(a, p[n:])

        response = by["E_1"] * steady_harmonic(
            c.amplitude, 2.0 * np.pi * c.frequency, rate, slower * times, shares
        )
        still = np.append(1.0 / c.storage, np.zeros(len(c)))
        return np.column_stack([still, np.append(response.real / c.storage, response.imag / c.loss)])

    def solve(p: Array) -> tuple[Array, Array]:
        with np.errstate(all="ignore"):
            design = np.vstack([rows(p, c) for c, k in zip(curves, known, strict=True) if k])
        if not np.isfinite(design).all():
            return np.zeros(2), np.full(len(design), 10.0)
        values = np.linalg.lstsq(design, np.ones(len(design)), rcond=None)[0]
        return values, design @ values - 1.0

    starts, rng = [*first, *second, *[(0.5, 1.5)] * len(varied)], np.random.default_rng(0)
    tries = [
        least_squares(
            lambda p: solve(p)[1], [rng.uniform(*ends) for ends in starts], max_nfev=60, x_scale="jac"
        )
        for _ in range(STARTS)
    ]
    best = np.asarray(min(tries, key=lambda fit: float(fit.cost)).x)
    values = solve(best)[0]
    return 2 + len(starts), [rows(best, c) @ values - 1.0 for c in curves], best[-len(varied) :]


def sweep(file: str, stiffness: str = "MPa", strain: str = "percent") -> Iterator[str]:
    """Yield a table of what each law leaves of the strain sweeps in a file, by temperature."""
    curves, said = strain_sweeps(file, stiffness, strain)
    yield from said
    yield "| law | constants | " + " | ".join(f"{c.temperature.mean():.0f} degC" for c in curves) + " | s |"
    yield "| --- " * (len(curves) + 3) + "|"
    for name, count, response, starts in laws():
        begin = time.perf_counter()
        cells = []
        for c in curves:
            omega = 2.0 * np.pi * c.frequency
            fit = fit_response(partial(response, amplitude=c.amplitude, omega=omega), c, starts)
            cells.append(f"{fit.storage:.1f}, {fit.loss:.1f}")
        yield f"| {name} | {count} | {' | '.join(cells)} | {time.perf_counter() - begin:.0f} |"


def amplitudes(travel: Array) -> tuple[Array, Array, Array]:
    """Return half of the range since the last reversal and so far, and the largest travel so far, (n,) each."""
    since, so_far, largest = np.zeros((3, len(travel)))
    turn, sense, low, high = travel[0], 0.0, travel[0], travel[0]
    for i in range(1, len(travel)):
        now = float(np.sign(travel[i] - travel[i - 1]))
        if now and sense and now != sense:
            turn = travel[i - 1]
        sense = now or sense
        low, high = min(low, travel[i]), max(high, travel[i])
        since[i], so_far[i] = 0.5 * abs(0.5 * (travel[i] + travel[i - 1]) - turn), 0.5 * (high - low)
        largest[i] = max(largest[i - 1], abs(travel[i]))
    return np.maximum(since, 1e-6), np.maximum(so_far, 1e-6), np.maximum(largest, 1e-6)


def in_time(time_: Array, travel: Array, clock: Array, times: Array, shares: Array) -> Array:
    """Return the stress (n,) of the branches of unit modulus on a clock (n,), its increments."""
    h, out = np.zeros(len(times)), np.zeros(len(time_))
    for i in range(1, len(time_)):
        ratio = np.maximum(clock[i] / times, 1e-12)
        h = h * np.exp(-ratio) - np.expm1(-ratio) / ratio * (travel[i] - travel[i - 1])
        out[i] = shares @ h
    return out


def loops(slow: str, fast: str) -> Iterator[str]:
    """Yield what each law leaves of two recordings, rms in % of their ranges, with odd quintic elasticity."""
    records = [read_recording(Source("axial", Path(file))) for file in (slow, fast)]
    memory = [amplitudes(recording.displacement) for recording in records]
    scale = np.concatenate([np.full(len(r.force), np.sqrt(len(r.force))) for r in records])
    scale *= np.concatenate(
        [np.full(len(r.force), goal) for r, goal in zip(records, (0.35, 0.7), strict=True)]
    )

    def residual(
        p: Array, shape: Callable[..., tuple[Array, Array]], n: int, which: int, soft: bool
    ) -> Array:
        blocks, target = [], []
        for recording, known in zip(records, memory, strict=True):
            assert recording.time is not None
            q, size = recording.displacement, float(np.ptp(recording.force))
            with np.errstate(all="ignore"):
                speed = np.exp(p[n]) * known[which] ** np.exp(p[n + 1])
                clock = (
                    np.diff(recording.time, prepend=recording.time[0])
                    + np.abs(np.diff(q, prepend=q[0])) * speed
                )
                h = in_time(recording.time, q, clock, *shape(p[:n]))
            softened = 1.0 - p[-1] * (1.0 - np.abs(q) / known[2]) if soft else np.ones(len(q))
            blocks.append(np.column_stack([q * softened, q**3 * softened, q**5 * softened, h]) / size)
            target.append(recording.force / size)
        design, wanted = np.vstack(blocks), np.concatenate(target)
        if not np.isfinite(design).all():
            return np.full(len(wanted), 1e3)
        return np.asarray((design @ np.linalg.lstsq(design, wanted, rcond=None)[0] - wanted) / scale)

    yield "| spectrum | amplitude | first-loop softening | constants | slow | fast |"
    yield "| --- | --- | --- | --- | --- | --- |"
    firsts = {
        "power law": [4.5, math.log(10.0), 0.2],
        "modified power law": [2.7, -0.2],
        "Cole-Cole": [0.0, 0.0],
    }
    for name, (shape, _) in SPECTRA.items():
        for which, of in enumerate(("since the last reversal", "of the range so far")):
            for soft in (False, True):
                n = len(firsts[name])
                start = [*firsts[name], -1.0, 0.1, *([0.05] if soft else [])]
                fit = least_squares(residual, start, max_nfev=25, x_scale="jac", args=(shape, n, which, soft))
                left, count = fit.fun * scale, len(records[0].force)
                rms = [100.0 * math.sqrt(float(np.mean(part**2))) for part in (left[:count], left[count:])]
                constants = 1 + len(start)
                said = "yes" if soft else "no"
                yield f"| {name} | {of} | {said} | {constants} | {rms[0]:.3f} | {rms[1]:.3f} |"


def relax(file: str) -> Iterator[str]:
    """Yield the misfit of a spectrum to frequency sweeps, and of frequency -> relaxation -> frequency."""
    table = read_dynamic(DynamicSource("uniaxial", (Path(file),), "sweeps"))
    for lag in (False, True):
        fit = fit_spectrum(table, lag=lag)
        spectrum = fit.spectrum
        times = np.geomspace(spectrum.times.min(), spectrum.times.max(), 400)
        back = relaxation_spectrum(times, spectrum.relaxation(times))
        omega = 2.0 * np.pi * table.frequency
        own = omega * 10.0 ** np.interp(table.temperature, fit.temperatures, fit.shifts)
        again = back.at(own) * np.exp(1j * omega * fit.lag)
        miss = [100.0 * math.sqrt(float(np.mean((a / b - 1.0) ** 2))) for a, b in
                ((again.real, table.storage), (again.imag, table.loss))]  # fmt: skip
        yield (
            f"lag {1e6 * fit.lag:.1f} +- {1e6 * fit.lag_error:.1f} us, {len(spectrum.times)} terms: "
            f"storage {fit.storage_percent:.1f} %, loss {fit.loss_percent:.1f} %; "
            f"back from the relaxation {miss[0]:.1f} %, {miss[1]:.1f} %"
        )


if __name__ == "__main__":
    for line in {"sweep": sweep, "heated": heated, "loops": loops, "relax": relax}[sys.argv[1]](
        *sys.argv[2:]
    ):
        print(line, flush=True)
