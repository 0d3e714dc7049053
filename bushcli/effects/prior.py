"""Knowledge of a parameter before any recording: one prior per parameter of an effect, with its source.

A prior may be relative to the test at hand: a gap scales with the travel, a relaxation time with the duration of the
recording. `Scales` holds what priors are relative to.

Amplitudes have a Student's t prior: its numbers are judged from few cases, and the thin tails of a normal would rule
out a rig or an assembly that is outside all experience. What is confined to something that the test shows, such as a
zero within the travel, has a normal prior.

References
----------
Gelman (2006), Prior distributions for variance parameters, Bayesian Anal. 1:515-534, doi:10.1214/06-BA117A
(half-t priors of amplitudes).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Shape = Literal["half_t", "t", "normal", "log_normal", "log_uniform", "choice"]
Of = Literal[
    "",
    "duration",
    "interval",
    "travel",
    "force",
    "stiffness",
    "compliance",
    "thickness",
    "length",
    "thickness/length",
    "shear",
    "1/shear",
    "1/force",
    "1/duration",
    "force/duration",
    "squared arm",
]
Scales = Mapping[str, float]
"""Quantities to which priors are relative, by name: duration and interval between samples (s), largest travel (mm or
rad), largest force (N or N mm), their quotient (stiffness) and its reciprocal (compliance), thickness and length of
the rubber (mm), shear modulus (MPa). For an effect on several channels they are the stiffest channel's. "1/shear",
"1/force", "1/duration", "force/duration" and "thickness/length" are quotients of them; "squared arm" is the square of
the rubber's outer radius (mm^2) in rotational modes, 1 in others."""

# A log-uniform prior has normal tails beyond its ends: standard deviation in the logarithm.
TAIL = 0.5
# Degrees of freedom of Student's t: the smallest whole number for which it has a variance.
FREEDOM = 3.0
# Quantile of 97.5 % of the standard normal and of Student's t, and the probability beyond it.
QUANTILE = 1.959964
QUANTILE_OF_T = 3.182446
_OUTSIDE = 0.025
# Logarithm of the density of Student's t at its centre, times its scale: 2 / (pi sqrt 3).
_PEAK = math.log(2.0 / (math.pi * math.sqrt(FREEDOM)))


