"""STEP and BREP files of bushings, made by script: some of them `bushcli mesh` has to mesh, the others to refuse.

`PARTS` says what is expected of each: None for a mesh, or else a part of the sentence that refuses it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import gmsh

Draw = Callable[[], None]
Change = Callable[[str], str]


def _occ():
    return gmsh.model.occ


def ring(inner=10.0, outer=22.0, length=40.0, at=(0.0, 0.0, 0.0), direction=(0.0, 0.0, 1.0)) -> int:
    """Rubber between two cylinders, centred at a point."""
    start = [a - 0.5 * length * d for a, d in zip(at, direction, strict=True)]
    along = [length * d for d in direction]
    hole = _occ().addCylinder(*start, *along, inner)
    body = _occ().addCylinder(*start, *along, outer)
    return _occ().cut([(3, body)], [(3, hole)])[0][0][1]


def _without(body: int, *holes: int) -> int:
    return _occ().cut([(3, body)], [(3, hole) for hole in holes])[0][0][1]


def _void(angle: float, radius=16.0, size=2.5, length=60.0) -> int:
    x, y = radius * math.cos(angle), radius * math.sin(angle)
    return _occ().addCylinder(x, y, -length / 2, 0, 0, length, size)


def _kidney(middle: float, half=0.6, low=14.0, high=18.0) -> int:
    tags = []
    for radius in (high, low):
        sector = _occ().addCylinder(0, 0, -30, 0, 0, 60, radius, angle=2 * half)
        _occ().rotate([(3, sector)], 0, 0, 0, 0, 0, 1, middle - half)
        tags.append(sector)
    return _without(tags[0], tags[1])


def _end_curves(body: int) -> list[int]:
    _occ().synchronize()
    return [
        tag
        for _, tag in gmsh.model.getBoundary(
            [(2, f) for _, f in gmsh.model.getBoundary([(3, body)], oriented=False)],
            combined=False,
            oriented=False,
        )
        if gmsh.model.getType(1, tag) == "Circle"
    ]


def chamfered(size: float) -> None:
    """Chamfer at all four circular edges."""
    body = ring()
    curves = sorted(set(_end_curves(body)))
    faces = [f for _, f in gmsh.model.getBoundary([(3, body)], oriented=False)]
    beside = [
        next(f for f in faces if c in [t for _, t in gmsh.model.getBoundary([(2, f)], False, False)])
        for c in curves
    ]
    _occ().chamfer([body], curves, beside, [size])


def filleted() -> None:
    """Rounded edges at both ends."""
    body = ring()
    _occ().fillet([body], sorted(set(_end_curves(body))), [1.5])


def flanged() -> None:
    """A collar of rubber over the upper end of the outer sleeve."""
    body = ring()
    collar = ring(10.0, 27.0, 4.0, (0, 0, 22.0))
    _occ().fuse([(3, body)], [(3, collar)])


def eccentric() -> None:
    """The bore is 2 mm off the axis of the outside."""
    hole = _occ().addCylinder(2, 0, -20, 0, 0, 40, 10)
    body = _occ().addCylinder(0, 0, -20, 0, 0, 40, 22)
    _without(body, hole)


def two_bores() -> None:
    """Either bore may be the bond."""
    holes = [_occ().addCylinder(x, 0, -20, 0, 0, 40, 4) for x in (-8, 8)]
    _without(_occ().addCylinder(0, 0, -20, 0, 0, 40, 22), *holes)


def quarter() -> int:
    """A finite-element model that was cut at its planes of symmetry."""
    sectors = [_occ().addCylinder(0, 0, -20, 0, 0, 40, radius, angle=math.pi / 2) for radius in (22, 10)]
    return _without(*sectors)


def sleeves() -> None:
    """Rubber between a bolt and a housing."""
    for size in ((7, 10, 46), (10, 22, 40), (22, 24, 40)):
        ring(*size)


def plate() -> None:
    """A steel tube inside the rubber."""
    _without(ring(), ring(15.5, 16.5, 30))
    ring(15.5, 16.5, 30)


def layers(gap: float = 0.0, press: float = 0.0) -> None:
    """Two rings of rubber with a tube between them, the tube drawn smaller by a gap or larger for a press fit."""
    ring(10, 15)
    ring(16, 22)
    ring(15 - press, 16 - gap, 44)


def cone() -> None:
    """A conical bore."""
    hole = _occ().addCone(0, 0, -20, 0, 0, 40, 9, 12)
    body = _occ().addCylinder(0, 0, -20, 0, 0, 40, 22)
    _without(body, hole)


def open_shell() -> None:
    """A ring of which one face is missing."""
    body = ring()
    _occ().synchronize()
    faces = [t for _, t in gmsh.model.getBoundary([(3, body)], oriented=False)]
    _occ().remove([(3, body)])
    _occ().remove([(2, faces[-1])])


def _named(*names: str) -> Change:
    """Give the solids names, in their order, as CAD programs do."""

    def change(text: str) -> str:
        for name in names:
            text = re.sub(r"(MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS)\(''", rf"\1('{name}'", text, count=1)
        return text

    return change


def _coloured(text: str, rim: bool = False) -> str:
    """Colour the bore (radius 10) red, the outside (radius 22) green and, if wanted, the rim (radius 27) blue."""
    style = """#9{n}1 = COLOUR_RGB('',{rgb});
