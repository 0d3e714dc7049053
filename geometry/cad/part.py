"""A CAD file in the open Gmsh session: its solids cut at each other, with names and colours."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from geometry.cad.step import StepText, read_step
from geometry.cad.triangles import view_of
from geometry.errors import GeometryError
from geometry.session import convert_errors, model, options
from geometry.size import MILLIMETRES, UNITS, Unit, refuse_size

STEP = (".step", ".stp")
#: Solids may overlap by this share of the smaller one's volume: 1e-7 to 1e-4 mm, the tolerances of files, on its faces.
OVERLAP = 1e-6
#: Colour that Gmsh returns for a face without one.
NO_COLOUR = (0, 0, 255, 0)


@dataclass(frozen=True)
class Part:
    """Solids and faces of a file, by Gmsh's tags.

    Attributes
    ----------
    solids : dict of int to str
        Name of each solid, or empty.
    face_names : dict of int to str
        Names of the faces that have one.
    colours : dict of int to (r, g, b)
        Colours of the faces whose colour is not that of their solid.
    size
        Largest extent, mm.
    unit
        Unit of length that the file states, if it does.
    lost
        "names", "colours", or both, of faces that several solids have: faces are other ones after the solids are cut at
        each other.
    areas, volumes : dict of int to float
        Areas of faces (mm^2) and volumes of solids (mm^3) where OpenCASCADE's are inexact.
    """

    solids: dict[int, str]
    face_names: dict[int, str] = field(default_factory=dict)
    colours: dict[int, tuple[int, int, int]] = field(default_factory=dict)
    size: float = 0.0
    unit: str = ""
    lost: str = ""
    areas: dict[int, float] = field(default_factory=dict)
    volumes: dict[int, float] = field(default_factory=dict)

    def volume(self, solid: int) -> float:
        """Return the volume of a solid, mm^3."""
        return self.volumes[solid] if solid in self.volumes else float(model().occ.getMass(3, solid))


def open_part(path: Path, unit: Unit | None) -> Part:
    """Read a file into the open session.

    Parameters
    ----------
    path : Path
        The file.
    unit : Unit | None
        Unit of the file; None for the one that it declares.

    Raises
    ------
    GeometryError
        It cannot be read, or holds no solid.
    """
    if path.suffix.lower() in STEP and b"ISO-10303-21" not in path.read_bytes()[:1000]:
        raise GeometryError(str(path), "is not a STEP file: it does not begin with ISO-10303-21")
    text = read_step(path) if path.suffix.lower() in STEP else StepText(None, (), ())
    _read(path)
    solids = [int(tag) for _, tag in model().getEntities(3)]
    if not solids:
        raise _no_solid(path)
    solid_names = [_name(tag) for tag in solids]
    if len(text.solids) == len(solids):
        solid_names = [name or last for name, last in zip(text.solids, solid_names, strict=True)]
    names, colours = _faces(text)
    # OpenCASCADE has converted STEP to mm; BREP has no unit.
    scale = 1.0 if unit is None else MILLIMETRES[unit] / (text.unit or 1.0)
    if scale != 1.0:
        # Gmsh makes elements without area in parts of 22,000 mm. Scaled shapes lose their names and colours.
        _read(path, scale)
    size = _size(path)
    stated = next((name for name, factor in MILLIMETRES.items() if factor == text.unit), "")
    if len(solids) > 1:
        solids_now = _cut_at_each_other(solids, solid_names, str(path))
        lost = " and ".join(word for word, values in (("names", names), ("colours", colours)) if values)
        return Part(solids_now, size=size, unit=stated, lost=lost)
    return Part(dict(zip(solids, solid_names, strict=True)), names, colours, size, stated)


def _read(path: Path, scale: float = 1.0) -> None:
    if scale != 1.0:
        model().add("scaled")
    options().setNumber("Geometry.OCCScaling", scale)
    option = options().setNumber
    option("Geometry.OCCImportLabels", 1)
    options().setString("Geometry.OCCTargetUnit", "MM")
    for sew in (0, 1):
        option("Geometry.OCCSewFaces", sew)
        option("Geometry.OCCMakeSolids", sew)
        with convert_errors(str(path), "cannot be read as CAD"):
            model().occ.importShapes(str(path), highestDimOnly=False)
        model().occ.synchronize()
        if model().getEntities(3) or sew:
            return
        model().add("sewn")


def _no_solid(path: Path) -> GeometryError:
    faces = model().getEntities(2)
    if not faces:
        return GeometryError(
            str(path), "contains neither solids nor faces", "a STEP or BREP file with the rubber"
        )
    open_edges = [tag for _, tag in model().getEntities(1) if len(model().getAdjacencies(1, tag)[0]) == 1]
    where = ""
    if open_edges:
        x, y, z = model().occ.getCenterOfMass(1, open_edges[0])
        where = f"; {len(open_edges)} edges belong to one face only, one near {_place(x, y, z)}"
    return GeometryError(
        str(path),
        f"contains {len(faces)} faces but no closed solid: its surface is open{where}",
        "a closed solid of the rubber",
        view_of({int(tag): "not closed" for _, tag in faces}),
    )


def _place(*point: float) -> str:
    return "(" + ", ".join(f"{round(x, 3) + 0.0:g}" for x in point) + ")"


def _size(path: Path) -> float:
    box = np.array(model().getBoundingBox(-1, -1)).reshape(2, 3)
    size = float(np.max(box[1] - box[0]))
    refuse_size(size, str(path), UNITS)
    for _, tag in model().getEntities(3):
        if model().occ.getMass(3, tag) <= 0:
            raise GeometryError(
                str(path), "has a solid without volume", "a solid whose face normals point outward"
            )
    return size


def _name(solid: int) -> str:
    """The last part of the name that Gmsh made of the product structure."""
    name = str(model().getEntityName(3, solid)).removeprefix("Shapes/").split("/")[-1]
    return "" if "STEP translator" in name or name.lower() in ("solid", "shapes") else name


def _faces(text: StepText) -> tuple[dict[int, str], dict[int, tuple[int, int, int]]]:
    """Names and colours of faces."""
    faces = [int(tag) for _, tag in model().getEntities(2)]
    names = {}
    agree = len(text.faces) == len(faces) and all(
        not kind or kind == model().getType(2, tag) for (_, kind), tag in zip(text.faces, faces, strict=True)
    )
    if agree:
        names = {tag: name for tag, (name, _) in zip(faces, text.faces, strict=True) if name}
    solids = {model().getColor(3, tag) for _, tag in model().getEntities(3)}
    colours = {tag: model().getColor(2, tag) for tag in faces}
    return names, {
        tag: colour[:3] for tag, colour in colours.items() if colour != NO_COLOUR and colour not in solids
    }


def _on_surface(solid: int) -> tuple[float, float, float]:
    """Return a point of a solid, on its largest face, mm: the centre of a ring would be far from the ring."""
    faces = [int(face) for _, face in model().getBoundary([(3, solid)], oriented=False)]
    largest = max(faces, key=lambda face: float(model().occ.getMass(2, face)))
    low, high = model().getParametrizationBounds(2, largest)
    x, y, z = model().getValue(2, largest, [0.5 * (a + b) for a, b in zip(low, high, strict=True)])
    return float(x), float(y), float(z)


def _cut_at_each_other(solids: list[int], names: list[str], where: str) -> dict[int, str]:
    """Cut the solids at each other, so that they share faces where they touch."""
    volumes = [float(model().occ.getMass(3, tag)) for tag in solids]
    _, fragments = model().occ.fragment([(3, tag) for tag in solids[:1]], [(3, tag) for tag in solids[1:]])
    model().occ.synchronize()
    solid_names: dict[int, str] = {}
    owners: dict[int, int] = {}
    for number, pieces in enumerate(fragments):
        for dimension, tag in pieces:
            if dimension != 3:
                continue
            owner = owners.setdefault(tag, number)
            common = float(model().occ.getMass(3, tag))
            if owner != number and common > OVERLAP * min(volumes[owner], volumes[number]):
                pair = " and ".join(f'{i + 1} ("{names[i] or "no name"}")' for i in (owner, number))
                raise GeometryError(
                    where,
                    f"solids {pair} overlap near {_place(*_on_surface(tag))}, in {common:.4g} of "
                    f"{volumes[owner]:.4g} and {volumes[number]:.4g} mm3",
                    "solids that touch; draw rubber as moulded, up to the sleeve, and give a press fit as an effect "
                    "(swaging)",
                    view_of(
                        {
                            int(face): "overlap" if solid == tag else "free"
                            for solid in owners
                            for _, face in model().getBoundary([(3, solid)], oriented=False)
                        }
                    ),
                )
            if tag not in solid_names:
                solid_names[int(tag)] = names[number]
    return solid_names
