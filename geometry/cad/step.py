"""Contents of a STEP file that Gmsh does not pass on: its unit of length, and the names of solids and faces.

They are read from the text, in the order in which OpenCASCADE numbers the entities; names are used only where the
number of faces and the type of every surface agree with those of OpenCASCADE.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_ENTITY = re.compile(r"#(\d+)\s*=\s*([A-Z_0-9]*)\s*\((.*?)\)\s*;", re.S)
_REFERENCE = re.compile(r"#(\d+)")
_PREFIX = {".MILLI.": 1.0, ".CENTI.": 10.0, ".DECI.": 100.0, "$": 1000.0, ".KILO.": 1e6, ".MICRO.": 1e-3}
#: Surface in STEP -> type in Gmsh.
_SURFACES = {
    "PLANE": "Plane",
    "CYLINDRICAL_SURFACE": "Cylinder",
    "CONICAL_SURFACE": "Cone",
    "SPHERICAL_SURFACE": "Sphere",
    "TOROIDAL_SURFACE": "Torus",
}


@dataclass(frozen=True)
class StepText:
    """Unit and names in a STEP file.

    Attributes
    ----------
    unit : float or None
        Unit of length, mm; None where the file does not state it.
    solids : tuple of str
        Names of the solids, in the file's order.
    faces : tuple of (str, str)
        Name and type of surface ("" where it may be any) of every face, solid by solid.
    """

    unit: float | None
    solids: tuple[str, ...]
    faces: tuple[tuple[str, str], ...]


def read_step(path: Path) -> StepText:
    """Read unit and names."""
    text = path.read_text(encoding="latin-1")
    entities = {int(n): (kind, body) for n, kind, body in _ENTITY.findall(text)}
    solids, faces = [], []
    for kind, body in entities.values():
        if kind not in ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS"):
            continue
        solids.append(_name(body))
        shells = [int(n) for n in _REFERENCE.findall(body)]
        for shell in shells:
            found = entities.get(shell, ("", ""))
            if found[0] == "ORIENTED_CLOSED_SHELL":
                found = entities.get(int(_REFERENCE.findall(found[1])[0]), ("", ""))
            for face in _REFERENCE.findall(found[1]):
                kind_of_face, inside = entities.get(int(face), ("", ""))
                if kind_of_face not in ("ADVANCED_FACE", "FACE_SURFACE"):
                    continue
                surface = entities.get(int(_REFERENCE.findall(inside)[-1]), ("", ""))[0]
                faces.append((_name(inside), _SURFACES.get(surface, "")))
    return StepText(_unit(text), tuple(solids), tuple(faces))


def _name(body: str) -> str:
    quoted = re.match(r"\s*'((?:[^']|'')*)'", body)
    name = quoted[1].strip() if quoted else ""
    return "" if name.upper() in ("NONE", "SOLID", "FACE") else name


def _unit(text: str) -> float | None:
    if re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'INCH'", text, re.I):
        return 25.4
    for line in re.findall(r"#\d+\s*=\s*\(([^;]*LENGTH_UNIT[^;]*)\)\s*;", text):
        found = re.search(r"SI_UNIT\s*\(\s*([.$A-Z]+)\s*,\s*\.METRE\.\s*\)", line)
        if found:
            return _PREFIX.get(found[1])
    return None
