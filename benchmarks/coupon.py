"""What one-dimensional laws of filled rubber leave of a coupon in tension and compression, with how many constants.

``python -m benchmarks.coupon FILE... held:FILE``: recordings with time, stretch and nominal stress, each of equal
weight; those after "held:" are predicted. The
files are not part of the project; `payne.md` has what was measured. The rubber is incompressible; the branches are
those of `forms.branches`, and moduli, all at least zero, are the linear part of the fit. A second table has the rise of
the stress in each ramp between two holds and in each hold, measured and by the laws in bold type.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls
from scipy.special import erf

from bushcli.recording import read_recording
from bushcli.recording.source import Source
from forms.branches.payne import spectrum

Array = NDArray[np.float64]

# Every third sample is used; random starts of each fit; what counts as a hold, s.
THIN, STARTS, LONG = 3, 6, 100.0


@dataclass(frozen=True)
class Tension:
    """A recording: stretch, durations of the steps (s) and nominal stress (MPa), shape (n,) each."""

    stretch: Array
    duration: Array
    stress: Array

    @property
    def first(self) -> Array:
        """I1 - 3."""
        return np.asarray(self.stretch**2 + 2.0 / self.stretch - 3.0)

    def elastic(self, second: bool) -> Array:
        """Stresses of the terms of Yeoh's law and, where wanted, of I2 - 3, shape (n, terms)."""
        strain = 2.0 * (self.stretch - self.stretch**-2)
        terms = [strain, 2.0 * strain * self.first, 3.0 * strain * self.first**2, strain / self.stretch]
        return np.column_stack(terms[: 4 if second else 3])

    def branches(self, times: Array, path: Array) -> Array:
        """Stresses (m, n, k) of branches of unit modulus, by the step of `forms.branches.maxwell`, with exponent 0.

        Parameters
        ----------
        times : shape (m, k)
            Relaxation times of m rubbers, s.
        path : shape (m, 1)
            Clock's time per shear strain, s.
        """
        squares = self.stretch**2
        ratio = squares[1:] / squares[:-1]
        # The distance of two strains in `forms.branches.payne`.
        way = np.sqrt(np.maximum((ratio + 1.0 / ratio) / 2.0 + ratio**0.5 + ratio**-0.5 - 3.0, 0.0))
        ci, out = np.ones_like(times), np.zeros((len(squares), *times.shape))
        for i in range(len(way)):
            before, after = squares[i], squares[i + 1]
            k = np.maximum((before / ci + 2.0 * np.sqrt(ci / before)) / 3.0, 1.0)
            y = np.maximum(k * (self.duration[i + 1] + path * way[i]) / times, 1e-6)
            decay = np.exp(-y)
            begin, end = (1.0 - (1.0 + y) * decay) / y / k, (y - 1.0 + decay) / y / k
            along = decay * ci + begin * before + end * after
            across = decay / np.sqrt(ci) + begin / math.sqrt(before) + end / math.sqrt(after)
            ci = along / np.cbrt(along * across**2)
            out[i + 1] = self.stretch[i + 1] / ci - np.sqrt(ci) / after
        return np.moveaxis(out, 0, 1)

    def slider(self, slip: Array) -> Array:
        """Stress (m, n, 1) of springs of unit modulus that slip at these shear strains (m,)."""
        most, rest, elastic = slip / math.sqrt(3.0), np.zeros(len(slip)), []
        for now in np.log(self.stretch):
            rest = np.clip(rest, now - most, now + most)
            elastic.append(now - rest)
        strain = np.array(elastic).T
        return np.asarray((np.exp(2.0 * strain) - np.exp(-strain)) / self.stretch)[..., None]

    def payne(self, p: Array) -> Array:
        """Stress (m, n, 1) of the spectrum of `payne`: ln tau, decades, slope, ln path; g = 1."""
        moduli, times = zip(*(spectrum(1.0, math.exp(row[0]), row[1], row[2]) for row in p), strict=True)
        return np.einsum("mnk,mk->mn", self.branches(np.array(times), np.exp(p[:, 3:4])), moduli)[..., None]

    def softening(self, p: Array) -> Array:
        """Factor (m, n, 1) of Ogden and Roxburgh's law, of I1 - 3 in place of the energy: 1/r and ln of the width."""
        below = np.maximum.accumulate(self.first) - self.first
        return (1.0 - p[:, :1] * erf(below / np.exp(p[:, 1:2])))[..., None]


