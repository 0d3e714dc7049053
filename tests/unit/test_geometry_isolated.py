"""Files of a geometry that crash, loop or take all memory end in one sentence; so do impossible curves."""

from __future__ import annotations

import math
import os
import random
import re
import time
from contextlib import suppress

import ezdxf
import pytest

from geometry.cad.find_part import CadStatements, find_part
from geometry.cad.ready_mesh import read_mesh
from geometry.errors import GeometryError
from geometry.isolated import Mistake, isolated, seconds_for
from geometry.section.dxf import read_dxf
from geometry.section.find_section import find_section
from tests.parts import make

#: Closes the outline of rubber whose free end at the top is left out.
OUTLINE = (((10, 20), (10, -20), "inner"), ((10, -20), (20, -16), "0"), ((20, -16), (20, 16), "outer"))


def in_the_reader(function, seconds=60.0):
    return isolated("cannot be read", lambda *_: "part.step", lambda *_: seconds)(function)


@pytest.mark.parametrize(
    ("work", "reason"),
    [
        (lambda: in_the_reader(os.abort)(), r"crashes \(SIGABRT\)"),
        (lambda: in_the_reader(math.factorial, 0.0)(10**7), "takes more than 0 s of processor time"),
        (lambda: in_the_reader(time.sleep, 0.1)(60.0), "takes more than 0 s of processor time"),
        (lambda: in_the_reader(bytes)(10**10), "takes more than 6 GB"),
        (lambda: in_the_reader(math.sqrt)(-1.0), "cannot be read: .*nonnegative|math domain error"),
    ],
    ids=["crash", "loop", "wait", "memory", "error"],
)
def test_whatever_happens_to_the_reader_is_one_sentence_and_the_next_file_is_read(work, reason):
    with pytest.raises(GeometryError, match=reason) as refused:
        work()
    assert refused.value.where == "part.step"
    assert "\n" not in str(refused.value)
    assert in_the_reader(math.sqrt)(16.0) == 4.0


def test_relative_paths_are_those_of_the_process_that_asks(tmp_path, monkeypatch):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        assert in_the_reader(os.getcwd)() == str(tmp_path / name)


def test_a_mistake_of_our_own_is_not_the_file_s_fault():
    with pytest.raises(Mistake, match=r"TypeError: .*str") as mistake:
        in_the_reader(seconds_for)("many")
    assert "geometry/isolated.py" in str(mistake.value.__cause__)
    # A library raises the same for a damaged file.
    with pytest.raises(GeometryError, match="cannot be read: "):
        in_the_reader(ezdxf.readfile)(None)


def drawn(path, draw, **header):
    document = ezdxf.new(units=4)
    for name, value in header.items():
        document.header[name] = value
    for start, end, layer in OUTLINE:
        document.modelspace().add_line(start, end, dxfattribs={"layer": layer})
    draw(document.modelspace())
    document.saveas(path)
    return path


def top(space):
    return space.add_line((20, 16), (10, 20))


