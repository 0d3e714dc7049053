"""Map where the rubber would have to be stiffer or softer to remove the misfit, and test whether that is needed.

The derivatives of the curves by the stiffness of each cell (`cases.local`) are columns like those of any parameter;
with a smooth field as the unknown (`bushcli.mismatch.field`) they give a map. Debonding appears at one end of a
bond, another batch everywhere. Many fields give the same curve: a single channel usually shows only that the rubber is
not uniform, and several channels together show where. The text says what they cannot show.

If no parameter is fitted, the best uniform factor may be large; the curves are then solved again with this factor, so
that its second-order part is not mistaken for a local change.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.channel import Channel
from bushcli.likelihood import calibration
from bushcli.likelihood.linearisation import linearise, weigh
from bushcli.likelihood.noise import Compared
from bushcli.mismatch.field import covariance, estimate, estimate_zones, uniform
from bushcli.mismatch.maps import LocalMap
from bushcli.mismatch.places import onto, thickness, zones
from cases.local import Cells
from geometry.shape import Mirrors, Shape

Array = NDArray[np.float64]

# A local change is reported to help if noise alone would help as much in less than one recording of a hundred
# (convention), and if it removes this share more of the squared misfit than a uniform change, a thirtieth of the misfit
# itself: a smaller local change may be real, but does not matter.
LEVEL, MATTERS = 0.01, 1e-3
# Places are distinguished if their sums of squares differ by this many variances of the noise: odds of 20 to 1.
APART = 6.0
# Uniform changes larger than this are solved again; largest number of such repetitions. Judgement: the map changes by
# about as much, less than is drawn.
LARGE, REPEATS = 0.02, 3


@dataclass(frozen=True)
class Seen:
    """Data of a channel for the map."""

    compared: Compared
    # Derivatives of the simulated force by the fitted parameters (n, p), and by the stiffness of the cells (n, m).
    jacobian: Array
    slope: Array
    cells: Cells
    # Planes at which its mesh is cut.
    mirrors: Mirrors
    # Standard deviation of the common factor of its forces (`calibration`).
    shared: float


@dataclass(frozen=True)
class Gains:
    """Weighted sums of squares of the misfit: unchanged, with the best uniform factor, and with the map."""

    before: float
    uniform: float
    local: float


def local_map(
    channels: Sequence[Channel],
    problem_parameters: Mapping[str, float],
    compared: Sequence[Compared],
    jacobians: Sequence[Array],
    notify: Callable[[str], None] = lambda channel: None,
) -> LocalMap:
    """Return where in the rubber a change of stiffness would reduce the misfit of all these channels together.

    The map is drawn on the mesh that shows most of the rubber; on a half-plane it is the same all round the axis.

    Parameters
    ----------
    channels : sequence of Channel
        Of one bushing.
    problem_parameters : mapping
        All of the law's (MPa or dimensionless), and "compliance" (1/MPa) if it differs from the case's.
    compared : sequence of Compared
        Recorded force, and force simulated with these parameters, of each channel.
    jacobians : sequence of arrays, shape (n, p) each
        Derivatives of the simulated force by the fitted parameters; (n, 0) with a fixed law.
    notify : callable
        Called with each channel's name before it is solved.

    Raises
    ------
    ValueError
        A channel is a coupon test: its deformation is the same everywhere.
    NotConverged
    """
    if any(channel.coupon for channel in channels):
        raise ValueError("a coupon has no places to tell apart: only bushings have maps")
    parameters, scale, before = dict(problem_parameters), 1.0, 0.0
    held = not any(jacobian.shape[1] for jacobian in jacobians)
    shape, linear = channels[0].model.mesh.shape, channels[0].model.law.linear
    for repeat in range(REPEATS + 1):
        seen = []
        for channel, of_channel, jacobian in zip(channels, compared, jacobians, strict=True):
            notify(channel.name)
            slope, cells = channel.local_slopes(parameters)
            mirrors, shared = channel.model.mesh.mirrors, calibration.factor_of(channel)
            seen.append(Seen(of_channel, jacobian, slope, cells, mirrors, shared))
        combined = Combined(seen, shape)
        before = before or combined.gains.before
        if not held or not LARGE <= abs(combined.uniform) < 0.9 or repeat == REPEATS:
            break
        factor = 1.0 + combined.uniform
        scale *= factor
        parameters |= {name: factor * value for name, value in parameters.items() if name in linear}
        forces = [c.at_samples(c.solve(parameters, c.model.law.linear[:1]))[0] for c in channels]
        compared = [
            replace(of_channel, simulated=np.where(of_channel.known, force, np.nan))
            for force, of_channel in zip(forces, compared, strict=True)
        ]
    return combined.map(replace(combined.gains, before=before), scale)


# -- one field for all of them ---------------------------------------------------------------------------------------


class Combined:
    """All channels on one set of cells: the mesh that is cut at the fewest planes, preferably a half-plane."""

    def __init__(self, seen: Sequence[Seen], shape: Shape) -> None:
        self.names, self.shape = [data.compared.name for data in seen], shape
        host = min(
            seen, key=lambda data: (data.cells.points.shape[1], len(data.mirrors), -len(data.cells.volume))
        )
        self.cells, self.mirrors = host.cells, host.mirrors
        slopes = [data.slope @ onto(data.cells, data.mirrors, self.cells, self.mirrors) for data in seen]
        compared, jacobians = [data.compared for data in seen], [data.jacobian for data in seen]
        shared = [data.shared for data in seen]
        self.linear = calibration.linear_fit(compared, shared, jacobians)
        self.slope = calibration.columns(compared, shared, slopes)
        # The same without allowance for a common factor: what a reader calls the misfit.
        self.plain = linearise(compared, jacobians)
        self.plain_slope = weigh(compared, slopes)
        self.field = estimate(self.linear, self.slope, covariance(self.cells, thickness(self.cells)))
        self.uniform = uniform(self.plain, self.plain_slope)
        self.beside = uniform(self.plain, self.plain_slope, self.field.change)
        self.gains = self._first_order_gains()

    def _first_order_gains(self) -> Gains:
        """Return the remaining misfit after the fitted parameters have been refitted to first order."""

        def left(change: Array | float) -> float:
            along = self.plain_slope @ np.broadcast_to(change, len(self.cells.volume))
            misfit = self.plain.rest + self.plain.left(along)
            return float(misfit @ misfit)

        return Gains(left(0.0), left(self.uniform), left(self.beside + self.field.change))

    def map(self, gains: Gains, scale: float) -> LocalMap:
        """The map, in numbers and words, of rubber whose stiffness has already been multiplied by `scale`."""
        total = gains.before or 1.0
        helps = self.field.p < LEVEL and gains.uniform - gains.local > MATTERS * total
        planes = " and ".join(f"{plane} = 0" for plane in sorted(self.mirrors))
        texts = [self._gains(gains, scale, helps), self._place() if helps else ""]
        if planes:
            texts.append(
                f"The mesh is cut at {planes}: the other half is its mirror image and cannot be distinguished from it."
            )
        return LocalMap(
            channels=tuple(self.names),
            points=self.cells.points,
            cells=self.cells.corners,
            factor=scale * (1.0 + self.beside) * np.exp(self.field.change) - 1.0,
            local_gain=1.0 - gains.local / total,
            uniform_gain=1.0 - gains.uniform / total,
            helps_locally=helps,
            text=" ".join(filter(None, texts)),
        )

    def _gains(self, gains: Gains, scale: float, helps: bool) -> str:
        before = gains.before or 1.0
        everywhere, somewhere = (_percent(1.0 - left / before) for left in (gains.uniform, gains.local))
        whole = scale * (1.0 + self.uniform)
        factor = f" ({whole:.3g} on all rubber)" if abs(whole - 1.0) > 1e-3 else ""
        if helps:
            return (
                f"A local change of stiffness removes {somewhere} of the squared misfit, the best uniform "
                f"change{factor} removes {everywhere}: if the rubber is to blame, it is not the same everywhere "
                f"(p {_chance(self.field.p)})."
            )
        if self.field.p < LEVEL:
            return (
                f"The best uniform change of stiffness{factor} removes {everywhere} of the squared misfit, a local "
                "change hardly more: these recordings do not point to any place in the rubber."
            )
        return (
            f"A local change of stiffness does not help significantly more than a uniform change{factor}, which "
            f"removes {everywhere} of the squared misfit (p {_chance(self.field.p)}): these recordings do not point "
            "to any place in the rubber."
        )

    def _place(self) -> str:
        labels, members = zones(self.cells, self.mirrors, self.shape)
        parts = estimate_zones(self.linear, self.slope, members)
        order = np.argsort(-parts.drop)
        near = parts.drop[order] > parts.drop[order[0]] - APART * parts.variance
        alike = order[near]
        said = [
            f"{100 * abs(np.expm1(value)):.0f} % {'stiffer' if value > 0 else 'softer'} {labels[i]}"
            for i, value in zip(alike, parts.change[alike], strict=True)
        ]
        if len(alike) > len(labels) / 2:
            return (
                f"The place cannot be determined from these recordings: {len(alike)} of {len(labels)} places explain "
                "them equally well."
            )
        if len(alike) > 1:
            return (
                f"To first order the rubber would be {said[0]}; these recordings do not distinguish this from "
                f"{', '.join(said[1:])}."
            )
        return f"To first order the rubber would be {said[0]}."


# -- words -----------------------------------------------------------------------------------------------------------


def _percent(share: float) -> str:
    if share < 0.01:
        return "less than 1 %"
    if share > 0.9995:
        return "more than 99.9 %"
    # For a large share, the remainder is of interest.
    return f"{100 * share:.1f} %" if share > 0.9 else f"{100 * share:.0f} %"


def _chance(p: float) -> str:
    return "< 0.001" if p < 1e-3 else f"= {p:.2g}"
