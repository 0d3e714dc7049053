"""Case files: every key is validated; errors say what is wrong, where, what was expected, and the nearest value."""

import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bushcli.case import Case, case_json, load_case
from bushcli.case.effects import DeclaredChannel, build
from bushcli.case.schema import EffectTable
from bushcli.effects.active import effects_on_channel, uniquely_named
from bushcli.effects.effect import effect
from bushcli.errors import CaseError, InputError
from bushcli.recording.table_cache import TableCache
from forms.law import laws

CASE = """
title = "plain bushing"

[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0

[geometry.inner_sleeve]
thickness = 3.0

[mesh]
elements_across = 6

[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.5
C20 = -0.05
C30 = 0.01

[[load_cases]]
mode = "axial"
amplitude = 8.0
steps = 10

[[load_cases]]
mode = "torsional"
path = [0, 30, -30]
rate = 2

[[recordings]]
mode = "axial"
file = "axial.csv"
cycles = [3, 1]
delimiter = "semicolon"

[[coupons]]
mode = "uniaxial"
file = "tests/uniaxial.csv"
columns = { stretch = 3, stress = "Spannung" }
units = { strain = "percent" }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "tests").mkdir()
    (tmp_path / "axial.csv").touch()
    (tmp_path / "tests" / "uniaxial.csv").touch()
    return tmp_path


def write(folder: Path, text: str | bytes = CASE) -> Path:
    path = folder / "case.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def load(folder: Path, text: str | bytes = CASE, *overrides: str) -> Case:
    return load_case(write(folder, text), overrides)


def problems(folder: Path, text: str | bytes = CASE, *overrides: str) -> list[str]:
    path = write(folder, text)
    with pytest.raises(CaseError) as caught:
        load_case(path, overrides)
    assert caught.value.exit_code == 2
    return [str(problem).replace(str(path), "case.toml") for problem in caught.value.problems]


def outcome(path: Path, *overrides: str) -> tuple[Case | None, str]:
    """Return the case, or the message with which it is refused; any other exception fails the test."""
    try:
        return load_case(path, overrides), ""
    except CaseError as error:
        return None, str(error)


def test_a_case_is_read(folder):
    case = load(folder)
    assert case.title == "plain bushing"
    assert (case.geometry.name, case.geometry.inner_radius) == ("plain", 12.0)
    assert case.geometry.inner_sleeve.youngs_modulus == 70000.0
    assert case.geometry.outer_sleeve is None
    assert case.mesh.refinement.across == 6
    assert case.mesh.refinement.along is None
    assert case.material.parameters == {"C10": 0.5, "C20": -0.05, "C30": 0.01}
    assert case.material.parameter_names == ("C10", "C20", "C30")
    assert not case.needs_fit
    axial, torsional = case.load_cases
    assert (axial.path, axial.steps, axial.rate) == ((0.0, 8.0), 10, None)
    np.testing.assert_allclose(torsional.path, [0, math.pi / 6, -math.pi / 6])
    assert torsional.rate == pytest.approx(math.radians(2))
    assert torsional.steps == 20
    recording, coupon = case.recordings[0], case.coupons[0]
    assert (recording.file, recording.name) == (folder / "axial.csv", "axial")
    assert (recording.cycles, recording.delimiter) == ((1, 3), ";")
    assert coupon.columns == {"displacement": 3, "force": "Spannung"}
    assert coupon.units == {"displacement": "percent"}


def test_the_smallest_case_has_sensible_defaults(folder):
    case = load(
        folder,
        '[geometry]\nshape = "coupon"\n[material]\nlaw = "gent"\nparameters = {mu = 1, Jm = 50}\n'
        '[[load_cases]]\nmode = "uniaxial"\namplitude = 1\n',
    )
    assert case.title == "case"
    assert case.material.bulk_modulus == math.inf
    assert case.load_cases[0].steps == 20
    assert case.recordings == case.coupons == ()


def test_a_path_starts_at_rest(folder):
    case = load(folder, CASE, "load_cases.0={mode = 'axial', path = [2, -2]}")
    assert case.load_cases[0].path == (0.0, 2.0, -2.0)


def test_a_program_may_be_a_file(folder):
    case = load(folder, CASE, "load_cases.0={mode = 'axial', file = 'axial.csv'}")
    assert case.load_cases[0].path == ()
    assert case.load_cases[0].source.file == folder / "axial.csv"
    assert case_json(case)["load_cases"][0] == {"mode": "axial", "steps": 20, "file": "axial.csv"}


def test_channels_have_unique_names(folder):
    second = '\n[[recordings]]\nmode = "axial"\nfile = "axial.csv"\ncycles = [2]\n'
    assert [r.name for r in load(folder, CASE + second).recordings] == ["axial", "axial_2"]
    named = problems(folder, CASE + second + 'name = "axial"\n')
    assert named == ['case.toml: recordings[1].name = "axial" is the name of another channel']
    (again,) = problems(folder, CASE + second.replace("[2]", "[2, 3]"))
    assert 'recordings[1].file = "axial.csv" lists the recording of axial a second time' in again


def test_numbered_load_case_leaves_the_names_of_recordings(folder):
    case = load(
        folder, CASE + '[[recordings]]\nname = "axial-1"\nfile = "axial.csv"\nmode = "axial"\ncycles = [2]\n'
    )
    assert [r.name for r in case.recordings] == ["axial", "axial-1"]
    assert [load_case.name for load_case in case.load_cases] == ["axial-1_2", "torsional"]


def test_resolved_is_json_in_the_units_of_the_case_file(folder):
    shown = case_json(load(folder, CASE, "material.bulk_modulus=inf"))
    assert json.loads(json.dumps(shown, allow_nan=False)) == shown
    assert shown["material"]["bulk_modulus"] == "inf"
    assert shown["load_cases"][1] == {"mode": "torsional", "steps": 20, "path": [0, 30, -30], "rate": 2}
    assert shown["geometry"]["shape"] == "plain"
    assert shown["geometry"]["inner_sleeve"]["poissons_ratio"] == 0.33
    assert shown["recordings"][0]["file"] == "axial.csv"
    assert shown["coupons"][0]["file"] == "tests/uniaxial.csv"
    assert shown["mesh"] == {"elements_across": 6, "elements_along": None, "elements_around": None}


def test_a_case_without_parameters_needs_a_fit(folder):
    case = load(folder, CASE, "material.parameters={}")
    assert case.needs_fit
    assert case.material.parameter_names == ("C10", "C20", "C30")
    without = problems(folder, CASE, "material={law = 'yeoh'}", "coupons=[]", "recordings=[]")
    assert "material.parameters are not given, and there are neither coupons nor recordings" in without[0]
    assert "(C10, C20, C30; or [[coupons]] or [[recordings]])" in without[0]


def test_terms_choose_the_parameters_to_fit(folder):
    case = load(folder, CASE, "material={law = 'ogden', terms = 2}")
    assert case.material.parameter_names == ("mu1", "alpha1", "mu2", "alpha2")
    two = load(folder, CASE, "material={law = 'ogden', parameters = {mu1 = 0.4, alpha1 = 2.0}}")
    assert two.material.parameter_names == ("mu1", "alpha1")
    assert "ogden has 1 to 3" in problems(folder, CASE, "material={law = 'ogden', terms = 4}")[0]
    assert "has no terms" in problems(folder, CASE, "material={law = 'yeoh', terms = 1}")[0]
    assert "material.terms" in problems(folder, CASE, "material.law=ogden", "material.terms=1")[0]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "material.law=yeho",
            f'material.law = "yeho" is not a law; did you mean "yeoh"? ({", ".join(laws())})',
        ),
        ("geometry.shape=plane", 'geometry.shape = "plane" is not a shape; did you mean "plain"?'),
        ("geometry.legnth=38", 'is not a key of [geometry] with shape "plain"; did you mean "length"?'),
        ("geometri.length=38", 'geometri is not a key of a case file; did you mean "geometry"?'),
        ("geometry.length=0", "geometry.length = 0 must be greater than 0"),
        ("geometry.length=-3.5", "geometry.length = -3.5 must be greater than 0"),
        ("geometry.length=true", "geometry.length = true is not a number"),
        ("geometry.length=38mm", 'geometry.length = "38mm" is not a number'),
        ("geometry.length=38,5", 'geometry.length = "38,5" is not a number'),
        ("geometry.length=[38]", "geometry.length = [38] is not a number"),
        ("geometry.length=1979-05-27", "geometry.length = 1979-05-27 is not a number"),
        ("geometry.length=nan", "geometry.length = nan is not a usable number"),
        ("geometry.length=-inf", "geometry.length = -inf is not a usable number"),
        (
            "geometry.length=1" + "0" * 200,
            "geometry.length = a number of more than 20 digits is not a usable number",
        ),
        ("geometry.inner_radius=22", "inner_radius"),
        ("geometry=5", "geometry = 5 is not a table of keys"),
        ("geometry.inner_sleeve=rigid", 'geometry.inner_sleeve = "rigid" is not a table of keys'),
        (
            "geometry.outer_sleeve.youngs_modulus=1",
            "geometry.outer_sleeve.thickness is missing (radial thickness",
        ),
        ("geometry.inner_sleeve.poissons_ratio=0.5", "must be less than 0.5"),
        ("mesh.elements_across=1", "mesh.elements_across = 1 must be at least 2"),
        ("mesh.elements_across=6.5", "mesh.elements_across = 6.5 is not a whole number"),
        ("mesh.elements_acros=6", 'did you mean "elements_across"?'),
        ("material.bulk_modulus=0", "material.bulk_modulus = 0 must be greater than 0"),
        ("material.bulk_modulus=nan", "material.bulk_modulus = nan is not a usable number"),
        (
            "material.parameters.C1=1",
            'material.parameters.C1 is not a parameter of yeoh; did you mean "C10"?',
        ),
        ("material.parameters.C10=-0.5", "material.parameters.C10 = -0.5 is out of bounds ("),
        ("material.parameters.C10=soft", 'material.parameters.C10 = "soft" is not a number'),
        ("material.parameters={C10=1,C20=0}", "material.parameters.C30 is missing (yeoh:"),
        ("material.parameters=[1,2]", "material.parameters = [1, 2] is not a table of keys"),
        ("load_cases.0.mode=axail", 'load_cases[0].mode = "axail" is not a mode; did you mean "axial"?'),
        (
            "load_cases[0].mode=uniaxial",
            'is a mode of a coupon, but shape "plain" is a bushing (axial, conical',
        ),
        (
            "load_cases.0.amplitud=5",
            'load_cases[0].amplitud is not a key of [[load_cases]]; did you mean "amplitude"',
        ),
        (
            "load_cases.0.path=[0,1]",
            "load_cases[0] has amplitude and path (give one of amplitude, path, file, force",
        ),
        ("load_cases.0={mode='axial'}", "load_cases[0] has no program"),
        ("load_cases.0={amplitude=1}", "load_cases[0].mode is missing"),
        ("load_cases.0.amplitude=0", "load_cases[0].amplitude = 0.0 stands still"),
        ("load_cases.0.steps=0", "load_cases[0].steps = 0 must be at least 1"),
        (
            "load_cases.0={mode='radial',amplitude=-10}",
            "closes the gap between the sleeves (a displacement below the rubber's",
        ),
        (
            "load_cases.0={mode='conical',amplitude=31}",
            "amplitude = 31 moves an end of the sleeve by 10.3 mm, which closes the gap between the sleeves",
        ),
        (
            "load_cases.0={mode='axial',amplitude=300}",
            "load_cases[0].amplitude = 300 is 30 times the rubber's thickness (at most 100 mm",
        ),
        ("load_cases.1.path=[3]", "load_cases[1].path = [3] needs at least 2 entries"),
        ("load_cases.1.path=[0,5,5]", "load_cases[1].path = [0.0, 5.0, 5.0] stands still"),
        ("load_cases.1.path=[0,x]", 'load_cases[1].path = "[0,x]" is not a list'),
        ("load_cases.1.path=[0,'x']", 'load_cases[1].path[1] = "x" is not a number'),
        ("load_cases.1.path=[0,200]", "turns the sleeve by more than 180 degrees"),
        ("load_cases.1.rate=0", "load_cases[1].rate = 0 must be greater than 0"),
        ("load_cases={mode='axial'}", "load_cases is not a list of tables (write [[load_cases]])"),
        ("load_cases=[1]", "load_cases[0] = 1 is not a table of keys (write [[load_cases]])"),
        (
            "recordings.0.file=axail.csv",
            'recordings[0].file = "axail.csv" does not exist; did you mean "axial.csv"?',
        ),
        ("recordings.0.file=tests", 'recordings[0].file = "tests" is a directory'),
        ("recordings.0.file=nowhere/x.csv", "does not exist"),
        ("recordings.0.file=''", 'recordings[0].file = "" must not be empty'),
        ("recordings.0.cycles=[0]", "recordings[0].cycles[0] = 0 must be at least 1"),
        ("recordings.0.cycles=[]", "recordings[0].cycles = [] needs at least 1 entries"),
        ("recordings.0.decimal=';'", 'recordings[0].decimal = ";" is not allowed (".", ",")'),
        (
            "recordings.0.units.force=knn",
            'is not a unit of force for mode axial; did you mean "kN"? (N, kN, lbf)',
        ),
        ("recordings.0.units.displacement=deg", "is not a unit of displacement for mode axial"),
        ("recordings.0.columns.force=0", "neither the name of a column nor its number, counted from 1"),
        ("recordings.0.columns.weg=1", "recordings[0].columns.weg is not a key of"),
        ("coupons.0.columns.strain=1", "is given twice, under two of its names"),
        ("coupons.0.mode=axial", "is a mode of a bushing, but [[coupons]] is a coupon (equibiaxial, planar"),
        (
            "effects=[{name='mulins'}]",
            'effects[0].name = "mulins" is not an effect; did you mean "mullins"? (batch',
        ),
        ("effects.mulins.r=3", 'effects[0].name = "mulins" is not an effect; did you mean "mullins"?'),
        ("effects=[{parameters={r=3}}]", "effects[0].name is missing (an effect, see bushcli list effects)"),
        ("effects={name='mullins'}", "effects is not a list of tables (write [[effects]])"),
        ("effects=[{name='mullins', r=3}]", "effects[0].r is not a key of [[effects]]"),
        (
            "effects.mullins.R=3",
            'effects[0].parameters.R is not a parameter of mullins; did you mean "r"? (r, inv',
        ),
        (
            "effects.mullins={r=3, inverse_r=0.3}",
            "effects[0].parameters.inverse_r is given twice: inverse_r is 1/r",
        ),
        ("effects.mullins.r=1", "effects[0].parameters.r = 1.0 is out of bounds (at least 1.05263)"),
        ("effects.mullins.r=0", "effects[0].parameters.r = 0.0 is out of bounds (at least 1.05263)"),
        ("effects.mullins.inverse_r=2", "effects[0].parameters.inverse_r = 2.0 is out of bounds (0 to 0.95)"),
        ("effects.mullins.r=strong", 'effects[0].parameters.r = "strong" is not a number'),
        ("effects.rig_compliance.stiffness=1", "stiffness = 1.0 is out of bounds (at least 10 N/mm)"),
        (
            "effects=[{name='mullins'}, {name='mullins'}]",
            'effects[1].name = "mullins" is given twice (list each effect once; channels = [...] says',
        ),
        (
            "effects=[{name='free_play', channels=['axial-1']}, {name='free_play', channels=['axial-1']}]",
            'effects[1].name = "free_play" is given twice (list different channels in the two entries',
        ),
        (
            "effects=[{name='free_play', channels=['axial-1']}, {name='free_play'}]",
            'effects[1].name = "free_play" is given twice (list different channels in the two entries',
        ),
        (
            "effects=[{name='debonding'}]",
            'effects[0].name = "debonding": the effect cannot be combined with an elastic inner_sleeve (make it rigid)',
        ),
        (
            "effects=[{name='mullins', channels=['axail']}]",
            'effects[0].channels[0] = "axail" is not a channel; did you mean "axial"? '
            "(axial-1, torsional, axial, uniaxial)",
        ),
        ("effects=[{name='mullins', channels=[]}]", "effects[0].channels = [] needs at least 1 entries"),
        (
            "effects=[{name='rig_compliance', channels=['torsional']}]",
            'effects[0].channels[0] = "torsional": rig_compliance does not act on mode torsional (axial, radial)',
        ),
        (
            "effects=[{name='free_play'}]",
            "effects[0]: free_play acts on axial-1 in mm and on torsional in degrees (list channels of one kind only",
        ),
        (
            "effects=[{name='free_play', channels=['torsional'], parameters={half_width=-1}}]",
            "half_width = -1.0 is out of bounds (0 to 5729.58 degrees)",
        ),
        (
            "effects=[{name='time_lag'}]",
            'effects[0].name = "time_lag" needs time, but load_cases[0] has none (give it a rate, or leave',
        ),
        ("title=5", "title = 5 is not a text in quotes"),
    ],
)
def test_each_mistake_is_told(folder, override, message):
    """All problems concern the override, and are attributed to it."""
    found = problems(folder, CASE, override)
    assert any(message in problem for problem in found), found
    assert all(problem.startswith((f"--set {override}: ", "case.toml: ")) for problem in found)
    if "inner_radius" not in override:
        assert found[0].startswith("--set")


def test_the_same_mistake_in_the_file_names_the_file(folder):
    found = problems(folder, CASE.replace('"yeoh"', '"yeho"'))
    known = ", ".join(laws())
    assert found == [f'case.toml: material.law = "yeho" is not a law; did you mean "yeoh"? ({known})']


def test_all_mistakes_are_told_together(folder):
    text = CASE.replace("length", "lenght").replace("0.5", '"0.5"').replace("axial.csv", "axail.csv")
    text = text.replace("steps = 10", "steps = 1.5").replace("[mesh]", "[meshes]")
    found = "\n".join(problems(folder, text))
    for key in (
        "geometry.lenght",
        "geometry.length",
        "material.parameters.C10",
        "load_cases[0].steps",
        "meshes",
    ):
        assert key in found
    assert "recordings[0].file" in found


def test_volumetric_needs_a_compressible_rubber(folder):
    text = CASE.replace('mode = "uniaxial"', 'mode = "volumetric"\nname = "bulk"')
    assert load(folder, text).coupons[0].mode == "volumetric"
    # From a coupon the bulk modulus is identified; a load case cannot be simulated without one.
    assert load(folder, text, "material.bulk_modulus=inf").coupons[0].mode == "volumetric"
    alone = text.replace('shape = "plain"', 'shape = "coupon"')
    load_case = 'load_cases=[{mode = "volumetric", amplitude = -0.01}]'
    found = problems(folder, alone, "material.bulk_modulus=inf", load_case)
    assert any(
        'load_cases[0].mode = "volumetric" needs a finite material.bulk_modulus' in one for one in found
    )


def test_an_unstable_rubber_is_refused(folder):
    found = problems(folder, CASE, "material={law = 'mooney_rivlin', parameters = {C10 = 0.1, C01 = -0.3}}")
    # mu = 2 (C10 + C01) = -0.4 MPa; the law's bounds decide which of the two problems is reported.
    assert "initial shear modulus of -0.4 MPa" in found[0] or "out of bounds" in found[0]


def test_leftover_parameters_of_another_law_are_explained(folder):
    found = problems(folder, CASE, "material.law=neo_hookean")
    assert "material.parameters.C20 is not a parameter of neo_hookean" in found[0]
    assert found[-1].startswith("--set material.law=neo_hookean: changes the law, but")
    assert "also give --set material.parameters={...}" in found[-1]
    case = load(folder, CASE, "material.law=neo_hookean", "material.parameters={C10=0.4}")
    assert case.material.parameters == {"C10": 0.4}


def test_overrides_change_and_create(folder):
    case = load(
        folder,
        CASE,
        "geometry.length = 38",
        "load_cases[0].amplitude=5",
        "load_cases.1.steps=7",
        "geometry.outer_sleeve.thickness=2",
        "title=a = b",
        "material.bulk_modulus=inf",
    )
    assert case.geometry.length == 38.0
    assert case.load_cases[0].path == (0.0, 5.0)
    assert case.load_cases[1].steps == 7
    assert case.geometry.outer_sleeve.thickness == 2.0
    assert case.title == "a = b"
    assert case.material.bulk_modulus == math.inf


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("geometry.length", "is not KEY=VALUE (e.g. geometry.length=38)"),
        ("=5", "is not KEY=VALUE"),
        ("", "is not KEY=VALUE"),
        ("geometry..length=5", "is not KEY=VALUE"),
        ("geometry[=5", "is not KEY=VALUE"),
        ("load_cases.5.amplitude=1", "load_cases[5] does not exist (load_cases has entries 0 to 1)"),
        ("recordings[1].file=x", "recordings[1] does not exist (recordings has one entry, 0)"),
        (
            "load_cases.amplitude=1",
            "load_cases is a list (give the number of the entry: load_cases.0.amplitude)",
        ),
        (
            "load_cases.-1.amplitude=1",
            "load_cases[-1] does not exist: entries are counted from 0 (load_cases has entries 0 to 1)",
        ),
        (
            "load_cases.torsional.amplitude=1",
            "load_cases is a list (give the number of the entry: load_cases.1.amplitude)",
        ),
        ("effects.0.name=x", "the case has no effects"),
        ("load_case.0.mode=radial", 'the case has no load_case; did you mean "load_cases"?'),
        ("geometry.length.x=1", "geometry.length = 40.0 has no keys"),
    ],
)
def test_impossible_overrides(folder, override, message):
    found = problems(folder, CASE, override)
    assert message in found[0]
    assert found[0].startswith(f"--set {override}:")


def test_a_line_break_cannot_smuggle_in_keys(folder):
    assert load(folder, CASE, "title=1\nfoo = 2").title == "1\nfoo = 2"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[geometry]\nshape = "plain"\nlength = 4,0\n', "case.toml:3:11: is not valid TOML"),
        ("[geometry]\nlength = \n", "case.toml:2:10: is not valid TOML: Invalid value (in: length =)"),
        ("a = 1\na = 2\n", "case.toml:2:6: is not valid TOML: Cannot overwrite a value"),
        ("[geometry\n", "case.toml:1:10: is not valid TOML"),
        ('a = 1\ntitle = "open', "case.toml:2:14: is not valid TOML: Unterminated string (in: title"),
        (b"title = '\x00\xff\xfe'\n", "case.toml: is not a text file"),
        ("x = " + "[" * 5000, "case.toml: has too many brackets inside each other"),
        ("x = 1" + "0" * 5000, "case.toml: has a number of 5001 digits"),
        ("", "case.toml: [geometry] is missing"),
    ],
)
def test_what_is_no_case_file(folder, text, message):
    assert problems(folder, text)[0].startswith(message)


def test_a_byte_order_mark_is_no_mistake(folder):
    assert load(folder, b"\xef\xbb\xbf" + CASE.encode()).title == "plain bushing"


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-16-le", "utf-16-be"])
def test_a_case_file_in_another_encoding_is_read(folder, encoding):
    assert load(folder, CASE.replace("plain bushing", "Prüfling 3").encode(encoding)).title == "Prüfling 3"


@pytest.mark.parametrize(
    ("line", "better"),
    [
        ("title = \u201cPart 7\u201d", 'title = "Part 7"'),
        ("title = \u201ePart 7\u201c", 'title = "Part 7"'),
        ("title = \u2018Part 7\u2019", "title = 'Part 7'"),
        ("title\u00a0= 'Part 7'", "title = 'Part 7'"),
        ('title = "runs\\day 3"', 'title = "runs/day 3"'),
        ("length = 34,5 # mm", "length = 34.5 # mm"),
        ("length = 34,5 mm", "length = 34.5"),
        ("parameters = {C10 = 0,45, C20 = -0,02}", "parameters = {C10 = 0.45, C20 = -0.02}"),
        ("length = \u221234.5", "length = -34.5"),
    ],
)
def test_signs_that_toml_does_not_know_are_refused_with_the_line_to_write(folder, line, better):
    found = problems(folder, f"{line}\n{CASE}")
    assert len(found) == 1
    assert found[0].endswith(f"; write {better})")
    tomllib.loads(better)


def test_a_unit_that_case_files_do_not_have_is_not_taken_away(folder):
    assert "write" not in problems(folder, f"length = 1.5 in\n{CASE}")[0]


@pytest.mark.parametrize(
    "written",
    ["'runs\\tension.csv'", '"runs\\\\tension.csv"', '"runs\\tension.csv"', '"runs\\radial.csv"'],
)
def test_a_path_with_backslashes_that_exists_with_slashes_is_read(folder, written):
    (folder / "runs").mkdir()
    (folder / "runs" / "tension.csv").write_text("time_s,displacement_mm,force_N\n")
    (folder / "runs" / "radial.csv").write_text("time_s,displacement_mm,force_N\n")
    text = f"{CASE}\n[[recordings]]\nname = 'again'\nmode = 'axial'\nfile = {written}\n"
    name = "radial.csv" if "radial" in written else "tension.csv"
    assert load(folder, text).recordings[-1].file == folder / "runs" / name


def test_a_diameter_in_place_of_a_radius_is_refused_once(folder):
    found = problems(folder, CASE.replace("inner_radius", "inner_diameter"))
    assert len(found) == 1
    assert found[0].endswith("(give inner_radius, half the diameter, in mm)")


def test_files_that_are_none(folder):
    write(folder)
    with pytest.raises(InputError, match=r'no such case file; did you mean "case.toml"\? \(case.toml\)'):
        load_case(folder / "cas.toml")
    with pytest.raises(InputError, match=r"is a directory \(a case file, such as .*case.toml\)"):
        load_case(folder)
    with pytest.raises(InputError, match="no such case file"):
        load_case(folder / "nowhere" / "case.toml")
    with pytest.raises(InputError, match="cannot be read"):
        load_case("a\0b")


def test_a_case_is_found_from_any_directory(folder, monkeypatch):
    write(folder)
    monkeypatch.chdir(folder.parent)
    case = load_case(Path(folder.name) / "case.toml")
    assert case.recordings[0].file.is_file()


VALUES = [
    "-1",
    "0",
    "1e400",
    "nan",
    "inf",
    "true",
    '""',
    '"x"',
    "[]",
    "{}",
    "[[]]",
    "{a = 1}",
    "1979-05-27",
    "-0.0",
]
VALUES += [
    "99999999999999999999999",
    "1e-320",
    "'\\u0000'",
    "[nan]",
    "[1, 'a', {}]",
    "0x10",
    "07:32:00",
    '"\\u0000"',
]
KEYS = [
    *("title", "geometry", "geometry.shape", "geometry.length", "geometry.inner_sleeve"),
    *(
        "geometry.inner_sleeve.grip",
        "geometry.inner_sleeve.thickness",
        "mesh",
        "mesh.elements_across",
        "material",
    ),
    *(
        "material.law",
        "material.bulk_modulus",
        "material.parameters",
        "material.parameters.C10",
        "material.terms",
    ),
    *("load_cases", "load_cases.0", "load_cases.0.mode", "load_cases.0.amplitude", "load_cases.1.path"),
    *("load_cases.1.rate", "load_cases.0.steps", "load_cases.0.file", "recordings", "recordings.0"),
    *("recordings.0.file", "recordings.0.mode", "recordings.0.cycles", "recordings.0.columns", "effects"),
    *(
        "recordings.0.columns.force",
        "recordings.0.units",
        "recordings.0.units.force",
        "recordings.0.delimiter",
    ),
    *("coupons", "coupons.0.mode", "coupons.0.units.strain", "load_cases.1.path.1", "recordings.0.name"),
]


@pytest.mark.parametrize("key", KEYS)
def test_any_value_of_any_key_is_accepted_or_refused_but_never_crashes(folder, key):
    """What is accepted must be JSON; what is refused must name the key's section."""
    path = write(folder)
    for value in VALUES:
        case, error = outcome(path, f"{key}={value}")
        if case is None:
            assert key.partition(".")[0] in error
        else:
            json.dumps(case_json(case), allow_nan=False)


