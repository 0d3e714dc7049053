"""Interpretation of a CAD file: roles of the solids, axis, bonds, planes of symmetry, measures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from geometry.blocks import Array
from geometry.cad.axis import Axis, distance_between, find_axis, turned_about
from geometry.cad.bonded_metal import beyond_bonds, held_area, is_even
from geometry.cad.bonds import FREE, Bonds, find_bonds
from geometry.cad.frame import Frame, frame_of
from geometry.cad.missing_bonds import require_bonds
from geometry.cad.notes import captions_of, notes_of, picture_names
from geometry.cad.part import Part, open_part
from geometry.cad.roles import IGNORED, INNER, OUTER, RUBBER, roles_of
from geometry.cad.rules import Rule
from geometry.cad.sampling import Sampled, extent, local_thickness, sample
from geometry.cad.segment import refuse_segment
from geometry.cad.splines import areas_and_volumes
from geometry.cad.triangles import view_of
from geometry.connections import BONDS, refuse_loose, refuse_touching
from geometry.errors import GeometryError
from geometry.isolated import SIMPLER, isolated
from geometry.session import model, session
from geometry.size import Unit
from geometry.symmetry import SampledSolids, is_symmetric, moments
from geometry.view import View
from geometry.wall import Wall, cylindrical, wall_of

Planes = frozenset[Literal["x", "y", "z"]]
#: If the principal moments in the plane normal to the axis differ by more than this share, their directions are used.
LOPSIDED = 1e-3


class CadStatements(NamedTuple):
    """Statements of the case about a CAD file."""

    path: Path
    changed: float
    unit: Unit | None = None
    axis: tuple[float, float, float] | None = None
    origin: tuple[float, float, float] | None = None
    direction: tuple[float, float, float] | None = None
    inner: tuple[Rule, ...] = ()
    outer: tuple[Rule, ...] = ()
    solids: tuple[tuple[str, str], ...] = ()
    elastic: tuple[str, ...] = ()
    stiff: tuple[str, ...] = ()


@dataclass(frozen=True)
class FoundPart:
    """A CAD part that can be meshed; tags are Gmsh's, the same each time the file is opened.

    Attributes
    ----------
    roles : mapping
        Solid -> "rubber", "inner_sleeve", "outer_sleeve" or a plate's name.
    meshed : tuple of int
        Solids that are meshed; the others are rigid.
    labels : mapping
        Face on the outside of the meshed solids -> "inner", "outer", "free".
    frame
        The bushing's place in the file.
    planes
        Planes of symmetry.
    measures : mapping
        Volume of each region (mm^3) and area of each boundary (mm^2); bonds as "inner_bond".
    thickness
        Size of the rubber across the bonds, mm.
    layer
        Mean thickness of the rubber between bonds and metal, mm: less than `thickness` where plates divide it.
    size
        Largest extent of the solids in the file, mm.
    narrow : mapping
        Face -> distance to the opposite face, where that is less than the thickness, mm.
    curved : mapping
        Face -> its area (mm^2) and least radius of curvature, mm.
    edges
        Length of the curves around the bonds, mm.
    notes : tuple of str
        Results of the interpretation and how they were found, in sentences.
    view
        Contents of a picture, in the bushing's coordinates.
    wall
        The rubber between two coaxial sleeves; None where the part has no such rubber.
    beyond : mapping
        Bond -> lengths by which the drawn rigid sleeve continues below and above it, mm.
    """

    roles: Mapping[int, str]
    meshed: tuple[int, ...]
    labels: Mapping[int, str]
    frame: Frame
    planes: Planes
    measures: Mapping[str, float]
    thickness: float
    layer: float
    size: float
    narrow: Mapping[int, float]
    curved: Mapping[int, tuple[float, float]]
    edges: float
    notes: tuple[str, ...]
    view: View | None
    wall: Wall | None
    beyond: Mapping[str, tuple[float, float]]

    @property
    def regions(self) -> tuple[str, ...]:
        """Meshed regions: the rubber, then elastic plates and sleeves."""
        metal = dict.fromkeys(self.roles[tag] for tag in self.meshed if self.roles[tag] != RUBBER)
        return (RUBBER, *metal)


#: Faces of a part whose axis, bonds and symmetry are found: with 400 pockets in its ends it takes 30 s on one core of a
#: busy machine, growing with the square of their number; `geometry.isolated` allows 60 s.
MOST_FACES = 600


@lru_cache(maxsize=16)
@isolated("cannot be read as CAD", lambda statements: statements.path)
def find_part(statements: CadStatements) -> FoundPart:
    """Open and interpret a CAD file; each file only once.

    Raises
    ------
    GeometryError
    """
    with session():
        part = open_part(statements.path, statements.unit)
        areas, volumes = areas_and_volumes(part.solids, part.size)
        part = replace(part, areas=areas, volumes=volumes)
        where = str(statements.path)
        roles = roles_of(part.solids, dict(statements.solids), where)
        meshed = tuple(
            tag
            for tag, role in roles.items()
            if role not in (INNER, OUTER, IGNORED) or role in statements.elastic
        )
        outside = _outer_faces(meshed)
        if len(outside) > MOST_FACES:
            what = (
                f"the meshed solids have {len(outside)} faces, of which at most {MOST_FACES} are interpreted"
            )
            raise GeometryError(where, what, SIMPLER)
        faces = [sample(face, part.size, part.areas.get(face)) for face in outside]
        axis, how = _axis(statements, part, faces)
        rules = {"inner": statements.inner, "outer": statements.outer}
        bonds = find_bonds(part, roles, meshed, faces, axis, rules)
        require_bonds(bonds, roles, part, faces, axis, statements.axis, where)
        # Errors below show the same picture as the result: triangles are made once.
        view = view_of(*picture_names(roles, meshed, bonds.labels))
        _refuse_segment(bonds, faces, axis, where, view)
        groups = {name: [tag for tag, label in bonds.labels.items() if label == name] for name in BONDS}
        bodies = {tag: roles[tag] for tag in meshed}
        refuse_loose(bodies, groups, 3, where, view)
        refuse_touching(groups, 3, where, view)
        return _found_part(statements, part, roles, meshed, faces, axis, how, bonds, view)


def _outer_faces(meshed: Sequence[int]) -> list[int]:
    """Faces that belong to one of the meshed solids only."""
    count: dict[int, int] = {}
    for solid in meshed:
        for _, face in model().getBoundary([(3, solid)], oriented=False):
            count[int(face)] = count.get(int(face), 0) + 1
    return sorted(face for face, times in count.items() if times == 1)


def _axis(statements: CadStatements, part: Part, faces: Sequence[Sampled]) -> tuple[Axis, str]:
    where = str(statements.path)
    _, gravity, _ = moments([(3, tag) for tag in part.solids])
    common = find_axis(faces, part.size, gravity)
    if statements.axis is not None:
        direction = np.array(statements.axis, dtype=float)
        if np.linalg.norm(direction) == 0.0:
            raise GeometryError(where, "geometry.axis has no direction", "axis = [0, 0, 1]")
        direction /= np.linalg.norm(direction)
        if statements.origin is not None:
            return Axis(np.array(statements.origin, dtype=float), direction), "given"
        if common is not None and np.linalg.norm(np.cross(common.direction, direction)) < 1e-3:
            return Axis(common.point, direction), "direction given, place found"
        return Axis(gravity, direction), "direction given, through the centre of gravity"
    if common is None:
        raise GeometryError(
            where,
            "no face has an axis of revolution (a sphere has no axis of its own): the axis cannot be found",
            "give geometry.axis and geometry.origin",
            view_of({face.tag: "free" for face in faces}),
        )
    return common, "found"


def _refuse_segment(
    bonds: Bonds, faces: Sequence[Sampled], axis: Axis, where: str, view: View | None
) -> None:
    cuts = [f for f in faces if f.kind == "Plane" and len(f.points) and bonds.labels[f.tag] == FREE]
    if cuts:
        points = np.concatenate([face.points for face in faces])
        normals, places = (
            np.array([a[0] for a in vectors])
            for vectors in zip(*((f.normals, f.points) for f in cuts), strict=True)
        )
        refuse_segment(points, normals, places, axis, where, view)


def _found_part(
    statements: CadStatements,
    part: Part,
    roles: Mapping[int, str],
    meshed: tuple[int, ...],
    faces: Sequence[Sampled],
    axis: Axis,
    how: str,
    bonds: Bonds,
    view: View | None,
) -> FoundPart:
    by_tag = {face.tag: face for face in faces}
    groups = {
        name: [tag for tag, label in bonds.labels.items() if label == name]
        for name in dict.fromkeys(bonds.labels.values())
    }
    bonded = {name: [by_tag[tag] for tag in groups[name]] for name in BONDS}
    low, high = extent(bonded["inner"], axis.direction)
    point = turned_about(bonded["inner"], axis, part.size)
    middle = point + (0.5 * (low + high) - point @ axis.direction) * axis.direction
    centre = middle if statements.origin is None else np.array(statements.origin, dtype=float)
    # From the axis of most faces to the inner bond's own, or from that one to a given origin.
    line = axis.point if statements.origin is None else middle
    offset = distance_between(centre, line, axis.direction, part.size)
    frame, planes = _frame(statements, part, meshed, groups, roles, axis, centre)
    regions: dict[str, float] = {}
    for tag in meshed:
        volume = part.volume(tag)
        regions[roles[tag]] = regions.get(roles[tag], 0.0) + volume
    areas = {name: sum(by_tag[tag].area for tag in tags) for name, tags in groups.items()}
    thickness = 2.0 * regions[RUBBER] / (areas["inner"] + areas["outer"])
    beyond = beyond_bonds(part, roles, meshed, bonded, axis)
    if not is_even(beyond, thickness):
        planes -= {"z"}
    states = {r: "rigid" if t not in meshed or r in statements.stiff else "elastic" for t, r in roles.items()}
    captions = captions_of(part, roles, states)
    return FoundPart(
        roles=roles,
        meshed=meshed,
        labels=bonds.labels,
        frame=frame,
        planes=planes,
        measures=regions | {f"{k}_bond" if k in BONDS else k: v for k, v in areas.items()},
        thickness=thickness,
        layer=2.0 * regions[RUBBER] / held_area(part, roles, meshed, bonds.labels),
        size=part.size,
        narrow=local_thickness(faces, thickness),
        curved={face.tag: (face.area, _least_radius(face.tag)) for face in faces},
        edges=_around([tag for bond in BONDS for tag in groups[bond]]),
        notes=notes_of(
            part,
            roles,
            states,
            frame,
            how,
            bonds,
            areas,
            planes,
            offset,
            (statements.origin, statements.direction),
        ),
        view=None if view is None else _view_in_frame(view, frame, captions),
        wall=_wall(bonded, frame, axis),
        beyond=beyond,
    )


def _view_in_frame(view: View, frame: Frame, captions: Mapping[str, str]) -> View:
    """Return the picture's contents in the bushing's coordinates, with its captions."""
    triangles, solids = frame.local(view.triangles), frame.local(view.solids)
    return replace(view, triangles=triangles, solids=solids, captions=captions)


def _least_radius(face: int) -> float:
    """Least radius of curvature in the middle of a face, mm; inf where it is flat."""
    low, high = (np.array(bound) for bound in model().getParametrizationBounds(2, face))
    middle = (0.5 * (low + high)).tolist()
    curvature = float(model().getCurvature(2, face, middle)[0])
    return 1.0 / curvature if curvature > 0.0 else np.inf


def _around(faces: Sequence[int]) -> float:
    """Length of the curves around faces, mm."""
    curves = {int(t) for _, t in model().getBoundary([(2, f) for f in faces], combined=False, oriented=False)}
    return float(sum(model().occ.getMass(1, tag) for tag in curves))


def _wall(bonded: Mapping[str, Sequence[Sampled]], frame: Frame, axis: Axis) -> Wall | None:
    points = {name: np.concatenate([face.points for face in faces]) for name, faces in bonded.items()}
    middle = float(np.array(frame.centre) @ axis.direction)
    ends = {name: extent(faces, axis.direction) for name, faces in bonded.items()}
    spans = {name: (low - middle, high - middle) for name, (low, high) in ends.items()}
    return wall_of(
        {name: cylindrical(frame.local(bond_points)) for name, bond_points in points.items()}, spans
    )


def _frame(
    statements: CadStatements,
    part: Part,
    meshed: Sequence[int],
    groups: Mapping[str, Sequence[int]],
    roles: Mapping[int, str],
    axis: Axis,
    centre: Array,
) -> tuple[Frame, Planes]:
    """The bushing's frame, turned to a plane of symmetry where the case gives no direction of the load."""
    parts: dict[str, list[tuple[int, int]]] = {}
    for tag in meshed:
        parts.setdefault(f"region {roles[tag]}", []).append((3, tag))
    for name, tags in groups.items():
        parts[f"boundary {name}"] = [(2, tag) for tag in tags]

    inside = SampledSolids(meshed)

    def planes_of(frame: Frame) -> Planes:
        rows, origin = np.array(frame.rows), np.array(frame.centre)
        names: list[Literal["x", "y", "z"]] = ["x", "y", "z"]
        return frozenset(
            name
            for i, name in enumerate(names)
            if is_symmetric(parts, origin, rows, i, part.size) and inside.is_symmetric(origin, rows[i])
        )

    direction = None if statements.direction is None else np.array(statements.direction, dtype=float)
    frame = frame_of(axis.direction, centre, direction)
    planes = planes_of(frame)
    if direction is None and not {"x", "y"} & planes:
        _, _, second = moments([(3, tag) for tag in meshed if roles[tag] == RUBBER])
        rows = np.array(frame.rows)[:2]
        values, vectors = np.linalg.eigh(rows @ second @ rows.T)
        if values[1] - values[0] > LOPSIDED * values[1]:
            principal_axes = vectors.T @ rows
            nearest = principal_axes[int(np.argmax(np.abs(principal_axes @ rows[0])))]
            turned_frame = frame_of(axis.direction, centre, nearest * np.sign(nearest @ rows[0]))
            if {"x", "y"} & planes_of(turned_frame):
                return turned_frame, planes_of(turned_frame)
    return frame, planes
