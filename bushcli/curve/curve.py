"""Curve: generalised force over generalised displacement (and time), recorded or simulated.

Two stiffnesses are defined here, in the same way for coarse noise-free and for dense noisy cyclic curves:

- *initial stiffness*: slope at zero displacement of the first loading branch that comes near zero: within 15 % of
  the largest displacement or across it, else within 60 %; a recording without one has none. Polynomials
  Q = Q0 + k q + c q^3 + d q^5 (bushing modes: an odd response with an offset) or Q0 + k q + c q^2 + d q^3 (coupons)
  of one to three terms besides Q0 are fitted, with Huber's weights against outliers, to the points within 15, 25, 40
  and 60 % of the largest displacement (a coupon's only to those within 15 %: it is stretched too far for curvature to
  be distinguished from noise) and at least 5 of them (4 of a simulated program). Of a simulated coupon up to five terms
  of the logarithm of the stretch are fitted to at least 6 points. The k of least error counts: its
  standard error and, in quadrature, the largest change that a further term makes; of the last term the change that
  a geometric series of the terms would leave. A curve whose least error is above 10 % (5 % of a simulated program,
  whose steps can be made smaller; both are judgement) has no initial stiffness.
- *secant stiffness*: peak to peak, (Q(q_max) - Q(q_min)) / (q_max - q_min). Each end is the mean over
  the points within 1 % of the range from it, so that it does not depend on a single noisy sample; where a loop is open,
  loading and unloading points near the end are averaged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.noise import median_deviation, noise_of_sparse
from bushcli.curve.segment import Segment, displacement_noise, per_sample, segment
from cases.mode import modes

Array = NDArray[np.float64]

_WINDOWS = (0.15, 0.25, 0.4, 0.6)
_END = 0.01
#: Share of the range below which two displacements count as equal.
SMALLEST_STEP = 1e-9
_HUBER = 1.345  # 95 % efficient for normal noise: Huber (1981), Robust Statistics, doi:10.1002/0471725250


@dataclass(frozen=True)
class Curve:
    """Force over displacement in the order of the program.

    Attributes
    ----------
    mode : str
        Name of the deformation mode.
    displacement : (n,) array
        mm or rad; stretch - 1 for a coupon. n >= 2.
    force : (n,) array
        N or N mm; nominal stress in MPa for a coupon.
    time : (n,) array, optional
        s.

    The arrays are read-only copies of finite numbers.
    """

    #: Least number of points for the initial stiffness, and its largest error.
    fewest: ClassVar[int] = 5
    largest_error: ClassVar[float] = 0.1
    noisy: ClassVar[bool] = True

    mode: str
    displacement: Array
    force: Array
    time: Array | None = None

    def __post_init__(self) -> None:
        for name in ("displacement", "force", "time"):
            value = getattr(self, name)
            if value is None:
                continue
            array = np.array(value, dtype=float)
            if array.ndim != 1 or len(array) < 2 or len(array) != len(self.displacement):
                raise ValueError(
                    f"curve: {name} has shape {array.shape}; equal lengths of 2 or more are needed"
                )
            if not np.isfinite(array).all():
                raise ValueError(f"curve: {name} has values that are not finite")
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def at(
        self,
        displacement: float | Array,
        method: Literal["cubic", "pchip"] = "cubic",
        tolerance: float = 0.01,
    ) -> Array:
        """Return the force at given displacements, by interpolation.

        Parameters
        ----------
        displacement : float or array
            Same unit as the curve's.
        method : {"cubic", "pchip"}
            A cubic spline is an order more accurate on a computed curve; "pchip" never overshoots, for
            recorded curves.
        tolerance : float
            Distance beyond the ends, as a fraction of the range, within which the end tangent is followed.

        Returns
        -------
        array
            Same shape as ``displacement``.

        Raises
        ------
        ValueError
            When the curve goes back and forth, or a displacement lies outside its range.
        """
        from scipy.interpolate import CubicSpline, PchipInterpolator  # 0.1 s: only where it is needed

        q, force = self.displacement, self.force
        if q[-1] < q[0]:
            q, force = q[::-1], force[::-1]
        if not (np.diff(q) > 0).all():
            raise ValueError("curve: goes back and forth in displacement; take one branch or its backbone")
        wanted = np.asarray(displacement, dtype=float)
        slack = tolerance * (q[-1] - q[0])
        outside = ~((wanted >= q[0] - slack) & (wanted <= q[-1] + slack))
        if outside.any():
            first = wanted[outside].flat[0]
            raise ValueError(f"curve: {self.mode} at {first:g} is outside the curve ({q[0]:g} to {q[-1]:g})")
        spline = (CubicSpline if method == "cubic" else PchipInterpolator)(q, force)
        inside = np.clip(wanted, q[0], q[-1])
        beyond = wanted - inside
        values = spline(inside)
        return np.asarray(np.where(beyond == 0.0, values, values + spline(inside, 1) * beyond))

    def backbone(self) -> Curve:
        """Return the curve sorted by displacement, for a response that does not depend on the path.

        Points closer than 1e-9 of the range are merged into their mean; time is dropped.
        """
        order = np.argsort(self.displacement, kind="stable")
        q, force = self.displacement[order], self.force[order]
        new = np.concatenate([[True], np.diff(q) > 1e-9 * (q[-1] - q[0])])
        group = np.cumsum(new) - 1
        counts = np.bincount(group)
        merged = np.bincount(group, q) / counts, np.bincount(group, force) / counts
        return Curve(self.mode, *merged)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields only: with values calculated from them, equal curves would be pickled differently."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Loading, unloading and holds, with the numbers of their cycles from 1; see `bushcli.curve.segment`."""
        return segment(self.displacement, self.time, self.displacement_noise)

    @cached_property
    def branches(self) -> tuple[Segment, ...]:
        """The segments, with the numbers of the rig's cycles where it counts them."""
        return self.segments

    @cached_property
    def displacement_noise(self) -> float:
        """Standard deviation of the noise of the displacement, mm or rad."""
        return displacement_noise(self.displacement, self.time)

    @property
    def noise_of_motion(self) -> float:
        """Force that the noise of the displacement makes at the secant stiffness, in its unit; 0 in a hold."""
        noise = self.displacement_noise
        return abs(self.secant_stiffness()) * noise if noise > 0.0 else 0.0

    @cached_property
    def force_noise(self) -> float:
        """Standard deviation of the noise of the force, in its unit; an upper bound where sampling is coarse.

        The force is assumed to be smooth in time within each branch; without time, in displacement where that is
        monotonic, else in the sample number. See `bushcli.curve.noise`.
        """
        q = self.displacement
        steps = np.diff(q)
        if self.time is not None:
            abscissa = self.time
        elif (steps > 0).all() or (steps < 0).all():
            abscissa = q
        else:
            abscissa = np.arange(len(q), dtype=float)
        groups = per_sample(self.branches, range(len(self.branches)))
        return noise_of_sparse(self.force, abscissa, 4, groups)

    def part(self, start: int, stop: int) -> Curve:
        """Return the samples ``start:stop``, such as those of a branch.

        Parameters
        ----------
        start : int
            First sample.
        stop : int
            The sample after the last.
        """
        samples = slice(start, stop)
        time = None if self.time is None else self.time[samples]
        return replace(self, displacement=self.displacement[samples], force=self.force[samples], time=time)

    def initial_stiffness(self) -> float:
        """Return the slope at zero displacement, N/mm, N mm/rad, or MPa for a coupon; the module defines it.

        Returns
        -------
        float
            nan where no loading branch comes near zero or the points near it do not determine the slope.
        """
        return self._initial

    @cached_property
    def _initial(self) -> float:
        # The sample before a branch is the turning point that it starts from.
        loading = [
            slice(max(segment.start - 1, 0), segment.stop)
            for segment in self.segments
            if segment.kind == "loading"
        ]
        largest = float(np.abs(self.displacement).max())
        # A branch far from zero would be extrapolated to it: one that has points in the smallest window is better.
        samples = next(
            (
                c
                for window in (_WINDOWS[0], _WINDOWS[-1])
                for c in loading or [slice(None)]
                if self._distance(c) <= window * largest
            ),
            None,
        )
        if samples is None:
            return float("nan")
        q, force = self.displacement[samples], self.force[samples]
        mode = modes().get(self.mode)
        coupon = mode if mode is not None and mode.specimen == "coupon" else None
        powers: tuple[int, ...] = (2, 3) if coupon else (3, 5)
        fewest = self.fewest
        if coupon and not self.noisy:
            # Stresses are sums of powers of the stretch, exponentials of its logarithm, of which a polynomial is near:
            # ten steps of a planar Gent coupon to a stretch of 2.5 have the slope within 0.04 % in place of 2.8 %.
            q = q if coupon.sheared else np.log1p(q)
            largest, powers, fewest = float(np.abs(q).max()), (2, 3, 4, 5), 6
        distance = np.sort(np.abs(q))
        noise = float(np.nan_to_num(np.hypot(self.force_noise, self.noise_of_motion))) if self.noisy else 0.0
        least, slope = self.largest_error, float("nan")
        for window in _WINDOWS[:1] if coupon else _WINDOWS:
            reach = max(window * largest, float(distance[:fewest][-1]))
            near = np.abs(q) <= reach
            x = np.asarray(q[near] / reach)
            counts = range(1, min(len(np.unique(x)), 2 + len(powers)))
            fits = [_slope(x, force[near], powers[: count - 1], noise) for count in counts]
            for error, k in _errors(fits):
                if error <= least * abs(k):
                    # A curve without force has slope and error zero.
                    least, slope = error / abs(k) if k else 0.0, k / reach
        return slope

    def _distance(self, cut: slice) -> float:
        """Return how near the samples of a branch come to zero displacement; 0 where they cross it."""
        low, high = float(self.displacement[cut].min()), float(self.displacement[cut].max())
        return max(low, -high, 0.0)

    def secant_stiffness(self) -> float:
        """Return the peak-to-peak stiffness, N/mm, N mm/rad, or MPa for a coupon; the module defines it.

        Returns
        -------
        float
            nan where the displacement does not change.
        """
        low, high = float(self.displacement.min()), float(self.displacement.max())
        if low == high:
            return float("nan")
        near_low = self.displacement <= low + _END * (high - low)
        near_high = self.displacement >= high - _END * (high - low)
        rise = self.force[near_high].mean() - self.force[near_low].mean()
        return float(rise / (self.displacement[near_high].mean() - self.displacement[near_low].mean()))