WRONG = {
    "undefined block": (lambda s: s.add_blockref("NOPE", (0, 0)), "INSERT .* cannot be drawn: .*NOPE"),
    "arc of no size": (lambda s: s.add_arc((15, 0), 0.0, 0, 90), r"ARC .* has no size, at \(15, 0\)"),
    "circle of no size": (lambda s: s.add_circle((15, 0), 0.0), "CIRCLE .* has no size"),
    "line of no size": (lambda s: s.add_line((15, 0), (15, 0)), 'LINE .* on layer "0" .* has no size'),
    "endless line": (lambda s: s.add_line((15, 0), (1e308, 1e308)), "cannot be|crosses|impossible|open"),
    "no extrusion": (
        lambda s: s.add_lwpolyline([(15, 0), (16, 0)], dxfattribs={"extrusion": (0, 0, 0)}),
        "cannot be drawn|open",
    ),
    "few knots": (
        lambda s: s.add_open_spline([(20, 16), (15, 18), (12, 19), (10, 20)]).__setattr__("knots", [0.0]),
        "SPLINE .* cannot be drawn",
    ),
    "falling knots": (
        lambda s: s.add_open_spline([(20, 16), (15, 18), (12, 19), (10, 20)]).__setattr__(
            "knots", [0, 0, 0, 0, -1, -1, -1, -1]
        ),
        "its knots do not increase",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_curve_that_cannot_be_drawn_is_named(tmp_path, name):
    draw, words = WRONG[name]
    path = drawn(tmp_path / "part.dxf", lambda space: (top(space), draw(space)))
    with pytest.raises(GeometryError, match=words) as refused:
        find_section(read_dxf(path, 0.0).loops, str(path), None)
    assert str(path) in str(refused.value)


def test_a_corner_drawn_twice_and_a_side_with_almost_no_bulge_are_read(tmp_path):
    corners = [(20, 16, 0, 0, 0), (15, 18, 0, 0, 0), (15, 18, 0, 0, 1e-13), (10, 20, 0, 0, 0)]
    path = drawn(tmp_path / "part.dxf", lambda space: space.add_lwpolyline(corners))
    found = find_section(read_dxf(path, 0.0).loops, str(path), None)
    straight = drawn(tmp_path / "straight.dxf", top)
    expected = find_section(read_dxf(straight, 0.0).loops, str(straight), None)
    assert found.measures["rubber"] == pytest.approx(expected.measures["rubber"], rel=1e-5)


def test_a_spline_that_zigzags_is_read_in_seconds(tmp_path):
    """Without a least size its picture takes minutes: the radius of curvature of its tips is a micrometre."""
    points = [(20 - i / 19.9, 16 + i / 50 + 3 * (i % 2) * (0 < i < 199)) for i in range(200)]
    path = drawn(tmp_path / "part.dxf", lambda space: space.add_open_spline([*points[:-1], (10, 20)]))
    begin = time.perf_counter()
    find_section(read_dxf(path, 0.0).loops, str(path), None)
    assert time.perf_counter() - begin < 40.0


@pytest.mark.parametrize(
    ("find", "put", "words"),
    [
        (r"(CARTESIAN_POINT\('',)\([^)]*\)", r"\1()", "CARTESIAN_POINT, has the coordinates"),
        (r"(CARTESIAN_POINT\('',)\([^)]*\)", r"\1(#1)", "CARTESIAN_POINT, has the coordinates"),
        (r"(DIRECTION\('',)\([^)]*\)", r"\1(nan,0.,1.)", "DIRECTION, has the coordinates"),
        (r"(CLOSED_SHELL\('',\()(#\d+)", r"\1" + ",".join([r"\2"] * 500), "lists #[0-9]+ 500 times"),
    ],
    ids=["empty", "reference", "nan", "twice"],
)
def test_a_step_file_with_a_wrong_point_or_list_is_refused(tmp_path, find, put, words):
    path = make("plain", tmp_path)
    path.write_text(re.sub(find, put, path.read_text(), count=1))
    with pytest.raises(GeometryError, match=words):
        find_part(CadStatements(path, 0.0))


INP = """*NODE
1, 10., 0., 0.
*ELEMENT,
 TYPE=C3D4,
 ELSET=rubber
1, 1, 2, 3, 4
"""


def test_a_keyword_of_abaqus_that_is_continued_is_read(tmp_path):
    path = tmp_path / "part.inp"
    nodes = "\n".join(
        f"{i}, {x}, {y}, {z}" for i, x, y, z in ((1, 9, 0, 0), (2, 20, 0, 0), (3, 9, 9, 0), (4, 9, 0, 9))
    )
    path.write_text(INP.replace("1, 10., 0., 0.", nodes))
    with pytest.raises(GeometryError, match='no outer facets are in a group "inner"'):
        read_mesh(path, 0.0, 1.0, None, None, None)


@pytest.mark.parametrize(
    "more",
    ["*NSET, NSET=inner, GENERATE\n1, 3000000000\n", "*INCLUDE, INPUT=part.inp\n"],
    ids=["set", "itself"],
)
def test_a_set_without_end_and_a_file_that_includes_itself_are_refused(tmp_path, more):
    path = tmp_path / "part.inp"
    path.write_text(INP + more)
    with pytest.raises(GeometryError, match="cannot be read as a mesh"):
        read_mesh(path, 0.0, 1.0, None, None, None)


@pytest.mark.parametrize("seed", range(12))
def test_a_damaged_step_file_or_drawing_is_read_or_refused(tmp_path, seed):
    """Digits, brackets and lines of sound files are changed at random places."""
    chance = random.Random(seed)
    if seed % 2:
        path = drawn(tmp_path / "part.dxf", top)
    else:
        path = make("plain", tmp_path)
    text = list(path.read_text())
    for _ in range(chance.choice((1, 5, 50))):
        text[chance.randrange(len(text))] = chance.choice(list("0123456789.,()#'E-\n"))
    path.write_text("".join(text))
    with suppress(GeometryError):
        if seed % 2:
            find_section(read_dxf(path, 0.0).loops, str(path), None)
        else:
            find_part(CadStatements(path, 0.0))