#9{n}2 = FILL_AREA_STYLE_COLOUR('',#9{n}1);
#9{n}3 = FILL_AREA_STYLE('',(#9{n}2));
#9{n}4 = SURFACE_STYLE_FILL_AREA(#9{n}3);
#9{n}5 = SURFACE_SIDE_STYLE('',(#9{n}4));
#9{n}6 = SURFACE_STYLE_USAGE(.BOTH.,#9{n}5);
#9{n}7 = PRESENTATION_STYLE_ASSIGNMENT((#9{n}6));
#9{n}8 = STYLED_ITEM('',(#9{n}7),#{face});
"""
    faces = dict(re.findall(r"#(\d+) = ADVANCED_FACE\('',\([^)]*\),#(\d+)", text))
    radii = dict(re.findall(r"#(\d+) = CYLINDRICAL_SURFACE\('',#\d+,([\d.]+)\)", text))
    items = ""
    painted = [("10.", "1.,0.,0."), ("22.", "0.,1.,0."), ("27.", "0.,0.,1.")][: 3 if rim else 2]
    for n, (radius, rgb) in enumerate(painted):
        face = next(face for face, surface in faces.items() if radii.get(surface) == radius)
        items += style.format(n=n, rgb=rgb, face=face)
    context = re.search(r"ADVANCED_BREP_SHAPE_REPRESENTATION\('',\([^)]*\),#(\d+)\)", text)
    assert context
    styled = ",".join(f"#9{n}8" for n in range(len(painted)))
    items += f"#999 = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',({styled}),#{context[1]});\n"
    items = re.sub(r"#9(\d+)", r"#99\1", items)
    return text.replace("ENDSEC;\nEND-ISO", items + "ENDSEC;\nEND-ISO")


#: Name -> how it is drawn, what is changed in the file's text, and the expected message (None = meshed).
PARTS: dict[str, tuple[Draw, Change | None, str | None]] = {
    "plain": (lambda: ring() and None, None, None),
    "two_kidneys": (lambda: _without(ring(), _kidney(0.0), _kidney(math.pi)) and None, None, None),
    "turned_kidneys": (lambda: _without(ring(), _kidney(0.5), _kidney(0.5 + math.pi)) and None, None, None),
    "chamfers": (lambda: chamfered(1.5), None, None),
    "fillets": (filleted, None, None),
    "flange": (flanged, None, None),
    "one_void": (lambda: _without(ring(), _void(0.0)) and None, None, None),
    "offset_voids": (lambda: _without(ring(), _void(0.3), _void(2.9, 15.5, 2.0)) and None, None, None),
    "three_voids": (
        lambda: _without(ring(), *(_void(i * 2 * math.pi / 3) for i in range(3))) and None,
        None,
        None,
    ),
    "plate": (plate, _named("rubber", "tube"), None),
    "layers": (layers, _named("rubber", "rubber", "tube"), None),
    "gap": (
        lambda: layers(gap=0.05),
        _named("rubber", "rubber", "tube"),
        "nothing joins the inner bond to the outer one; the narrowest gap is 0.05 mm",
    ),
    "press_fit": (
        lambda: layers(press=0.1),
        _named("rubber", "rubber", "tube"),
        r'solids 1 \("rubber"\) and 3 \("tube"\) overlap near',
    ),
    "sleeves": (sleeves, _named("bolt", "rubber", "housing"), None),
    "nameless_sleeves": (sleeves, None, "no name says which one is the rubber"),
    "tiny_faces": (lambda: chamfered(0.05), None, None),
    "metres": (
        lambda: ring(0.010, 0.022, 0.040) and None,
        lambda text: text.replace(".MILLI.,.METRE.", "$,.METRE."),
        None,
    ),
    "voids_in_metres": (
        lambda: _without(ring(), _kidney(0.0), _kidney(math.pi)) and None,
        lambda text: text.replace(".MILLI.,.METRE.", "$,.METRE."),
        "which is impossible for a bushing",
    ),
    "wrong_unit": (lambda: ring(0.010, 0.022, 0.040) and None, None, "which is impossible for a bushing"),
    "tilted": (
        lambda: ring(at=(5.0, -3.0, 8.0), direction=(0.6, 0.0, 0.8)) and None,
        None,
        None,
    ),
    "open_shell": (open_shell, None, "its surface is open"),
    "box": (lambda: _occ().addBox(-20, -20, -10, 40, 40, 20) and None, None, "the axis cannot be found"),
    "rod": (lambda: _occ().addCylinder(0, 0, 0, 0, 0, 40, 20) and None, None, 'the bond "inner"'),
    "cone": (cone, None, None),
    "eccentric": (eccentric, None, None),
    "two_bores": (two_bores, None, 'the bond "inner".*cylinders about other lines of radius 4 mm'),
    "quarter": (lambda: quarter() and None, None, "holds 90 of 360 degrees of a bushing"),
    "coloured": (flanged, _coloured, None),
    "three_colours": (flanged, lambda text: _coloured(text, rim=True), None),
}


def make(name: str, folder: Path, suffix: str = ".step") -> Path:
    """Write one of the parts."""
    draw, change, _ = PARTS[name]
    path = draw_to(folder / f"{name}{suffix}", draw)
    if change:
        text = path.read_text()
        changed = change(text)
        assert changed != text
        path.write_text(changed)
    return path


def draw_to(path: Path, draw: Draw) -> Path:
    """Draw in a new Gmsh session, and write what was drawn."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add(path.stem)
        draw()
        _occ().synchronize()
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path