@pytest.mark.parametrize("seed", range(20))
def test_damaged_case_files_are_refused_but_never_crash(folder, seed):
    rng = np.random.default_rng(seed)
    for _ in range(20):
        content = bytearray(CASE.encode())
        for _ in range(rng.integers(1, 4)):
            place = int(rng.integers(len(content)))
            size = int(rng.integers(1, 20))
            if rng.random() < 0.5:
                del content[place : place + size]
            else:
                content[place:place] = rng.choice(
                    [b"[", b"]", b"=", b'"', b"\n", b"\xff", b"\0", b"1e9", b"-", b"."]
                )
        case, error = outcome(write(folder, bytes(content)))
        assert case is not None or "case.toml" in error


EFFECTS = (
    CASE
    + """
[[effects]]
name = "mullins"
parameters = { r = 3.2, m = 0.025, beta = 0.22 }

[[effects]]
name = "bump_stop"
parameters = { stiffness = 300, gap = -20 }
channels = ["torsional"]

[[effects]]
name = "viscoelasticity"
parameters = { g1 = 0.2, g2 = 0.1 }
channels = ["axial", "torsional"]
"""
)


def test_effects_are_read_by_their_own_names_in_internal_units(folder):
    mullins, stop, branches = load(folder, EFFECTS).effects
    assert mullins.values == {"inverse_r": 1 / 3.2, "m": 0.025, "beta": 0.22}
    assert mullins.channels is None
    assert mullins.acts_on("axial-1", "axial")
    # N mm per degree in the case file, as in all input and output.
    assert stop.values == pytest.approx({"stiffness": 300 * 180 / math.pi, "gap": -math.pi / 9})
    assert stop.acts_on("torsional", "torsional")
    assert not stop.acts_on("axial", "axial")
    assert branches.parameters_without_value == ("viscoelasticity.tau1", "viscoelasticity.tau2")


