"""Where in the rubber the misfit is: a map of where it would have to be stiffer or softer, and whether that is needed.

The derivatives of the curves by the stiffness of each cell (`cases.local`) are columns like those of any parameter;
with a smooth field for unknown (`bushcli.diagnosis.where.field`) they give a map. Debonding shows at one end of a bond,
another batch everywhere. Many fields give the same curve: a single channel mostly tells that the rubber is not
everywhere the same, and several channels together tell where. What they cannot tell is said.

Where no parameter is fitted a factor on all rubber may be large; the curves are then solved again with it, so that
its second order is not taken for a place in the rubber.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

from bushcli.diagnosis.likelihood import calibration
from bushcli.diagnosis.likelihood.linearised import linearised, weighed
from bushcli.diagnosis.likelihood.noise import Compared
from bushcli.diagnosis.where.field import covariance, estimate, uniform, zoned
from bushcli.diagnosis.where.maps import LocalMap
from bushcli.inverse.channel import Channel
from bushcli.recording import matching
from bushcli.recording.curve import Curve
from bushcli.simulate.six_simulation import Reaction
from cases import local
from cases.local import Cells, Local
from cases.program import Program
from geometry.shape import Mirrors, Shape

Array = NDArray[np.float64]

# A local change is said to help where noise would make as much of it in less than one recording of a hundred.
LEVEL = 0.01
# And where it takes away more of the squared misfit than a uniform one by this share, a thirtieth of the misfit itself:
# less may well be of a place, but of one that nobody asks for.
MATTERS = 1e-3
# Places are told apart where their sums of squares differ by this many variances of the noise: odds of 20 to 1.
APART = 6.0
# A larger uniform factor is solved for, so often at most.
LARGE, REPEATS = 0.02, 3


@dataclass(frozen=True)
class Seen:
    """What a channel has to say.

    Attributes
    ----------
    compared : Compared
    jacobian : shape (n, p)
        Of the simulated force by the fitted parameters.
    slope : shape (n, m)
        Of it by the stiffness of its own cells.
    cells : Cells
    mirrors : frozenset of {"x", "y", "z"}
        Planes at which its mesh is cut.
    shared : float
        Standard deviation of a factor that all its forces share (`weighing`).
    """

    compared: Compared
    jacobian: Array
    slope: Array
    cells: Cells
    mirrors: Mirrors
    shared: float


@dataclass(frozen=True)
class Gains:
    """Weighted sums of squares: of the misfit, with the best uniform factor, and with the map."""

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
    """Where in the rubber a change of stiffness would help all of these channels together.

    The map is drawn on the mesh that shows most of the rubber; on a half-plane it is the same all round the axis.

    Parameters
    ----------
    channels : sequence of Channel
        Of one bushing.
    problem_parameters : mapping
        All of the law's, and "compliance" where it is not the case's.
    compared : sequence of Compared
        Recorded force beside that simulated with these parameters, of each channel.
    jacobians : sequence of arrays, shape (n, p) each
        Of the simulated force by the fitted parameters; (n, 0) with a law that is held.
    notify : callable
        Called with each channel's name before it is solved.

    Raises
    ------
    ValueError
        A channel is a coupon test: its deformation is the same everywhere.
    NotConverged
    """

    def slopes_of(given: Mapping[str, float]) -> list[tuple[Array, Cells]]:
        found = []
        for channel in channels:
            notify(channel.name)
            found.append(_slopes(channel, given))
        return found

    if any(channel.coupon for channel in channels):
        raise ValueError("a coupon has no place where its rubber could differ: maps are of bushings")
    parameters, scale, before = dict(problem_parameters), 1.0, 0.0
    held = not any(jacobian.shape[1] for jacobian in jacobians)
    shape, linear = channels[0].model.mesh.shape, channels[0].model.law.linear
    for repeat in range(REPEATS + 1):
        seen = [
            Seen(one, jacobian, *slope, channel.model.mesh.mirrors, calibration.factor_of(channel))
            for channel, one, jacobian, slope in zip(
                channels, compared, jacobians, slopes_of(parameters), strict=True
            )
        ]
        combined = Combined(seen, shape)
        before = before or combined.gains.before
        if not held or not LARGE <= abs(combined.uniform) < 0.9 or repeat == REPEATS:
            break
        factor = 1.0 + combined.uniform
        scale *= factor
        parameters |= {name: factor * value for name, value in parameters.items() if name in linear}
        compared = [
            replace(one, simulated=np.where(one.known, _force(channel, parameters), np.nan))
            for channel, one in zip(channels, compared, strict=True)
        ]
    return combined.map(replace(combined.gains, before=before), scale)


# -- the channels ----------------------------------------------------------------------------------------------------


def _slopes(channel: Channel, parameters: Mapping[str, float]) -> tuple[Array, Cells]:
    """Derivatives (n, m) of a channel's force at its samples by its cells' factors, and the cells."""
    model, simulation = channel.model, channel.simulation
    model.set_parameters({k: v for k, v in parameters.items() if k in model.constants})
    if isinstance(simulation, Reaction):
        return simulation.local()
    if simulation is None or not simulation.path_dependent:
        found = local.swept(model, channel.targets)
        return _interpolated(found, channel), found.cells
    # The rig's part in the curve is left out: it does not change which cells carry the force.
    steps, q = simulation.steps, simulation.displacement
    found = local.marched(model, Program(steps.displacement, steps.time if steps.timed else None))
    whole = Curve(channel.recording.mode, q, q, simulation.time)
    clock = np.arange(len(q), dtype=float) if simulation.time is None else simulation.time
    return steps.interpolation(clock[matching(whole, channel.recording)]) @ found.slope, found.cells


def _interpolated(found: Local, channel: Channel) -> Array:
    q, slope = found.history.displacement, found.slope
    if channel.odd:
        # Mirrored halves of the rubber change places with the sign of the load.
        slope = np.concatenate([slope, -slope[:, _reflected(found.cells, channel)]])
        q, first = np.unique(np.concatenate([q, -q]), return_index=True)
        slope = slope[first]
    return np.asarray(CubicSpline(q, slope)(channel.recording.displacement))


def _reflected(cells: Cells, channel: Channel) -> NDArray[np.intp]:
    """Which cell is the image of each in the plane that reverses the load."""
    plane, dimension = channel.model.mode.reversed_by, cells.points.shape[1]
    if plane is None or (dimension == 2 and plane != "z"):
        return np.arange(len(cells.volume))
    image = cells.centres.copy()
    image[:, dimension - 1 if plane == "z" else "xy".index(plane)] *= -1.0
    return np.asarray(KDTree(cells.centres).query(image)[1])


def _force(channel: Channel, parameters: Mapping[str, float]) -> Array:
    return channel.at_samples(channel.solve(parameters, channel.model.law.linear[:1]))[0]


# -- one field for all of them ---------------------------------------------------------------------------------------


class Combined:
    """All channels on one set of cells: the mesh that is cut at the fewest planes, a half-plane before a solid."""

    def __init__(self, seen: Sequence[Seen], shape: Shape) -> None:
        self.names, self.shape = [one.compared.name for one in seen], shape
        host = min(
            seen, key=lambda one: (one.cells.points.shape[1], len(one.mirrors), -len(one.cells.volume))
        )
        self.cells, self.mirrors = host.cells, host.mirrors
        slopes = [one.slope @ _onto(one.cells, one.mirrors, self.cells, self.mirrors) for one in seen]
        compared, jacobians = [one.compared for one in seen], [one.jacobian for one in seen]
        shared = [one.shared for one in seen]
        self.linear = calibration.linear_fit(compared, shared, jacobians)
        self.slope = calibration.columns(compared, shared, slopes)
        # The same as the samples are, a factor that they share not discounted: what a reader calls the misfit.
        self.plain = linearised(compared, jacobians)
        self.plain_slope = weighed(compared, slopes)
        self.field = estimate(self.linear, self.slope, covariance(self.cells, _thickness(self.cells)))
        self.uniform = uniform(self.plain, self.plain_slope)
        self.beside = uniform(self.plain, self.plain_slope, self.field.change)
        self.gains = self._gained()

    def _gained(self) -> Gains:
        """What is left of the misfit when the fitted parameters are free to follow."""

        def left(change: Array | float) -> float:
            along = self.plain_slope @ np.broadcast_to(change, len(self.cells.volume))
            found = self.plain.rest + self.plain.left(along)
            return float(found @ found)

        return Gains(left(0.0), left(self.uniform), left(self.beside + self.field.change))

    def map(self, gains: Gains, scale: float) -> LocalMap:
        """The map, in figures and words, of rubber whose stiffness was first multiplied by `scale`."""
        total = gains.before or 1.0
        helps = self.field.p < LEVEL and gains.uniform - gains.local > MATTERS * total
        texts = [self._gains(gains, scale, helps), self._place() if helps else "", self._part()]
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
        everywhere, somewhere = (
            _percent(1.0 - left / (gains.before or 1.0)) for left in (gains.uniform, gains.local)
        )
        whole = scale * (1.0 + self.uniform)
        factor = f" ({whole:.3g} on all rubber)" if abs(whole - 1.0) > 1e-3 else ""
        if helps:
            return (
                f"A local change of stiffness takes away {somewhere} of the squared misfit, the best uniform "
                f"one{factor} {everywhere}: if the rubber is to blame, it is not everywhere the same "
                f"(p {_chance(self.field.p)})."
            )
        if self.field.p < LEVEL:
            return (
                f"The best uniform change of stiffness{factor} takes away {everywhere} of the squared misfit, a local "
                "one hardly more: these recordings tell of no place in the rubber."
            )
        return (
            f"A local change of stiffness does not help significantly more than a uniform one{factor}, which takes "
            f"away {everywhere} of the squared misfit (p {_chance(self.field.p)}): these recordings tell of no place "
            "in the rubber."
        )

    def _place(self) -> str:
        labels, members = _zones(self.cells, self.mirrors, self.shape)
        zones = zoned(self.linear, self.slope, members)
        order = np.argsort(-zones.drop)
        near = zones.drop[order] > zones.drop[order[0]] - APART * zones.variance
        alike = order[near]
        said = [f"{_change(zones.change[i])} {labels[i]}" for i in alike]
        if len(alike) > len(labels) / 2:
            return f"Where cannot be told from these recordings: {len(alike)} of {len(labels)} places serve as well."
        if len(alike) > 1:
            return f"To first order it would be {said[0]}; these recordings do not tell it from {', '.join(said[1:])}."
        return f"To first order it would be {said[0]}."

    def _part(self) -> str:
        if not self.mirrors:
            return ""
        planes = " and ".join(f"{plane} = 0" for plane in sorted(self.mirrors))
        return (
            f"The mesh is cut at {planes}: what lies beyond is the mirror image, and cannot be told from it."
        )


def _onto(cells: Cells, mirrors: Mirrors, host: Cells, cut: Mirrors) -> Array:
    """Matrix (own cells, host's): the mean over each own cell, and its mirror images, of a field on the host's."""
    flat = host.points.shape[1] == 2
    own, other = (_place_of(c, flat, mirrors | cut) for c in (cells, host))
    # Cells one behind the other, round the axis or in the images, are one.
    size = 1e-6 * float(np.ptp(host.points, axis=0).max())
    groups, member = np.unique(np.round(own / size), axis=0, return_inverse=True)
    tree = KDTree(groups * size)
    weight = np.zeros((len(groups), len(host.volume)))
    weight[tree.query(other)[1], np.arange(len(host.volume))] = host.volume
    # A host with larger cells than the channel's.
    empty = np.flatnonzero(weight.sum(axis=1) == 0)
    weight[empty, KDTree(other).query(groups[empty] * size)[1]] = 1.0
    return np.asarray((weight / weight.sum(axis=1, keepdims=True))[member.ravel()])


def _place_of(cells: Cells, flat: bool, mirrors: Mirrors) -> Array:
    """Centres of the cells, (R, Z) or (x, y, z), with all images folded into one."""
    # The mean radius of the corners: that of their mean would change with the angle that a cell takes.
    centres = (_section(cells.points) if flat else cells.points)[cells.corners].mean(axis=1)
    names = "rz" if flat else "xyz"
    for plane in mirrors & set(names):
        centres[:, names.index(plane)] = np.abs(centres[:, names.index(plane)])
    return np.asarray(centres)


def _section(points: Array) -> Array:
    """(R, Z) of points in the half-plane or in space."""
    return np.column_stack([np.linalg.norm(points[:, :-1], axis=1), points[:, -1]])


# -- words -----------------------------------------------------------------------------------------------------------


def _thickness(cells: Cells) -> float:
    """Of the rubber across, mm."""
    return float(np.ptp(_section(cells.points)[:, 0]))


def _zones(cells: Cells, mirrors: Mirrors, shape: Shape) -> tuple[list[str], Array]:
    """Names of parts of the rubber, and which cells (m, k) belong to each."""
    radius, height = _place_of(cells, True, frozenset()).T
    corners = _section(cells.points)
    across = (radius - corners[:, 0].min()) / _thickness(cells)
    end = float(np.abs(corners[:, 1]).max())
    bonded = shape.wall is not None
    inside, between, outside = (
        ("near the inner bond", "between the bonds", "near the outer bond")
        if bonded
        else ("near the bore", "in the middle", "near the flank")
    )
    rings = {
        inside: across < 1 / 3,
        between: (across >= 1 / 3) & (across <= 2 / 3),
        outside: across > 2 / 3,
    }
    if "z" in mirrors:
        parts = {"about mid-length": height < 0.5 * end, "towards the ends": height >= 0.5 * end}
    else:
        third = f"{end / 3:.3g} mm"
        parts = {
            f"at the lower end (z < -{third})": height < -end / 3,
            "about mid-length": np.abs(height) <= end / 3,
            f"at the upper end (z > {third})": height > end / 3,
        }
    pairs = {
        f"{ring} {part}": a & b for ring, a in rings.items() for part, b in parts.items() if (a & b).any()
    }
    return list(pairs), np.array(list(pairs.values()), dtype=float).T


def _change(value: float) -> str:
    """In words, of a change of the logarithm of the stiffness."""
    return f"{100 * abs(np.expm1(value)):.0f} % {'stiffer' if value > 0 else 'softer'}"


def _percent(share: float) -> str:
    if share < 0.01:
        return "less than 1 %"
    if share > 0.9995:
        return "more than 99.9 %"
    # What is left of a large share is what one wants to know.
    return f"{100 * share:.1f} %" if share > 0.9 else f"{100 * share:.0f} %"


def _chance(p: float) -> str:
    return "< 0.001" if p < 1e-3 else f"= {p:.2g}"
