"""Files of a geometry: what is no file or too large is refused with a sentence, and hostile ones end in good time."""

from __future__ import annotations

import os
import time

import ezdxf
import numpy as np
import pytest

from bushcli.case.load import load_part
from bushcli.errors import CaseError
from geometry.cad.step import read_step
from geometry.errors import GeometryError
from geometry.file import existing_file
from geometry.section.crossing import refuse_crossings
from geometry.section.dxf import MOST_CURVES, read_dxf
from geometry.section.outline import Loop, OutlineCurve

SUFFIXES = [".dxf", ".step", ".stp", ".brep", ".brp", ".msh", ".inp"]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("kind", ["absent", "pipe", "device", "directory", "large"])
def test_what_is_no_file_or_too_large_is_refused(tmp_path, suffix, kind):
    file = tmp_path / f"part{suffix}"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "device":
        file.symlink_to("/dev/zero")
    elif kind == "directory":
        file.mkdir()
    elif kind == "large":
        with file.open("wb") as opened:
            opened.truncate(64_000_001)
    said = {
        "absent": "no such file",
        "pipe": "is a device or a pipe, not a file",
        "device": "is a device or a pipe, not a file",
        "directory": "is a directory, not a file",
        "large": r"has 64 MB, at most (10|20|64) MB are read: export (only|a coarser)",
    }
    with pytest.raises(CaseError, match=rf'geometry\.file = "part{suffix}": {said[kind]}'):
        load_part(file)


def test_a_name_that_no_file_can_have_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no such file"):
        existing_file(tmp_path, "a\0.step")


HOSTILE = {
    "entities without end": "#1=A(" * 200_000,
    "brackets": "#1=A(" + ") " * 400_000 + "x;",
    "comments without end": "/* " * 300_000,
    "quotes": "#1=A('" * 150_001,
    "units": "#1=(" + "LENGTH_UNIT()SI_UNIT(" * 40_000 + ");",
    "numbers": f"#{'9' * 100_000}=A(#{'9' * 100_000});#2=MANIFOLD_SOLID_BREP('',#{'9' * 6000});",
    "no references": "#1=MANIFOLD_SOLID_BREP('',#2);#2=ORIENTED_CLOSED_SHELL('');#3=ADVANCED_FACE('');",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_the_text_of_any_step_file_is_read_in_good_time(tmp_path, name):
    file = tmp_path / "part.step"
    file.write_text(f"ISO-10303-21;{HOSTILE[name]}")
    begin = time.process_time()
    assert read_step(file).unit is None
    assert time.process_time() - begin < 1.0


def test_unit_and_names_of_a_step_file_with_comments_and_quotes(tmp_path):
    file = tmp_path / "part.step"
    file.write_text(
        "ISO-10303-21;\nDATA;\n/* don't */ #1 = MANIFOLD_SOLID_BREP('a;b', #2);\n#2=CLOSED_SHELL('',(#3));\n"
        "#3=ADVANCED_FACE('it''s',(#9),#4,.T.);#4=PLANE('',#5);\n"
        "#6=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.));\nENDSEC;"
    )
    found = read_step(file)
    assert (found.unit, found.solids) == (10.0, ("a;b",))
    assert found.faces == (("it''s", "Plane"),)


def test_a_drawing_with_too_many_curves_is_refused(tmp_path):
    document = ezdxf.new(units=4)
    for i in range(MOST_CURVES + 1):
        document.modelspace().add_line((i, 0), (i + 1, 0))
    document.saveas(tmp_path / "part.dxf")
    with pytest.raises(GeometryError, match="has more than 2000 curves"):
        read_dxf(tmp_path / "part.dxf", 0.0)


def test_blocks_that_multiply_are_refused(tmp_path):
    """Four levels of a million copies each, of a block without curves."""
    document = ezdxf.new(units=4)
    inner = "level0"
    document.blocks.new(inner)
    for level in range(1, 5):
        block = document.blocks.new(f"level{level}")
        copies = {"row_count": 1000, "column_count": 1000, "row_spacing": 1, "column_spacing": 1}
        block.add_blockref(inner, (0, 0), dxfattribs=copies)
        inner = block.name
    document.modelspace().add_blockref(inner, (0, 0))
    document.saveas(tmp_path / "part.dxf")
    with pytest.raises(GeometryError, match="blocks with more than 20000 parts"):
        read_dxf(tmp_path / "part.dxf", 0.0)


def ring(count):
    """A closed outline of straight edges."""
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    points = [
        (float(x), float(y)) for x, y in np.column_stack([20.0 + 5.0 * np.cos(turn), 5.0 * np.sin(turn)])
    ]
    return Loop(
        tuple(
            OutlineCurve("line", pair, "free") for pair in zip(points, [*points[1:], points[0]], strict=True)
        )
    )


def test_crossings_of_fine_outlines_are_found_and_finer_ones_refused():
    fine = ring(1500)
    refuse_crossings([fine], "part.dxf")
    first, *rest = fine.curves
    far = (18.0, 4.9)
    crossed = Loop(
        (
            OutlineCurve("line", (first.points[0], far), "free"),
            OutlineCurve("line", (far, first.points[1]), "free"),
            *rest,
        )
    )
    with pytest.raises(GeometryError, match="the outline crosses itself at"):
        refuse_crossings([crossed], "part.dxf")
    with pytest.raises(GeometryError, match="an outline has 25001 points"):
        refuse_crossings([ring(25_001)], "part.dxf")
