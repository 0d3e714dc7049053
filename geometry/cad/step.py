"""Contents of a STEP file that Gmsh does not pass on: its unit of length, and the names of solids and faces.

They are read from the text, in the order in which OpenCASCADE numbers the entities; names are used only where the
number of faces and the type of every surface agree with those of OpenCASCADE.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from geometry.errors import GeometryError

_ENTITY = re.compile(r"\s*#(\d{1,18})\s*=\s*([A-Z_0-9]*)\s*\((.*)\)\s*\Z", re.S)
_REFERENCE = re.compile(r"#(\d{1,18})")
_SI_UNIT = re.compile(r"SI_UNIT\s*\(\s*([.$A-Z]+)\s*,\s*\.METRE\.\s*\)")
_PREFIX = {".MILLI.": 1.0, ".CENTI.": 10.0, ".DECI.": 100.0, "$": 1000.0, ".KILO.": 1e6, ".MICRO.": 1e-3}
_NUMBER = r"\s*[-+]?(?:\d{1,40}\.?\d{0,40}|\.\d{1,40})(?:E(?:\+?\d{1,2}|-\d{1,3}))?\s*"
_POINT = re.compile(rf"\s*(?:'(?:[^']|'')*'|\$)\s*,\s*\({_NUMBER}(?:,{_NUMBER}){{0,2}}\)\s*\Z", re.I)
#: Lists in which nothing may be twice: OpenCASCADE makes each again.
_LISTS = (
    *("CLOSED_SHELL", "OPEN_SHELL", "BREP_WITH_VOIDS", "SHELL_BASED_SURFACE_MODEL", "SHAPE_REPRESENTATION"),
    *("ADVANCED_BREP_SHAPE_REPRESENTATION", "MANIFOLD_SURFACE_SHAPE_REPRESENTATION"),
)
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
    """Read unit and names.

    Raises
    ------
    GeometryError
        A point is none, or a shell or a solid is listed twice.
    """
    text = path.read_text(encoding="latin-1")
    matches = (_ENTITY.match(statement) for statement in _statements(text))
    entities = {int(match[1]): (match[2], match[3]) for match in matches if match is not None}
    _refuse_wrong(entities, str(path))
    solids, faces = [], []
    for kind, body in entities.values():
        if kind not in ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS"):
            continue
        solids.append(_name(body))
        for shell in _references(body):
            entity = entities.get(shell, ("", ""))
            if entity[0] == "ORIENTED_CLOSED_SHELL":
                entity = entities.get(next(_references(entity[1]), 0), ("", ""))
            for face in _references(entity[1]):
                kind_of_face, inside = entities.get(face, ("", ""))
                if kind_of_face not in ("ADVANCED_FACE", "FACE_SURFACE"):
                    continue
                surface = entities.get([0, *_references(inside)][-1], ("", ""))[0]
                faces.append((_name(inside), _SURFACES.get(surface, "")))
    return StepText(_unit(text, entities.values()), tuple(solids), tuple(faces))


def _refuse_wrong(entities: Mapping[int, tuple[str, str]], where: str) -> None:
    """Refuse points without coordinates, which crash the process or become zero, and lists that repeat an entity."""
    for number, (kind, body) in entities.items():
        if kind in ("CARTESIAN_POINT", "DIRECTION") and not _POINT.match(body):
            values = body[body.find("(") :][:60]
            what = f"#{number}, a {kind}, has the coordinates {values}"
            raise GeometryError(where, what, "one to three numbers: export the file again")
        if kind in _LISTS:
            listed = list(_references(body))
            if len(set(listed)) < len(listed):
                twice = next(reference for reference, count in Counter(listed).items() if count > 1)
                what = f"#{number}, a {kind}, lists #{twice} {listed.count(twice)} times"
                raise GeometryError(where, what, "every part once: export the file again")


def _statements(text: str) -> Iterator[str]:
    """Yield the statements between semicolons outside quotes; one regular expression could take hours."""
    parts: list[str] = []
    quotes = 0
    for part in _without_comments(text).split(";"):
        parts.append(part)
        quotes += part.count("'")
        if quotes % 2 == 0:
            yield ";".join(parts)
            parts = []


def _without_comments(text: str) -> str:
    head, *comments = text.split("/*")
    ended = (comment.partition("*/") for comment in comments)
    return head + "".join(after if end else f"/*{before}" for before, end, after in ended)


def _references(body: str) -> Iterator[int]:
    return (int(match[1]) for match in _REFERENCE.finditer(body))


def _name(body: str) -> str:
    quoted = re.match(r"\s*'((?:[^']|'')*)'", body)
    name = quoted[1].strip() if quoted else ""
    return "" if name.upper() in ("NONE", "SOLID", "FACE") else name


def _unit(text: str, entities: Iterable[tuple[str, str]]) -> float | None:
    if re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'INCH'", text, re.I):
        return 25.4
    for kind, body in entities:
        match = _SI_UNIT.search(body) if not kind and "LENGTH_UNIT" in body else None
        if match:
            return _PREFIX.get(match[1])
    return None
