"""Dynamic stiffness for other programs, read back by readers of the formats, against `bushcli dynamic` itself."""

import csv
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.errors import InputError
from bushcli.export import Order, read_source, unit_system, writer_for
from bushcli.export.bushing import bushing_of
from bushcli.export.curves import BushingData
from bushcli.export.vibration import FORCES
from bushcli.report.json.dynamic import dynamic_json
from bushcli.report.results import DynamicResult
from bushcli.simulate.dynamic import vibrate
from tests.unit.export.test_vehicle import FREQUENCIES, vibrations, written

CASE = """
title = "12/22/40"
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 2
elements_along = 6
[material]
law = "yeoh"
bulk_modulus = 2000.0
parameters = { C10 = 0.5, C20 = -0.05, C30 = 0.01 }
[[effects]]
name = "viscoelasticity"
parameters = { g1 = 0.25, tau1 = 0.3, g2 = 0.2, tau2 = 0.002 }
"""
GAIN = """
[[effects]]
name = "gain"
parameters = { error = 0.05 }
"""
AXIAL = """
[[load_cases]]
mode = "axial"
[load_cases.dynamic]
preload = [1.0, 3.0]
frequency = [100, 1]
"""
TORSIONAL = AXIAL.replace("axial", "torsional").replace("[1.0, 3.0]", "[4.0]")
POSE = """
[[load_cases]]
mode = "path"
steps = 2
[load_cases.path]
time = [0.0, 1.0]
ux = [0.0, 1.0]
uz = [0.0, 2.0]
[load_cases.dynamic]
frequency = [1, 100]
"""


def nastran(text):
    """PBUSH, and the tables that PBUSHT names: K(f) and B(f) of six directions, in the units of the file.

    Entries are in fixed fields of 8, or of 16 where the name or a continuation has an asterisk (Altair OptiStruct help,
    Bulk Data Guidelines, PBUSH, PBUSHT, TABLED1).
    """
    entries = []
    for line in text.splitlines():
        if line.startswith("$"):
            continue
        assert len(line) <= 72
        width, head = (16, line[:8].rstrip("* ")) if "*" in line[:8] else (8, line[:8].strip())
        count = 64 // width
        fields = [line[8 + width * i : 8 + width * (i + 1)].strip() for i in range(count)]
        if head:
            entries.append((head, []))
        entries[-1][1].extend(fields)
    (nominal,) = [fields for head, fields in entries if head == "PBUSH"]
    (named,) = [fields for head, fields in entries if head == "PBUSHT"]
    assert nominal[0] == named[0]
    tables = {}
    for head, fields in entries:
        if head == "TABLED1":
            assert fields[1:3] == ["LINEAR", "LINEAR"]
            numbers = fields[8 : fields.index("ENDT")]
            assert all("." in number for number in numbers)
            tables[fields[0]] = np.array(numbers, dtype=float).reshape(-1, 2)
    found = {}
    for kind, at in (("K", 1), ("B", 9)):
        assert nominal[at] == named[at] == kind
        found[kind] = [tables[number] for number in named[at + 1 : at + 7]]
        assert [float(value) for value in nominal[at + 1 : at + 7]] == [one[0, 1] for one in found[kind]]
    return found["K"], found["B"]


@pytest.mark.parametrize("units", ["N-mm-s", "SI", "kN-mm-ms", "lbf-in-s"])
def test_nastran_vibrates_as_the_bushing(units):
    """K + i omega B of each direction, in N, m and s."""
    system = unit_system(units)
    stiffness, damping = nastran(written("nastran", BushingData((), vibrations=vibrations()), units))
    expected = {direction: one for one in vibrations() for direction in one.directions}
    for direction, k, b in zip(FORCES, stiffness, damping, strict=True):
        hertz = k[:, 0] / system.time
        assert hertz == pytest.approx(FREQUENCIES)
        assert (k[:, 0] == b[:, 0]).all()
        per = system.force * (system.length if direction.startswith("T") else 1 / system.length)
        found = per * (k[:, 1] + 1j * 2 * np.pi * hertz * system.time * b[:, 1])
        to_metres = 1e-3 if direction.startswith("T") else 1e3
        assert found == pytest.approx(to_metres * expected[direction].stiffness, rel=1e-7)


def test_a_table_of_dynamic_stiffness_is_complete():
    text = written("csv_dynamic", BushingData((), vibrations=vibrations()), "SI")
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    assert [row["direction"] for row in rows[::3]] == list(FORCES)
    for row in rows:
        k = float(row["storage"]) + 1j * float(row["loss"])
        assert abs(k) == pytest.approx(float(row["stiffness"]))
        assert np.degrees(np.angle(k)) == pytest.approx(float(row["loss_angle_deg"]))
        assert 2 * np.pi * float(row["frequency"]) * float(row["damping"]) == pytest.approx(k.imag)
    axial = next(row for row in rows if row["direction"] == "FZ")
    assert (axial["preload_displacement"], axial["preload_force"], axial["storage"]) == (
        "0.0001",
        "30",
        "350000",
    )