def test_what_belongs_to_a_rig_may_be_in_several_with_values_of_their_own(folder):
    text = (
        CASE
        + """
[[effects]]
name = "offset"
parameters = { force = 5.0, displacement = 0.1 }
channels = ["axial-1"]
[[effects]]
name = "offset"
parameters = { force = 40.0, displacement = 0.2 }
channels = ["torsional"]
"""
    )
    axial, torsional = load(folder, text).effects
    assert (axial.name, torsional.name) == ("offset", "offset@torsional")
    assert axial.effect == torsional.effect
    assert torsional.full_name(torsional.parameters[0]) == "offset@torsional.force"
    # Degrees in the file.
    assert torsional.values["displacement"] == pytest.approx(math.radians(0.2))
    assert axial.values["displacement"] == 0.1
    assert [one["name"] for one in case_json(load(folder, text))["effects"]] == ["offset", "offset"]
    assert uniquely_named((torsional,))[0].name == "offset"
    assert [one.name for one in uniquely_named((torsional, axial))] == ["offset@torsional", "offset"]


def test_an_effect_acts_on_its_kinds_of_channels_only(monkeypatch):
    mass = replace(effect("time_lag"), name="mass", needs_time=False, kinds=frozenset({"dynamic"}))
    monkeypatch.setattr("bushcli.case.effects.effects", lambda: {"mass": mass})
    static, dynamic = DeclaredChannel("slow", "axial"), DeclaredChannel("sweep", "axial", kind="dynamic")

    def built(*channels, **given):
        return build([(EffectTable(name="mass", **given), ("effects", 0))], channels)

    (active,), findings = built(static, dynamic)
    assert not findings
    assert not effects_on_channel([active], "slow", "axial")
    assert effects_on_channel([active], "sweep", "axial", "dynamic") == (active,)
    (finding,) = built(static, dynamic, channels=["slow"])[1]
    assert finding.what.endswith('"slow": mass does not act on recordings and load cases along a path')
    assert finding.expected.endswith("; tables of dynamic stiffness")
    (finding,) = built(static)[1]
    assert "acts on nothing in this case" in finding.what