class ExactCurve(Curve):
    """A simulated curve: its points have no noise, so that those next to rest determine its slope there."""

    fewest: ClassVar[int] = 4
    largest_error: ClassVar[float] = 0.05
    noisy: ClassVar[bool] = False


def _slope(x: Array, values: Array, powers: Sequence[int], noise: float) -> tuple[float, float]:
    """Return k of ``values = a + k x + c x**power``, a term for each power, by Huber's M-estimate, and its error."""
    matrix = np.column_stack([np.ones_like(x), x, *(x**power for power in powers)])
    solution = np.linalg.lstsq(matrix, values, rcond=None)[0]
    free = len(x) - matrix.shape[1]
    scale = 0.0
    for _ in range(20):
        residuals = values - matrix @ solution
        # Corrected for the number of fitted terms: any curve can make three of five residuals small.
        scale = median_deviation(np.abs(residuals)) * np.sqrt(len(x) / max(free, 1))
        if scale <= 1e-12 * float(np.abs(values).max()):
            break
        weights = np.sqrt(np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(residuals), 1e-300)))
        solution = np.linalg.lstsq(matrix * weights[:, None], values * weights, rcond=None)[0]
    # A few residuals say little of the noise.
    scale = max(scale, noise) if free > 3 else noise
    return float(solution[1]), scale * float(np.sqrt(np.linalg.pinv(matrix.T @ matrix)[1, 1]))


def _errors(fits: list[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Yield the error of each slope, and the slope; ``fits`` are slopes with standard errors, by number of terms."""
    slopes = [slope for slope, _ in fits]
    terms = np.abs(np.diff(slopes, prepend=0.0))
    for i, (slope, error) in enumerate(fits):
        if i + 1 < len(fits):
            left_out = max(abs(slope - more) for more in slopes[i + 1 :])
        else:
            # Nothing shows what the line through two points leaves out.
            left_out = terms[-1] * min(terms[-1] / max(terms[-2], 1e-300), 1.0) if i else 0.0
        yield float(np.hypot(left_out, error)), slope