def test_stiffness_at_an_amplitude_says_which():
    (first, *_) = vibrations()
    small, large = (replace(first, amplitude=one) for one in (0.1, 2.0))
    text = written("csv_dynamic", BushingData((), vibrations=(first, small, large)), "SI")
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    assert list(dict.fromkeys(row["amplitude"] for row in rows)) == ["", "0.0001", "0.002"]
    assert "0.1 mm" in small.state


@pytest.fixture
def case(tmp_path):
    def made(*load_cases):
        file = tmp_path / "case.toml"
        file.write_text(CASE + "".join(load_cases))
        return file

    return made


def saved(folder, response):
    folder.mkdir()
    (folder / "result.json").write_text(json.dumps(dynamic_json(DynamicResult(response)), default=list))
    return folder


@pytest.mark.parametrize("load_cases", [(AXIAL, TORSIONAL, GAIN), (POSE,)], ids=["modes", "pose"])
def test_a_case_and_the_folder_of_dynamic_give_the_same(case, tmp_path, load_cases):
    source = read_source(case(*load_cases))
    simulated = bushing_of(source, writer_for("csv_dynamic"))
    folder = saved(tmp_path / "out", vibrate(source.case))
    kept = bushing_of(read_source(folder), writer_for("csv_dynamic"))
    assert written("csv_dynamic", simulated) == written("csv_dynamic", kept)
    assert kept.remarks == simulated.remarks
    (first, *_, last) = kept.vibrations
    assert (np.diff(first.frequency) > 0).all()
    if load_cases == (POSE,):
        assert [one.directions for one in kept.vibrations] == [(one,) for one in FORCES]
        assert "only the diagonal" in kept.remarks[0]
        assert nastran(written("nastran", kept))[0][5][:, 0] == pytest.approx([1, 100])
    else:
        assert "without gain" in kept.remarks[0]
        (curve,) = [one for one in vibrate(source.case).curves if one.mode == "torsional"]
        assert last.stiffness == pytest.approx(curve.stiffness[::-1])
        assert last.static == pytest.approx((np.radians(4.0), curve.force))


def test_a_law_that_was_fitted_is_that_of_the_folder(case, tmp_path):
    source = read_source(case(AXIAL))
    fitted = replace(source.case.material, parameters={"C10": 0.6, "C20": 0.0, "C30": 0.0})
    bare = replace(source.case, material=replace(source.case.material, parameters={}))
    kept = read_source(saved(tmp_path / "out", vibrate(bare, fitted)))
    assert kept.case.material.parameters == fitted.parameters
    assert not kept.case.needs_fit


def test_what_was_simulated_with_an_effect_is_not_exported_without_it(case, tmp_path):
    source = read_source(case(AXIAL, GAIN))
    kept = read_source(saved(tmp_path / "out", vibrate(source.case)))
    assert len(kept.vibrations) == 2
    assert not kept.without(["gain"]).vibrations


@pytest.mark.parametrize("spoiled", [[1.0, 2.0, 3.0], None, "x"])
def test_a_spoiled_result_of_dynamic_is_refused(case, tmp_path, spoiled):
    folder = saved(tmp_path / "out", vibrate(read_source(case(TORSIONAL)).case))
    result = json.loads((folder / "result.json").read_text())
    result["load_cases"][0]["loss"] = spoiled
    (folder / "result.json").write_text(json.dumps(result))
    with pytest.raises(InputError, match="is not a complete result"):
        read_source(folder)


def test_a_direction_without_stiffness_is_refused(case):
    source = read_source(case(AXIAL, TORSIONAL))
    order = Order("x", "x", unit_system("SI"), None, bushing_of(source, writer_for("nastran")))
    with pytest.raises(InputError, match=r'FX, FY, TX, TY.*mode = "radial" and mode = "conical"'):
        writer_for("nastran").text(order)


def test_one_frequency_is_no_table_of_nastran():
    (one, *rest) = vibrations()
    short = SimpleNamespace(**vars(one), rotational=False, damping=one.damping[:1], state="x")
    short.frequency, short.stiffness = one.frequency[:1], one.stiffness[:1]
    with pytest.raises(InputError, match="FX has one frequency"):
        written("nastran", BushingData((), vibrations=(short, *rest)))


def test_without_vibrations_there_is_nothing_to_export(case):
    static = '[[load_cases]]\nmode = "axial"\namplitude = 1.0\nrate = 1.0\n'
    with pytest.raises(InputError, match=r"has no vibrations.*load_cases.dynamic"):
        bushing_of(read_source(case(static)), writer_for("nastran"))
    with pytest.raises(InputError, match="only load cases with vibrations"):
        bushing_of(read_source(case(AXIAL)), writer_for("csv"))