def maxwell(r: Tension, times: Array) -> Array:
    """Stresses (m, n, k) of branches at ln times (m, k), on the real time."""
    return r.branches(np.exp(times), np.zeros((len(times), 1)))


Part = Callable[[Tension, Array, Array], list[Array]]
#: Parts of the stress at constants (m, .) and the elastic one: number of constants, blocks (m, n, columns), starts.
LAWS: dict[str, tuple[int, Part, list[float]]] = {
    "friction, two Maxwell branches": (
        6,
        lambda r, p, e: [e, r.slider(np.exp(p[:, 0])), maxwell(r, p[:, 1:])],
        [-1.0, 4.0, 8.0],
    ),
    "three Maxwell branches": (6, lambda r, p, e: [e, maxwell(r, p)], [1.0, 5.0, 9.0]),
    "**payne**": (5, lambda r, p, e: [e, r.payne(p)], [11.0, 12.0, -0.1, 2.0]),
    "payne, stiffer by (I1/3)^0.5": (
        5,
        lambda r, p, e: [e, np.sqrt(1.0 + r.first / 3.0)[:, None] * r.payne(p)],
        [11.0, 12.0, -0.1, 2.0],
    ),
    "**payne, a Maxwell branch**": (
        7,
        lambda r, p, e: [e, r.payne(p), maxwell(r, p[:, 4:])],
        [6.5, 6.0, 0.0, 1.0, 10.0],
    ),
    "payne, mullins": (
        7,
        lambda r, p, e: [e * r.softening(p[:, 4:]), r.payne(p)],
        [11.0, 12.0, -0.1, 2.0, 0.05, -4.0],
    ),
}


@dataclass(frozen=True)
class Search:
    """A law, recordings of equal weight, and whether I2 - 3 is a term of the elastic part."""

    law: Part
    records: list[Tension]
    second: bool

    def design(self, r: Tension, p: Array) -> Array:
        """Stresses of all parts in units of the recording's misfit at constants (m, .), shape (m, n, columns)."""
        elastic = r.elastic(self.second)
        with np.errstate(all="ignore"):
            blocks = self.law(r, p, np.broadcast_to(elastic, (len(p), *elastic.shape)))
        return np.concatenate(blocks, axis=2) / np.ptp(r.stress) / math.sqrt(len(r.stress))

    def moduli(self, design: Array) -> tuple[Array, Array]:
        """Best moduli, of branches at least zero and of the law's terms of either sign, and the misfit (rows,)."""
        free = 4 if self.second else 3
        target = np.concatenate(
            [r.stress / np.ptp(r.stress) / math.sqrt(len(r.stress)) for r in self.records]
        )
        if not np.isfinite(design).all():
            return np.zeros(design.shape[1]), np.full(len(target), 0.1)
        basis, triangle = np.linalg.qr(design[:, :free])
        rest, left = (v - basis @ (basis.T @ v) for v in (design[:, free:], target))
        branches, _ = nnls(rest, left)
        terms = np.linalg.solve(triangle, basis.T @ (target - design[:, free:] @ branches))
        return np.append(terms, branches), rest @ branches - left

    def residual(self, p: Array) -> Array:
        """Misfit at constants (m, .), shape (m, rows)."""
        designs = np.concatenate([self.design(r, p) for r in self.records], axis=1)
        return np.array([self.moduli(design)[1] for design in designs])

    def misfit(self, p: Array, r: Tension) -> Array:
        """Computed minus recorded stress of a recording, fitted or not, in units of its range over the root of n."""
        (design,) = np.concatenate([self.design(record, p[None]) for record in self.records], axis=1)
        (own,) = self.design(r, p[None])
        return np.asarray(
            own @ self.moduli(design)[0] - r.stress / np.ptp(r.stress) / math.sqrt(len(r.stress))
        )

    def slopes(self, p: Array) -> Array:
        """Derivatives of the misfit (rows, .), by differences that are computed at once."""
        steps = 1e-4 * np.maximum(np.abs(p), 0.1)
        at, *moved = self.residual(np.vstack([p, p + np.diag(steps)]))
        return np.asarray((np.array(moved) - at).T / steps)

    def best(self, start: Array) -> Array:
        """Return the constants that are not moduli."""
        random = np.random.default_rng(0)
        starts = [start + k * random.normal(size=len(start)) for k in (0.0, *[1.0] * (STARTS - 1))]
        fits = [
            least_squares(lambda p: self.residual(p[None])[0], p, jac=self.slopes, x_scale="jac", max_nfev=40)
            for p in starts
        ]
        return np.asarray(min(fits, key=lambda fit: float(fit.cost)).x)


