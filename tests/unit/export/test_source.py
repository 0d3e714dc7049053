"""Laws and effects that an export reads from the results of other commands, converted to internal units."""

import json
import math

import pytest

from bushcli import report
from bushcli.case import case_json, load_case
from bushcli.errors import InputError
from bushcli.export import read_source
from bushcli.export.rubber import rubber_of

CASE = """
title = "found"
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[material]
law = "yeoh"
bulk_modulus = 2000.0
[[recordings]]
mode = "axial"
file = "axial.csv"
[[recordings]]
mode = "torsional"
file = "torsional.csv"
[[effects]]
name = "viscoelasticity"
[[effects]]
name = "free_play"
channels = ["axial"]
[[effects]]
name = "free_play"
channels = ["torsional"]
"""
AXIAL = "time_s,displacement_mm,force_N\n" + "".join(f"{i},{i * 0.1:.1f},{i * 35}\n" for i in range(20))
TWIST = "time_s,rotation_deg,moment_Nmm\n" + "".join(f"{i},{i * 0.5:.1f},{i * 900}\n" for i in range(20))


@pytest.fixture
def case(tmp_path):
    (tmp_path / "axial.csv").write_text(AXIAL)
    (tmp_path / "torsional.csv").write_text(TWIST)
    (tmp_path / "case.toml").write_text(CASE)
    return load_case(tmp_path / "case.toml")


def saved(folder, result):
    out = folder / "out"
    out.mkdir()
    (out / "result.json").write_text(json.dumps(result))
    return out


def test_an_identified_law_with_its_effects(case, tmp_path):
    values = {"C10": 0.6, "C20": -0.04, "C30": 0.02, "compliance": 1e-3}
    values |= {"viscoelasticity.g1": 0.3, "viscoelasticity.tau1": 7.0}
    values |= {"free_play.half_width": 0.05, "free_play@torsional.half_width": 0.9}
    result = {
        "command": "inverse",
        "case": case_json(case),
        "versions": {},
        "law": "yeoh",
        "bulk_modulus": 1000.0,
        "parameters": {name: {"value": value} for name, value in values.items()},
    }
    found = read_source(saved(tmp_path, result)).case
    assert found.material.parameters == {"C10": 0.6, "C20": -0.04, "C30": 0.02}
    assert found.material.bulk_modulus == 1000.0
    by_name = {one.name: one.values for one in found.effects}
    assert by_name["viscoelasticity"] == {"g1": 0.3, "tau1": 7.0}
    assert by_name["free_play"] == {"half_width": 0.05}
    # Degrees outside, radians inside.
    assert by_name["free_play@torsional"] == {"half_width": pytest.approx(math.radians(0.9))}
    rubber = rubber_of(found.material, found.effects)
    assert rubber.series == ((0.3, 7.0),)
    assert rubber.beside == ("free_play", "free_play@torsional")


def test_another_law_than_the_cases(case, tmp_path):
    result = {
        "command": "fit",
        "case": case_json(case) | {"effects": []},
        "versions": {},
        "law": "gent",
        "bulk_modulus": "inf",
        "parameters": {"mu": {"value": 0.9}, "Jm": {"value": 25.0}},
    }
    found = read_source(saved(tmp_path, result)).case.material
    assert found.law == "gent"
    assert found.parameters == {"mu": 0.9, "Jm": 25.0}
    assert math.isinf(found.bulk_modulus)


def test_the_most_probable_model_of_a_diagnosis(case, tmp_path, diagnoses):
    found = diagnoses.diagnosis(case, "missing_physics")
    out = saved(tmp_path, report.as_json(found))
    source = read_source(out).case
    assert source.material.law == found.material.law
    assert source.material.parameters == pytest.approx(dict(found.material.parameters))
    by_name = {one.name: one.values for one in source.effects}
    assert set(by_name) == {one.name for one in found.effects}
    for one in found.effects:
        for name, quantity in one.parameters.items():
            assert by_name[one.name][name] == pytest.approx(quantity.value)


def test_an_effect_without_a_value_is_refused(case, tmp_path):
    with pytest.raises(InputError, match="viscoelasticity"):
        read_source(case.path)


def test_files_that_are_gone_are_missed_only_where_they_are_read(case, tmp_path):
    material = {"law": "yeoh", "bulk_modulus": 2000.0, "parameters": {"C10": 0.5, "C20": 0.0, "C30": 0.0}}
    result = {
        "command": "direct",
        "case": case_json(case) | {"effects": []},
        "versions": {},
        "material": material,
        "load_cases": [],
    }
    out = saved(tmp_path, result)
    (tmp_path / "axial.csv").unlink()
    assert read_source(out).case.material.parameters["C10"] == 0.5


def test_a_spoiled_result_is_refused(tmp_path):
    out = saved(tmp_path, {})
    (out / "result.json").write_text("{")
    with pytest.raises(InputError, match="cannot be read"):
        read_source(out)
    (out / "result.json").write_text('{"command": "direct", "case": {"title": "x"}}')
    with pytest.raises(InputError):
        read_source(out)
