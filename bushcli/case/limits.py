"""Limits of a case file (size, depth, number of entries), so that every case is answered in a bounded time."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from bushcli.case.case import MeshOptions
from bushcli.case.finding import Finding
from cases.mode import modes, setting_for
from geometry.shape import Shape

#: Bytes of a case file. The largest in use has some ten thousand.
LARGEST_CASE = 1_000_000
#: Bytes of a result; one of many long recordings has some tens of MB.
LARGEST_RESULT = 500_000_000
#: Tables in tables; the deepest key of a case file has four.
DEEPEST = 20
#: Largest numbers of entries in a list of tables, and of problems that are listed.
MOST_ENTRIES, MOST_PROBLEMS = 500, 20
#: Largest number of elements of a section (2) and of a solid (3), whose factorisation then needs some 10 GB.
LARGEST_MESH = {2: 200_000, 3: 50_000}
#: Largest number of tetrahedra: five of them have as many unknowns as a hexahedron.
MOST_TETRAHEDRA = 250_000
#: Axial travel over the rubber's thickness: a shear of 10 stretches by 10, and unfilled natural rubber, which stretches
#: most, breaks at 7 to 8 (Treloar 1975, The physics of rubber elasticity).
MOST_SHEAR = 10.0

_QUOTED = re.compile(r"\"(?:[^\"\\\n]|\\.)*\"|'[^'\n]*'")
_DOT = re.compile(r"[\w\"'-][ \t]*\.(?=[ \t]*[\w\"'-])")


def too_deep_line(text: str) -> int | None:
    """Return the line of a key with more dots than `DEEPEST`, or None; the parser takes hours over such a key."""
    for number, line in enumerate(text.split("\n"), start=1):
        if line.count(".") <= DEEPEST:
            continue
        unquoted = _QUOTED.sub("q", line).partition("#")[0]
        if any(
            part.count(".") > DEEPEST and len(_DOT.findall(part)) > DEEPEST
            for part in re.split(r"[=,{}\[\]]", unquoted)
        ):
            return number
    return None


def is_too_deep(data: Any) -> bool:
    """Whether tables and lists are nested deeper than `DEEPEST`."""
    nested = [data]
    for _ in range(DEEPEST + 1):
        nested = [
            inner
            for value in nested
            for inner in (value.values() if isinstance(value, dict) else value)
            if isinstance(inner, (dict, list))
        ]
        if not nested:
            return False
    return True


def mesh_size(shape: Shape, mesh: MeshOptions, used: Iterable[str]) -> Iterator[Finding]:
    """Refuse a mesh that is larger than `LARGEST_MESH`; the size of a free mesh is estimated.

    Raises
    ------
    GeometryError
        An outline or a CAD file is not that of a bushing.
    """
    # A case without loads is not checked for a path of six motions, which would need a mesh of the whole part.
    names = set(used) or {
        m.name for m in modes().values() if m.specimen == shape.specimen and m.follow is None
    }
    for key in ("across", "along", "around"):
        if getattr(mesh.refinement, key) is not None and key not in shape.element_directions:
            what = f"mesh.elements_{key} has no meaning for this shape: its mesh has no elements in that direction"
            alternatives = "".join(
                f"; elements_{direction} refines the mesh" for direction in shape.element_directions
            )
            yield Finding(("mesh", f"elements_{key}"), what, expected="leave it out" + alternatives)
    for name in sorted(names):
        mode = modes()[name]
        dimension = 2 if mode.section is not None and shape.axisymmetric else 3
        if not shape.structured:
            mirrors = setting_for(mode, dimension).mirrors & shape.mirror_planes
            about = shape.cells(dimension, mirrors, mesh.refinement)
            most = LARGEST_MESH[dimension] if shape.axisymmetric else MOST_TETRAHEDRA
            if about <= most:
                continue
            what = f"the mesh for mode {name} would have about {about:.2g} elements"
            remedy = "set fewer elements_across in [mesh], such as --set mesh.elements_across=2"
            if shape.cells(dimension, mirrors, replace(mesh.refinement, across=2)) > most:
                remedy = "not even elements_across = 2 in [mesh] makes it small enough; for such thin rubber give a "
                remedy += 'body of revolution as shape = "section"'
            expected = (
                f"at most {most}: {remedy}; or check that all dimensions are in mm (a dimension in another unit makes "
                "the part long and thin) and that the part has no tiny edges and faces"
            )
            yield Finding(("mesh",), what, expected=expected)
            return
        axes = shape.blocks(dimension, frozenset(), mesh.refinement).axes
        counts = [sum(interval.elements for interval in axis) for axis in axes]
        total = math.prod(counts)
        if total > LARGEST_MESH[dimension]:
            product = " x ".join(map(str, counts))
            what = f"the mesh for mode {name} would have {total:.3g} elements ({product})"
            expected = (
                f"at most {LARGEST_MESH[dimension]}: give smaller numbers of elements in [mesh], or check that the "
                "dimensions of [geometry] are in mm; the default has elements twice as long as thick"
            )
            yield Finding(("mesh",), what, expected=expected)
            return