def test_resolved_effects_are_a_case_again(folder):
    shown = case_json(load(folder, EFFECTS))["effects"]
    assert shown[1] == {
        "name": "bump_stop",
        "parameters": {"stiffness": 300.0, "gap": -20.0},
        "channels": ["torsional"],
    }
    assert json.loads(json.dumps(shown, allow_nan=False)) == shown
    again = [{key: value for key, value in entry.items() if value is not None} for entry in shown]
    data = "effects=[" + ", ".join(toml(entry) for entry in again) + "]"
    assert case_json(load(folder, CASE, data))["effects"] == shown


def toml(value) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + "}"
    return "[" + ", ".join(map(toml, value)) + "]" if isinstance(value, list) else json.dumps(value)


def test_a_choice_is_a_word_with_a_usual_one(folder):
    rigid = CASE.replace("[geometry.inner_sleeve]", "[geometry.outer_sleeve]")
    one = "effects=[{name='debonding', parameters={length=2.0BOND}}]"
    for given, code in (("", 0.0), (", bond='inner_bottom'", 1.0)):
        case = load(folder, rigid, one.replace("BOND", given))
        assert case.effects[0].values == {"length": 2.0, "bond": code}
        assert case.effects[0].parameters_without_value == ()
        assert case_json(case)["effects"][0]["parameters"]["bond"] == (
            "inner_bottom" if code else "inner_top"
        )
    # Debonding is not modelled on an elastic sleeve, but on the other one it is.
    outer = one.replace("BOND", ", bond='outer_top'")
    assert load(folder, CASE, outer).effects[0].values["bond"] == 2.0
    assert "the effect cannot be combined with an elastic outer_sleeve" in str(problems(folder, rigid, outer))
    assert "the effect cannot be combined with an elastic inner_sleeve" in str(
        problems(folder, CASE, one.replace("BOND", ""))
    )
    (wrong,) = problems(folder, rigid, one.replace("BOND", ", bond='outer_tip'"))
    assert (
        'effects[0].parameters.bond = "outer_tip" is not a choice of bond; did you mean "outer_top"?' in wrong
    )
    assert "outer_bottom" in wrong
    for value, what in (("2", "bond = 2.0 is not a choice of bond"), ("true", "neither a number nor a word")):
        assert what in problems(folder, rigid, one.replace("BOND", f", bond={value}"))[0]