def holds(record: Tension, computed: list[Array]) -> Iterator[str]:
    """Yield the rise of the stress in ramps and holds, measured and computed (n,)."""
    still = np.abs(np.diff(record.stretch, append=record.stretch[-1])) < 1e-3
    # A hold lasts from the first of several samples at rest to the last.
    ends = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    before = 0
    for first, last in ends.reshape(-1, 2) - [0, 1]:
        if record.duration[first + 1 : last + 1].sum() < LONG:
            continue
        rise = [
            f"{1e3 * (stress[b] - stress[a]):.0f}"
            for a, b in ((before, first), (first, last))
            for stress in (record.stress, *computed)
        ]
        yield f"| {record.stretch[before]:.2f} to {record.stretch[first]:.2f} | {' | '.join(rise)} |"
        before = last


def coupon(*files: str) -> Iterator[str]:
    """Yield what each law leaves of recordings, "held:" before a name predicts it, and what becomes of holds."""
    records = {}
    for file in files:
        recording = read_recording(Source("uniaxial", Path(file.removeprefix("held:"))))
        assert recording.time is not None
        time, stretch, stress = (
            v[::THIN] for v in (recording.time, 1.0 + recording.displacement, recording.force)
        )
        records[file] = Tension(stretch, np.diff(time, prepend=time[0]), stress)
    known = [r for file, r in records.items() if not file.startswith("held:")]
    heads = " | ".join(Path(file).stem + " (held out)" * file.startswith("held:") for file in files)
    yield f"| law | constants | {heads} | with I2 - 3: {heads} |"
    yield "| --- " * (2 + 2 * len(files)) + "|"
    shown: dict[str, Array] = {}
    for name, (constants, law, start) in LAWS.items():
        cells = []
        for second in (False, True):
            search = Search(law, known, second)
            p = search.best(np.array(start))
            left = [search.misfit(p, r) for r in records.values()]
            cells += [f"{100.0 * np.linalg.norm(misfit):.2f}" for misfit in left]
            if name.startswith("**") and not second:
                shown[name] = np.concatenate(left)
        yield f"| {name} | {constants} | {' | '.join(cells)} |"
    sizes = np.cumsum([len(r.stress) for r in records.values()])[:-1]
    for k, (file, r) in enumerate(records.items()):
        scale = np.ptp(r.stress) * math.sqrt(len(r.stress))
        computed = [r.stress + scale * np.split(misfit, sizes)[k] for misfit in shown.values()]
        if rows := list(holds(r, computed)):
            yield f"{Path(file).stem}, kPa: measured, {', '.join(shown)} in a ramp, and the same in the hold"
            yield from rows


if __name__ == "__main__":
    for line in coupon(*sys.argv[1:]):
        print(line, flush=True)
