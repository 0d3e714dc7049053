"""Vehicle models read back: property files by a reader of their format, the 6 x 6 by running it, JSON, curves."""

import csv
import io
import json
import sys
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from bushcli.errors import InputError
from bushcli.export import Order, all_writers, unit_system, writer_for
from bushcli.export.curves import BushingData, ForceCurve, curves_of, matrix_of
from bushcli.export.rubber import ExportedRubber
from bushcli.export.vibration import Vibration

MATRIX = np.diag([2500.0, 2500.0, 350.0, 4e5, 4e5, 9e4])
MATRIX[0, 4] = MATRIX[4, 0] = 120.0
Q = np.linspace(-4.0, 4.0, 17)
CURVES = (
    ForceCurve("radial", "radial", Q / 2, 2500 * Q / 2 + 90 * (Q / 2) ** 3),
    ForceCurve("axial", "axial", Q, 350 * Q + 4 * Q**3),
    ForceCurve("conical", "conical", np.radians(Q), 4e5 * np.radians(Q)),
    ForceCurve("twist", "torsional", np.radians(5 * Q), 9e4 * np.radians(5 * Q)),
)
# Hz
FREQUENCIES = np.array([0.5, 7.0, 300.0])


def vibrations(name="vibration"):
    """A dynamic stiffness of each direction whose parts are all different."""
    sizes = {("FX", "FY"): 2500.0, ("FZ",): 350.0, ("TX", "TY"): 4e5, ("TZ",): 9e4}
    return tuple(
        Vibration(
            name, directions, (0.1, 30.0), True, FREQUENCIES, size * (np.array([1.0, 1.25, 1.5]) + 0.1j)
        )
        for directions, size in sizes.items()
    )


def written(program, bushing, units="N-mm-s"):
    order = Order("12/22/40", "case.toml", unit_system(units), None, bushing)
    return writer_for(program).text(order).decode("ascii")


def teim_orbit(text):
    """Blocks of a TeimOrbit file: values by name, tables below their header in braces."""
    blocks = {}
    for line in text.splitlines():
        line = line.split("$")[0].strip()
        if not line:
            continue
        if line.startswith("["):
            block = blocks[line.strip("[]")] = {"table": []}
        elif "=" in line:
            name, value = (part.strip() for part in line.split("="))
            block[name] = value.strip("'")
        elif line.startswith("{"):
            block["heads"] = line.strip("{} ").split()
        elif line.startswith("("):
            block["sub"] = line
        else:
            block["table"].append(line.split())
    return blocks


@pytest.mark.parametrize(
    ("units", "length", "force"), [("N-mm-s", 1.0, 1.0), ("SI", 1e-3, 1.0), ("kN-mm-ms", 1.0, 1e-3)]
)
@pytest.mark.parametrize(("program", "block"), [("adams", "{}_CURVE"), ("altair", "SPLINE_STIFFNESS_{}")])
def test_property_files_have_the_curves(program, block, units, length, force):
    found = teim_orbit(written(program, BushingData(CURVES), units))
    assert found["UNITS"]["LENGTH"] == {1.0: "mm", 1e-3: "meter"}[length]
    assert found["UNITS"]["FORCE"] == {1.0: "newton", 1e-3: "knewton"}[force]
    by_mode = {curve.mode: curve for curve in CURVES}
    modes = {
        "FX": "radial",
        "FY": "radial",
        "FZ": "axial",
        "TX": "conical",
        "TY": "conical",
        "TZ": "torsional",
    }
    for direction, mode in modes.items():
        table = np.array(found[block.format(direction)]["table"], dtype=float)
        curve = by_mode[mode]
        turned = direction.startswith("T")
        q = np.radians(table[:, 0]) if turned else table[:, 0] / length
        at = table[:, 1] / (force * length if turned else force)
        assert np.all(np.diff(q) > 0)
        assert at == pytest.approx(np.interp(q, curve.displacement, curve.force), rel=1e-6, abs=1e-3)


def test_headers_are_those_that_the_programs_look_for():
    adams = teim_orbit(written("adams", BushingData(CURVES)))
    assert adams["MDI_HEADER"]["FILE_TYPE"] == "bus"
    assert adams["UNITS"]["ANGLE"] == "degrees"
    assert set(adams["DAMPING"]) == {"table", *(f"{d}_DAMPING" for d in ("FX", "FY", "FZ", "TX", "TY", "TZ"))}
    assert adams["FX_CURVE"]["heads"] == ["x", "fx"]
    altair = teim_orbit(written("altair", BushingData(CURVES)))
    assert altair["HEADER"]["FILE_TYPE"] == "gbs"
    assert altair["UNITS"]["ANGLE"] == "degree"
    assert altair["GLOBAL"]["COUPLING"] == "cylindrical"
    active = {row[0].strip("'"): row[1:] for row in altair["DIRECTIONS"]["table"]}
    assert active.pop("SPLINE_STIFFNESS") == ["1"] * 6
    assert all(row == ["0"] * 6 for row in active.values())
    assert altair["SPLINE_STIFFNESS_TZ"]["sub"] == "(SPLINE_DATA)"


def test_a_direction_without_a_curve_is_a_line_of_the_matrix_or_refused():
    with pytest.raises(InputError, match='mode = "conical"'):
        written("adams", BushingData(CURVES[:2]))
    text = written("adams", BushingData(CURVES[:2], MATRIX))
    table = np.array(teim_orbit(text)["TZ_CURVE"]["table"], dtype=float)
    assert table[:, 1] == pytest.approx(9e4 * np.radians(table[:, 0]))
    assert "$ TZ: a line of the stiffness matrix" in text