def test_a_rate_that_grows_with_stress_is_not_that_of_a_spectrum(folder):
    parameters = "{g1=0.1, tau1=9.0, decades=5.0, slope=0.0, exponent=3.0}"
    both = f"effects=[{{name='viscoelasticity', parameters={parameters}}}]"
    assert "parameters.exponent has no meaning beside decades" in str(problems(folder, CASE, both))
    alone = both.replace("decades=5.0, slope=0.0, ", "")
    assert "no meaning" not in str(problems(folder, CASE, alone))


def test_an_effect_on_the_shape_is_bounded_by_it(folder):
    swaged = "effects=[{name='swaging', parameters={reduction=5.0}}]"
    assert "reduction = 5.0 is out of bounds (0 to 1.2 mm: 0.12 of the rubber's thickness)" in str(
        problems(folder, CASE, swaged)
    )
    loose = "effects=[{name='debonding', parameters={length=39.0, bond='outer_top'}}]"
    assert "length = 39.0 is out of bounds (0 to 36 mm: 0.9 of the rubber's length)" in str(
        problems(folder, CASE, loose)
    )


def test_a_ratio_of_a_channel_has_no_other_unit_in_degrees(folder):
    both = "effects=[{name='gain', parameters={error=0.05}}]"
    assert load(folder, CASE, both).effects[0].values == {"error": 0.05}
    twist = "effects=[{name='gain', channels=['torsional'], parameters={error=0.05}}]"
    assert case_json(load(folder, CASE, twist))["effects"][0]["parameters"] == {"error": 0.05}


