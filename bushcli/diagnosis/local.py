"""Where in the rubber the misfit is: a map of where it would have to be stiffer or softer, and whether that is needed.

The derivatives of the curves by the stiffness of each cell (`cases.local`) are columns like those of any parameter;
with a smooth field for unknown (`bushcli.diagnosis.field`) they give a map. Debonding shows at one end of a bond,
another batch everywhere. Many fields give the same curve: a single channel mostly tells that the rubber is not
everywhere the same, and several channels together tell where. What they cannot tell is said.

Where no parameter is fitted a factor on all rubber may be large; the curves are then solved again with it, so that
its second order is not taken for a place in the rubber.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

from bushcli.diagnosis import weighing
from bushcli.diagnosis.field import Field, covariance, estimate, zone_drops
from bushcli.diagnosis.noise_model import Compared
from bushcli.diagnosis.result import LocalMap
from bushcli.inverse.channel import Channel
from cases import local
from cases.local import Cells, Local
from cases.program import Program
from geometry.ring import Ring
from geometry.shape import Mirrors, Shape

Array = NDArray[np.float64]

# A local change is said to help where noise would make as much of it in less than one recording of a hundred.
LEVEL = 0.01
# Places are told apart where their sums of squares differ by this many variances of the noise: odds of 20 to 1.
APART = 6.0
# One place is the whole story where it does this share of what the map does beyond a uniform factor.
WHOLE = 0.8
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
    factor : float
        Standard deviation of a factor that all forces share (`weighing`).
    """

    compared: Compared
    jacobian: Array
    slope: Array
    cells: Cells
    mirrors: Mirrors
    factor: float = 0.0


def local_map(
    channel: Channel,
    problem_parameters: Mapping[str, float],
    compared: Compared,
    jacobian: Array,
    factor: float = 0.0,
) -> LocalMap:
    """Where in the rubber a change of stiffness would help one channel.

    Parameters
    ----------
    channel : Channel
        Of a bushing.
    problem_parameters : mapping
        All of the law's, and "compliance" where it is not the case's.
    compared : Compared
        Recorded force beside that simulated with these parameters.
    jacobian : shape (n, p)
        Of the simulated force by the fitted parameters; (n, 0) with a law that is held.
    factor : float
        Standard deviation of a factor that all forces of the channel share.

    Raises
    ------
    ValueError
        The channel is a coupon test: its deformation is the same everywhere.
    NotConverged
    """
    return joint_map([channel], problem_parameters, [compared], [jacobian], [factor])


def joint_map(
    channels: Sequence[Channel],
    problem_parameters: Mapping[str, float],
    compared: Sequence[Compared],
    jacobians: Sequence[Array],
    factors: Sequence[float] | None = None,
) -> LocalMap:
    """Where in the rubber a change of stiffness would help all channels together, each as in `local_map`.

    The map is drawn on the mesh that shows most of the rubber; on a half-plane it is the same all round the axis.
    """
    if any(channel.coupon for channel in channels):
        raise ValueError("a coupon has no place where its rubber could differ: maps are of bushings")
    given = [0.0] * len(channels) if factors is None else list(factors)
    shape, law = channels[0].model.mesh.shape, channels[0].model.law
    parameters = dict(problem_parameters)
    now, scale, before = list(compared), 1.0, 0.0
    for repeat in range(REPEATS + 1):
        seen = [
            Seen(one, jacobian, *_slopes(channel, parameters), channel.model.mesh.mirrors, factor)
            for channel, one, jacobian, factor in zip(channels, now, jacobians, given, strict=True)
        ]
        combined = _Combined(seen, shape)
        found = combined.field
        before = before or found.before
        fitted = any(jacobian.shape[1] for jacobian in jacobians)
        if fitted or abs(found.uniform) < LARGE or found.uniform < -0.9 or repeat == REPEATS:
            break
        scale *= 1.0 + found.uniform
        parameters = {
            key: value * (1.0 + found.uniform) if key in law.linear else value
            for key, value in parameters.items()
        }
        now = [
            replace(one, simulated=np.where(one.known, _force(channel, parameters), np.nan))
            for channel, one in zip(channels, now, strict=True)
        ]
    field = replace(
        found,
        factor=scale * (1.0 + found.factor) - 1.0,
        uniform=scale * (1.0 + found.uniform) - 1.0,
        before=before,
    )
    return combined.map(field)


def write_map(found: LocalMap, file: Path) -> None:
    """Write a map as XDMF, for ParaView; on one rank."""
    local.write_map(found.points, found.cells, found.factor, file)


# -- the channels ----------------------------------------------------------------------------------------------------


def _slopes(channel: Channel, parameters: Mapping[str, float]) -> tuple[Array, Cells]:
    """Derivatives (n, m) of a channel's force at its samples by its cells' factors, and the cells."""
    model, simulation = channel.model, channel.simulation
    model.set_parameters({k: v for k, v in parameters.items() if k in model.constants})
    if simulation is None or not simulation.path_dependent:
        found = local.swept(model, channel.targets)
        return _interpolated(found, channel), found.cells
    # The rig's part in the curve is left out: it does not change which cells carry the force.
    steps, recording = simulation.steps, channel.recording
    found = local.marched(model, Program(steps.displacement, steps.time if steps.timed else None))
    clock = np.arange(len(recording.force), dtype=float) if recording.time is None else recording.time
    return steps.interpolation(clock) @ found.slope, found.cells


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
    return channel.at_samples(channel.solve(parameters, ()))[0]


# -- one field for all of them ---------------------------------------------------------------------------------------