@dataclass(frozen=True)
class Prior:
    """Prior density of one parameter.

    Attributes
    ----------
    shape : {"half_t", "t", "normal", "log_normal", "log_uniform", "choice"}
        A half-t is for amplitudes that cannot be negative, a t and a normal for those of either sign, all about zero.
        A log-normal or log-uniform parameter is positive; where `signed`, its absolute value has this prior, and both
        signs are equally probable. A choice is one of the numbers 0, 1, 2, ..., all equally probable.
    low : float
        Standard deviation of a normal, for a (half-)t that of the normal with the same 95 % range; median of a
        log-normal; lower end of a log-uniform; number of choices.
    high : float
        Standard deviation of the natural logarithm of a log-normal; upper end of a log-uniform.
    of : str
        What `low` (and `high` of a log-uniform) is relative to; nothing where empty.
    source : str
        Where the numbers come from.
    signed : bool
    unrested : float
        In place of `low` if no recording shows the bushing without load; 0 where that does not matter.
    """

    shape: Shape
    low: float
    high: float = 0.0
    of: Of = ""
    source: str = ""
    signed: bool = False
    unrested: float = 0.0

    def __post_init__(self) -> None:
        needs_high = self.shape in ("log_normal", "log_uniform")
        if self.low <= 0.0 or (needs_high and self.high <= 0.0):
            raise ValueError(f"prior {self}: scales must be positive")
        if self.shape == "log_uniform" and self.high <= self.low:
            raise ValueError(f"prior {self}: the upper end is not above the lower one")

    @property
    def is_logarithmic(self) -> bool:
        """Whether the prior is defined on the logarithm of the parameter."""
        return self.shape in ("log_normal", "log_uniform")

    def unit(self, scales: Scales) -> float:
        """Return the factor from the prior's numbers to the unit of the parameter."""
        if not self.of:
            return 1.0
        above, _, below = self.of.partition("/")
        return (1.0 if above == "1" else float(scales[above])) / (float(scales[below]) if below else 1.0)

    def log_density(self, value: float, scales: Scales) -> float:
        """Return the natural logarithm of the density per unit of the parameter; -inf where the density is zero.

        For a choice it is the logarithm of the probability.

        Parameters
        ----------
        value : float
            In the unit of the parameter (N, mm, MPa, s, rad); of a choice its index.
        scales : Scales
        """
        if self.shape == "choice":
            return -math.log(self.low) if value in range(round(self.low)) else -math.inf
        unit = self.unit(scales)
        x = value / unit
        if not self.is_logarithmic:
            if self.shape == "half_t" and x < 0.0:
                return -math.inf
            double = math.log(2.0) if self.shape == "half_t" else 0.0
            peak = -0.5 * math.log(2.0 * math.pi) if self.shape == "normal" else _PEAK
            return double + peak - 0.5 * self._residual(x) ** 2 - math.log(self._scale * unit)
        if x == 0.0 or (x < 0.0 and not self.signed):
            return -math.inf
        size = abs(x)
        per_value = -math.log(size * unit) - (math.log(2.0) if self.signed else 0.0)
        if self.shape == "log_normal":
            z = math.log(size / self.low) / self.high
            return per_value - 0.5 * z * z - math.log(self.high) - 0.5 * math.log(2.0 * math.pi)
        beyond = max(0.0, math.log(self.low / size), math.log(size / self.high))
        return per_value - 0.5 * (beyond / TAIL) ** 2 - math.log(self._width())

    def curvature(self, value: float, scales: Scales) -> float:
        """Return the precision of the prior: 1 / variance, per unit of the parameter squared; at least 0.

        For a t it is that of the equivalent least squares: the square of the derivative of `row`.

        Parameters
        ----------
        value : float
            In the unit of the parameter; of a choice its index.
        scales : Scales
        """
        if self.shape == "choice":
            return 0.0
        unit = self.unit(scales)
        if not self.is_logarithmic:
            return self.row(value, scales)[1] ** 2
        if value == 0.0:
            return 0.0
        size = abs(value) / unit
        if self.shape == "log_normal":
            return 1.0 / (self.high * value) ** 2
        inside = self.low <= size <= self.high
        # A uniform density over a width w has the variance w^2 / 12.
        spread = math.log(self.high / self.low) / math.sqrt(12.0) if inside else TAIL
        return 1.0 / (spread * value) ** 2

    def row(self, value: float, scales: Scales) -> tuple[float, float]:
        """Return a residual whose half square is the negative log density up to a constant, and its derivative.

        For a logarithmic prior the density is that of the logarithm.

        Parameters
        ----------
        value : float
            In the unit of the parameter.
        scales : Scales
        """
        unit = self.unit(scales)
        x = value / unit
        if not self.is_logarithmic:
            residual = self._residual(x)
            if residual == 0.0:
                return 0.0, math.sqrt(self.weight(value, scales))
            return residual, self.weight(value, scales) * value / residual
        size = abs(x)
        if size <= 0.0:
            return 0.0, 0.0
        per_value = math.copysign(1.0, value) / unit
        if self.shape == "log_normal":
            return math.log(size / self.low) / self.high, per_value / size / self.high
        end = min(max(size, self.low), self.high)
        return (0.0, 0.0) if size == end else (math.log(size / end) / TAIL, per_value / size / TAIL)

    def weight(self, value: float, scales: Scales) -> float:
        """Return the precision of the zero-mean normal whose log density has the same slope as this (half-)t or normal.

        Parameters
        ----------
        value : float
            In the unit of the parameter.
        scales : Scales
        """
        square = (self._scale * self.unit(scales)) ** 2
        return 1.0 / square if self.shape == "normal" else (FREEDOM + 1.0) / (FREEDOM * square + value**2)

    def _residual(self, x: float) -> float:
        """Return the signed root of twice the fall of the log density of a t or normal from its peak."""
        if self.shape == "normal":
            return x / self.low
        fall = (FREEDOM + 1.0) * math.log1p((x / self._scale) ** 2 / FREEDOM)
        return math.copysign(math.sqrt(fall), x)

    @property
    def _scale(self) -> float:
        """Scale of a normal or t; the 95 % range of a t is that of a normal with the standard deviation `low`."""
        return self.low if self.shape == "normal" else self.low * QUANTILE / QUANTILE_OF_T

    def median(self, scales: Scales) -> float:
        """Return the median; of the absolute value if the prior is signed, a t or a normal."""
        if self.shape == "choice":
            return 0.0
        unit = self.unit(scales)
        if self.shape == "log_normal":
            return self.low * unit
        if self.shape == "log_uniform":
            return math.sqrt(self.low * self.high) * unit
        # Quartiles of the normal and of Student's t of three degrees of freedom.
        return (0.674490 if self.shape == "normal" else 0.764892) * self._scale * unit

    def range(self, scales: Scales) -> tuple[float, float]:
        """Return the 95 % interval; of the absolute value if the prior is signed, of a choice all indices."""
        if self.shape == "choice":
            return 0.0, self.low - 1.0
        unit = self.unit(scales)
        if self.shape == "log_normal":
            factor = math.exp(QUANTILE * self.high)
            return self.low / factor * unit, self.low * factor * unit
        if self.shape == "log_uniform":
            factor = math.exp(self._margin())
            return self.low / factor * unit, self.high * factor * unit
        wide = QUANTILE * self.low * unit
        return 0.0 if self.shape == "half_t" else -wide, wide

    def tail(self, value: float, scales: Scales) -> float:
        """Return the probability of a value at least as far from the centre as this one.

        For a logarithmic prior it is twice the probability of values farther out on the same side of the median. It is
        0.05 at the ends of `range`, for a half-t at its upper end.

        Parameters
        ----------
        value : float
            In the unit of the parameter; of a choice its index.
        scales : Scales
        """
        if self.shape == "choice":
            return 1.0 if value in range(round(self.low)) else 0.0
        unit = self.unit(scales)
        x = value / unit
        if self.shape == "normal":
            return math.erfc(abs(x) / self.low / math.sqrt(2.0))
        if not self.is_logarithmic:
            # Of Student's t with three degrees of freedom.
            z, root = abs(x) / self._scale, math.sqrt(FREEDOM)
            return 1.0 - 2.0 / math.pi * (math.atan(z / root) + z / root / (1.0 + z * z / FREEDOM))
        if x == 0.0 or (x < 0.0 and not self.signed):
            return 0.0
        if self.shape == "log_normal":
            return 1.0 - math.erf(abs(math.log(abs(x) / self.low)) / self.high / math.sqrt(2.0))
        inwards = min(math.log(abs(x) / self.low), math.log(self.high / abs(x)))
        if inwards >= 0.0:
            return 2.0 * (self._beyond() + inwards / self._width())
        return 2.0 * self._beyond() * (1.0 - math.erf(-inwards / TAIL / math.sqrt(2.0)))

    def _width(self) -> float:
        """Return the width of the uniform density as high as a log-uniform prior with its tails, in the logarithm."""
        return math.log(self.high / self.low) + TAIL * math.sqrt(2.0 * math.pi)

    def _beyond(self) -> float:
        """Return the probability of each of the two tails of a log-uniform prior."""
        return 0.5 * TAIL * math.sqrt(2.0 * math.pi) / self._width()

    def _margin(self) -> float:
        """Return how far the 2.5 % quantile of a log-uniform prior lies outside each end, in the logarithm."""
        beyond = self._beyond()
        if beyond <= _OUTSIDE:
            return -(_OUTSIDE - beyond) * self._width()
        from scipy.special import erfinv  # 0.08 s: only a diagnosis asks for it

        return TAIL * math.sqrt(2.0) * float(erfinv(1.0 - _OUTSIDE / beyond))