def test_effects_are_set_by_name_or_by_number(folder):
    set_ = ("effects.mullins.r=2", "effects.2.parameters.tau1=5", "effects.bump_stop.channels=['torsional']")
    mullins, _, branches = load(folder, EFFECTS, *set_).effects
    assert mullins.values["inverse_r"] == 0.5
    assert branches.values == {"g1": 0.2, "g2": 0.1, "tau1": 5.0}
    (added,) = load(folder, CASE, "effects.swaging.reduction=0.3").effects
    assert (added.name, added.values) == ("swaging", {"reduction": 0.3})
    *_, added = load(folder, EFFECTS, "effects.swaging={reduction=0.3}").effects
    assert added.values == {"reduction": 0.3}
    found = problems(folder, EFFECTS, "effects.bump_stop.gap=1e9")
    assert found == [
        "--set effects.bump_stop.gap=1e9: effects[1].parameters.gap = 1000000000.0 is out of bounds "
        "(-57295.8 to 57295.8 degrees)"
    ]


TWO_RIGS = (
    "effects=[{name='offset', channels=['torsional'], parameters={force=2}}, "
    "{name='offset', channels=['axial'], parameters={force=5}}]"
)


def test_an_effect_in_several_rigs_is_set_by_its_channel(folder):
    def forces(*set_):
        found = load(folder, CASE, TWO_RIGS, *set_).effects
        return {one.channels[0]: one.values["force"] for one in found if "force" in one.values}

    assert forces("effects.offset@axial.force=7") == {"torsional": 2.0, "axial": 7.0}
    assert forces("effects.offset@torsional.force=7") == {"torsional": 7.0, "axial": 5.0}
    more = "effects.free_play@axial.half_width=0.1"
    *_, added = load(folder, CASE, TWO_RIGS, more).effects
    assert (added.name, added.channels) == ("free_play", ("axial",))
    assert problems(folder, CASE, TWO_RIGS, "effects.offset.force=7") == [
        "--set effects.offset.force=7: several effects are called offset "
        "(effects.offset@torsional, effects.offset@axial)"
    ]
    assert problems(folder, CASE, TWO_RIGS, "effects.offset@radial.force=7") == [
        "--set effects.offset@radial.force=7: no offset has the channel radial "
        "(effects.offset@torsional, effects.offset@axial)"
    ]