class _Combined:
    """All channels on one set of cells: the mesh that is cut at the fewest planes, a half-plane before a solid."""

    def __init__(self, seen: Sequence[Seen], shape: Shape) -> None:
        self.names, self.shape = [one.compared.name for one in seen], shape
        host = min(
            seen, key=lambda one: (one.cells.points.shape[1], len(one.mirrors), -len(one.cells.volume))
        )
        self.cells, self.mirrors = host.cells, host.mirrors
        slopes = [one.slope @ _onto(one.cells, one.mirrors, self.cells, self.mirrors) for one in seen]
        compared, factors = [one.compared for one in seen], [one.factor for one in seen]
        self.linear = weighing.linear_fit(compared, factors, [one.jacobian for one in seen])
        self.slope = weighing.columns(compared, factors, slopes)
        self.field = estimate(self.linear, self.slope, covariance(self.cells, _thickness(self.cells)))

    def map(self, field: Field) -> LocalMap:
        """The map, in figures and words."""
        helps = field.p < LEVEL
        total = field.before or 1.0
        return LocalMap(
            channel=" + ".join(self.names),
            points=self.cells.points,
            cells=self.cells.corners,
            factor=field.factor,
            local_gain=1.0 - field.after_local / total,
            uniform_gain=1.0 - field.after_uniform / total,
            helps_locally=helps,
            text=" ".join(
                filter(None, [self._gains(field, helps), self._place(field) if helps else "", self._part()])
            ),
        )

    def _gains(self, field: Field, helps: bool) -> str:
        everywhere = _percent(1.0 - field.after_uniform / (field.before or 1.0))
        somewhere = _percent(1.0 - field.after_local / (field.before or 1.0))
        factor = f" ({1.0 + field.uniform:.3g} on all rubber)" if abs(field.uniform) > 1e-3 else ""
        if helps:
            return (
                f"A local change of stiffness takes away {somewhere} of the squared misfit, the best uniform "
                f"one{factor} {everywhere}: the rubber is not everywhere the same (p {_chance(field.p)})."
            )
        return (
            f"A local change of stiffness does not help significantly more than a uniform one{factor}, which takes "
            f"away {everywhere} of the squared misfit (p {_chance(field.p)}): these recordings tell of no place in "
            "the rubber."
        )

    def _place(self, field: Field) -> str:
        labels, zones = _zones(self.cells, self.mirrors, self.shape)
        change, drop = zone_drops(self.linear, self.slope, zones, field.variance)
        best = int(np.argmax(drop))
        rivals = [i for i in np.argsort(-drop) if drop[i] > drop[best] - APART and i != best]
        said = f"{_change(change[best])} {labels[best]}"
        if drop[best] * field.variance < WHOLE * (field.after_uniform - field.after_local):
            volume = self.cells.volume @ zones
            mean = (field.factor * self.cells.volume) @ zones / volume - field.uniform
            largest = int(np.argmax(np.abs(mean)))
            return (
                "No single place makes it: the map asks most for a change "
                f"{labels[largest]}, where the rubber would be {_change(mean[largest])} than the rest."
            )
        if len(rivals) + 1 > len(labels) / 2:
            return "Where cannot be told from these recordings: most places would serve as well."
        also = "; as well, ".join([said, *(f"{_change(change[i])} {labels[i]}" for i in rivals)])
        return f"It would have to be {also}."

    def _part(self) -> str:
        if len(self.mirrors) == 0:
            return ""
        planes = " and ".join(f"{plane} = 0" for plane in sorted(self.mirrors))
        return f"The mesh is cut at {planes}: the parts beyond are mirror images, and cannot be told from it."


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
    corners = cells.points[cells.corners]
    if flat and corners.shape[2] == 3:
        corners = np.stack([np.hypot(corners[..., 0], corners[..., 1]), corners[..., 2]], axis=-1)
    centres = corners.mean(axis=1)
    names = "rz" if flat else "xyz"
    for plane in mirrors & set(names):
        centres[:, names.index(plane)] = np.abs(centres[:, names.index(plane)])
    return np.asarray(centres)


# -- words -----------------------------------------------------------------------------------------------------------


def _thickness(cells: Cells) -> float:
    """Of the rubber across, mm."""
    return float(
        np.ptp(_place_of(cells, True, frozenset())[:, 0])
        if cells.points.shape[1] == 3
        else np.ptp(cells.points[:, 0])
    )


def _zones(cells: Cells, mirrors: Mirrors, shape: Shape) -> tuple[list[str], Array]:
    """Names of parts of the rubber, and which cells (m, k) belong to each."""
    radius, height = _place_of(cells, True, frozenset()).T
    corners = (
        cells.points
        if cells.points.shape[1] == 2
        else np.column_stack([np.hypot(cells.points[:, 0], cells.points[:, 1]), cells.points[:, 2]])
    )
    across = (radius - corners[:, 0].min()) / np.ptp(corners[:, 0])
    end = float(np.abs(corners[:, 1]).max())
    names = ("bore", "flank") if not isinstance(shape, Ring) else ("inner bond", "outer bond")
    rings = {
        f"near the {names[0]}": across < 1 / 3,
        "between the bonds" if isinstance(shape, Ring) else "in the middle": (across >= 1 / 3)
        & (across <= 2 / 3),
        f"near the {names[1]}": across > 2 / 3,
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
    return f"{100 * abs(value):.0f} % {'stiffer' if value > 0 else 'softer'}"


def _percent(share: float) -> str:
    return f"{100 * max(share, 0.0):.0f} %"


def _chance(p: float) -> str:
    return "< 0.001" if p < 1e-3 else f"= {p:.2g}"