def test_loading_and_unloading_are_averaged_and_one_side_is_mirrored():
    there = np.linspace(0.0, 4.0, 41)
    loop = np.concatenate([there, there[::-1][1:]])
    up = 100.0 * there
    force = np.concatenate([up + 5.0, up[::-1][1:] - 5.0])
    q, mean = ForceCurve("axial", "axial", loop, force).single_valued()
    assert q.min() == -4.0
    assert q.max() == 4.0
    inside = (np.abs(q) > 0.2) & (np.abs(q) < 3.8)
    assert mean[inside] == pytest.approx(100.0 * q[inside], abs=1e-6)


@pytest.mark.parametrize(("units", "row", "column"), [("N-mm-s", 1.0, 1.0), ("SI", 1e-3, 1e-3)])
def test_the_matrix_for_chrono_runs(monkeypatch, units, row, column):
    text = written("chrono", BushingData((), MATRIX), units)

    class Matrix(dict):
        def __init__(self, rows, columns):
            assert (rows, columns) == (6, 6)

    stub = ModuleType("pychrono")
    stub.ChMatrixDynamicD = Matrix
    stub.ChLoadBodyBodyBushingGeneric = lambda *arguments: arguments
    monkeypatch.setitem(sys.modules, "pychrono", stub)
    module = {}
    exec(text, module)
    inner, outer, frame, stiffness, damping = module["bushing"]("inner", "outer", "frame", 0.01)
    assert (inner, outer, frame) == ("inner", "outer", "frame")
    # N/mm is 1e3 N/m; N mm/rad is 1e-3 N m/rad; N/rad stays.
    scale = np.array([1.0] * 3 + [row] * 3)[:, None] / np.array([column] * 3 + [1.0] * 3)
    expected = MATRIX * scale
    assert [[stiffness[i, j] for j in range(6)] for i in range(6)] == [pytest.approx(r) for r in expected]
    assert damping[0, 0] == pytest.approx(0.01 * expected[0, 0])


def test_json_has_all_curves_and_the_matrix():
    document = json.loads(written("json", BushingData(CURVES, MATRIX), "SI"))
    assert document["units"] == {
        "displacement": "m",
        "rotation": "rad",
        "force": "N",
        "moment": "N m",
        "time": "s",
    }
    axial = document["curves"][1]
    assert axial["displacement"] == pytest.approx(1e-3 * Q)
    assert axial["force"] == pytest.approx(CURVES[1].force)
    assert document["curves"][3]["force"] == pytest.approx(1e-3 * CURVES[3].force)
    values = np.array(document["stiffness_matrix"]["values"])
    assert values[2, 2] == pytest.approx(350e3)
    assert values[5, 5] == pytest.approx(90.0)


def test_curves_and_matrices_are_found_in_a_result():
    result = {
        "load_cases": [
            {"name": "axial", "mode": "axial", "displacement": [0, 1], "force": [0, 350], "time": None},
            {"name": "twist", "mode": "torsional", "displacement": [0, 90], "force": [0, 5], "time": [0, 1]},
            {"name": "path", "mode": "path", "motion": {}, "force": {"fx": [0.0]}},
            {"name": "x", "mode": "path", "stiffness_matrix": MATRIX.tolist()},
            {"name": "y", "mode": "path", "stiffness_matrix_start": (2 * MATRIX).tolist()},
        ]
    }
    axial, twist = curves_of(result)
    assert axial.force.tolist() == [0, 350]
    assert twist.displacement[1] == pytest.approx(np.pi / 2)
    assert matrix_of(result)[0] == pytest.approx(2 * MATRIX)
    assert matrix_of({"load_cases": []}) == (None, "")


def test_an_fmu_without_its_library_names_the_extra(monkeypatch):
    from bushcli.export.fmu.build import build

    monkeypatch.setitem(sys.modules, "pythonfmu.builder", None)
    with pytest.raises(InputError, match=r"bushcli\[fmu\]"):
        build({"name": "x", "channels": {}}, 2)


@pytest.mark.parametrize("program", [name for name, one in all_writers().items() if one.comment[0]])
@pytest.mark.parametrize("breaks", ["\n", "\r", "\r\n", "\x0b", "\x0c", "\x85", "\u2028"], ids=ascii)
def test_no_text_of_the_user_leaves_its_comment(program, breaks):
    """Title, path and names of channels with line breaks: the program would execute what follows them."""
    one, bad = writer_for(program), f"first{breaks}*INCLUDE, INPUT=harmful{breaks}--->"
    curves = tuple(replace(curve, name=bad) for curve in CURVES)
    rubber = ExportedRubber("neo_hookean", {"C10": 0.5}, 2000.0) if one.kind == "card" else None
    bushing = (
        None
        if rubber
        else BushingData(
            curves, MATRIX, (bad,), vibrations=vibrations("#" if program == "csv_dynamic" else bad)
        )
    )
    lines = one.text(Order(bad, bad, unit_system("SI"), rubber, bushing)).decode("ascii").splitlines()
    said = [line for line in lines if "INPUT=harmful" in line]
    begin, end = one.comment
    assert said
    assert all(line.startswith(begin) and line.endswith(end) for line in said)
    assert not end or not any("--" in line[len(begin) : -len(end)] for line in said)


def test_a_table_of_curves_has_one_row_per_point_whatever_the_channel_is_called():
    bushing = BushingData((replace(CURVES[0], name='a "b", c\nd'),))
    rows = list(csv.reader(io.StringIO(written("csv", bushing))))
    assert {len(row) for row in rows} == {5}
    assert {row[0] for row in rows[1:]} == {'a "b", c d'}