def test_channels_are_those_that_a_prediction_names(folder):
    case = load(folder)
    assert case.channels == (("axial-1", "axial"), ("torsional", "torsional"), ("axial", "axial"))
    assert case.effects == ()
    # The name of a table of dynamic stiffness is taken, too.
    tables = load(folder, CASE, "recordings=[{mode = 'axial', kind = 'dynamic', file = 'axial.csv'}]")
    assert [load.label for load in tables.load_cases] == ["axial-1", "torsional"]


def test_a_path_of_six_motions_is_one_more_kind_of_load_case(folder):
    path = "mode = 'path', path = {time = [0, 1, 3], uz = [0, 0, 2], rz = [0, 1, 1]}"
    moved = f"load_cases.0={{{path}, steps = 4}}"
    vibrating = f"load_cases.1={{{path}, steps = 4, dynamic = {{frequency = 5, amplitude = 0.1}}}}"
    case = load(folder, CASE, moved, vibrating)
    (along,), (posed,) = case.load_cases, case.vibrations
    np.testing.assert_allclose(along.program(TableCache()).time[[0, -1]], [0.0, 3.0])
    assert not along.by_travel
    assert not along.simulated_mode.solid.mirrors
    # It vibrates about the end of the path, in the motion that goes furthest.
    (way,) = posed.programs()
    assert [posed.preload_number(q, 7.0) for q in way.displacement[-2:]] == [None, 0]
    assert (posed.vibrating_mode, posed.shown_motion) == ("axial", " (uz)")
    assert posed.place(1.5) == "1.5 s of the path"
    np.testing.assert_allclose(posed.pose, [0.0, 0.0, 2.0, 0.0, 0.0, math.radians(1.0)])
    shown = case_json(case)["load_cases"]
    assert shown[0] == {
        "mode": "path", "steps": 4, "path": {"time": [0, 1, 3], "uz": [0, 0, 2], "rz": [0, 1, 1]},
    }  # fmt: skip
    assert shown[1]["dynamic"] == {
        "amplitude": [0.1], "frequency": [5], "point": "transfer", "motion": "uz",
    }  # fmt: skip
    assert load(folder, CASE).load_cases[0].by_travel


def test_an_effect_without_anything_to_act_on_is_refused(folder):
    found = problems(folder, EFFECTS, "recordings=[]", "load_cases=[]", "coupons=[]")
    assert any('effects[0].name = "mullins" acts on nothing in this case' in problem for problem in found)
    torsion = problems(
        folder,
        CASE,
        "recordings=[]",
        "load_cases=[{mode='torsional', amplitude=3}]",
        "effects.rig_compliance.stiffness=1e5",
    )
    assert (
        'effects[0].name = "rig_compliance" acts on nothing in this case, which has torsional' in torsion[0]
    )
