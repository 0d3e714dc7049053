"""Whatever a case file or recording contains, a command prints a result or a message, never a traceback, in time."""

from __future__ import annotations

import contextlib
import datetime
import io
import json
import os
import time
from copy import deepcopy
from dataclasses import dataclass

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bushcli.cli import main

#: Documented exit codes; 70, an error in bushcli, is not one of them.
CODES = {0, 1, 2, 3, 130}
#: Seconds of work within which a file must be refused, without imports.
PROMPT = 2.0
CASE = {
    "title": "made by a test",
    "geometry": {"shape": "plain", "inner_radius": 12.0, "outer_radius": 22.0, "length": 40.0},
    "mesh": {"elements_across": 3},
    "material": {
        "law": "yeoh",
        "bulk_modulus": 2000.0,
        "parameters": {"C10": 0.5, "C20": -0.05, "C30": 0.01},
    },
    "load_cases": [
        {"mode": "axial", "amplitude": 8.0, "steps": 4},
        {"mode": "torsional", "path": [0, 8, -8]},
    ],
    "recordings": [{"mode": "axial", "file": "axial.csv", "units": {"force": "N"}, "columns": {"time": 1}}],
    "coupons": [{"mode": "uniaxial", "file": "uniaxial.csv", "largest_stretch": 2.0}],
    "effects": [{"name": "rig_compliance", "parameters": {"stiffness": 40000.0}}],
}
AXIAL = "time_s,displacement_mm,force_N\n" + "".join(f"{i},{0.1 * i:.2f},{29.3 * i:.1f}\n" for i in range(12))
UNIAXIAL = "stretch,nominal_stress_MPa\n" + "".join(f"{1 + 0.1 * i:.2f},{0.3 * i:.2f}\n" for i in range(8))
FOLDER = settings(
    max_examples=150,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    derandomize=True,
)

numbers = st.one_of(
    st.floats(),
    st.floats(min_value=-100, max_value=100),
    st.integers(min_value=-(10**30), max_value=10**30),
    st.sampled_from([0, -1, 1e-300, 1e-10, 1e5, 1e99, 1e300, 10**400]),
)
texts = st.one_of(
    st.text(max_size=20),
    st.sampled_from(
        ["", "axial", "yeoh", "../x", "/dev/zero", "\x1b[31m", "a\0b", "x" * 5000, "N", "kip", "-"]
    ),
)
values = st.recursive(
    st.one_of(numbers, texts, st.booleans(), st.just(datetime.date(2024, 2, 1))),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(texts, inner, max_size=3)),
    max_leaves=6,
)


def toml(value):
    """Write a value as TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ", ".join(f"{quoted(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return quoted(value) if isinstance(value, str) else str(value)


def quoted(text):
    return json.dumps(text.encode("utf-8", "replace").decode()).replace("\x7f", "\\u007f")


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    exit_code: object
    stdout: str
    stderr: str


def call(*arguments):
    """Run the command line in this process; any exception other than SystemExit propagates."""
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(arguments, prog_name="bushcli")
        except SystemExit as end:
            code = end.code or 0
    return Ended(code, out.getvalue(), err.getvalue())


def run(folder, command, case, *options, axial=AXIAL):
    """Run a command in this process; fail if its exit code is not a documented one."""
    (folder / "case.toml").write_bytes(case if isinstance(case, bytes) else case.encode())
    (folder / "axial.csv").write_bytes(axial if isinstance(axial, bytes) else axial.encode())
    (folder / "uniaxial.csv").write_text(UNIAXIAL)
    result = call(command, str(folder / "case.toml"), *options)
    assert result.exit_code in CODES, result.stderr
    assert "Traceback" not in result.stderr
    assert result.exit_code != 2 or result.stderr.startswith(("error: ", "Usage: "))
    assert "\x1b" not in result.stdout + result.stderr
    return result


def document(case):
    return "\n".join(f"{quoted(key)} = {toml(value)}" for key, value in case.items()) + "\n"


def places(value, at=()):
    """Yield the path of every value in a case."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield (*at, key)
        yield from places(inner, (*at, key))


@st.composite
def changed_cases(draw):
    """The case with up to three things replaced, left out or added."""
    case = deepcopy(CASE)
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(sorted(places(case), key=str)))
        table = case
        for key in path[:-1]:
            table = table[key]
        kind = draw(st.sampled_from(["replace", "leave out", "add"]))
        if kind == "replace":
            table[path[-1]] = draw(values)
        elif kind == "leave out":
            del table[path[-1]]
        elif isinstance(table, dict):
            table[draw(texts)] = draw(values)
        else:
            table.append(draw(values))
        if not case:
            break
    return case


def test_the_case_itself_is_sound(tmp_path):
    assert run(tmp_path, "check", document(CASE)).exit_code == 0


@pytest.mark.slow
@FOLDER
@given(case=changed_cases())
def test_a_changed_case_is_checked_or_refused(tmp_path, case):
    run(tmp_path, "check", document(case))


@FOLDER
@given(text=st.one_of(st.binary(max_size=200), st.text(max_size=200)), at=st.integers(0, 400))
def test_a_damaged_case_file_is_refused(tmp_path, text, at):
    sound = document(CASE).encode()
    damage = text if isinstance(text, bytes) else text.encode("utf-8", "replace")
    run(tmp_path, "check", sound[:at] + damage + sound[at:])


@FOLDER
@given(override=st.one_of(st.text(max_size=60), st.builds(lambda p, v: f"{p}={v}", texts, numbers)))
def test_an_override_of_any_text_is_refused_or_read(tmp_path, override):
    run(tmp_path, "check", document(CASE), f"--set={override}")


@FOLDER
@given(
    key=st.sampled_from(["geometry.length", "material.parameters.C10", "geometry.outer_radius"]),
    value=st.one_of(numbers, texts),
)
def test_an_override_is_obeyed_or_refused(tmp_path, key, value):
    """The resolved case of a run that is not refused has the value; the message of one that is names the key."""
    result = run(tmp_path, "check", document(CASE), f"--set={key}={toml(value)}", "--json")
    if result.exit_code == 2:
        assert key.rpartition(".")[2] in result.stderr
        return
    found = json.loads(result.stdout)["case"]
    for part in key.split("."):
        found = found[int(part) if part.isdigit() else part]
    assert found == pytest.approx(value, rel=1e-12)


NAMES = (
    "time t force F load Kraft displacement Weg stroke moment error rate step demand Ist x stretch #N/A Min"
)
UNITS = "s ms min h N kN lbs kgf kip mm in ft ' deg rad Nm ft-lb % - MPa ksi zoink N/s 1000N"
names = st.sampled_from(NAMES.split())
units = st.sampled_from([*UNITS.split(), '"'])
heads = st.one_of(
    st.builds(
        lambda n, u, w: w.format(n, u),
        names,
        units,
        st.sampled_from(["{} [{}]", "{} ({})", "{}_{}", "{} in {}", "{} / {}"]),
    ),
    names,
    st.text(max_size=12),
)
cells = st.one_of(
    st.floats(-1e4, 1e4).map(lambda v: f"{v:.4g}"),
    st.integers(-9999, 9999).map(str),
    st.sampled_from(
        [
            "",
            "-9999",
            "#N/A",
            "#NV",
            "nan",
            "1,234",
            "1.234",
            "1.234,5",
            "1e999",
            "0x1",
            "12:00:01",
            '"',
            "٣",
            "1_0",
            "−1",
        ]
    ),
    st.text(max_size=6),
)


@st.composite
def recordings(draw):
    """A table with a header, mostly of numbers, in one of the dialects, with a few cells spoiled."""
    width, rows = draw(st.integers(1, 5)), draw(st.integers(0, 12))
    delimiter = draw(st.sampled_from([",", ";", "\t", " "]))
    table = [[f"{(i + 1) * (j + 0.5):.2f}" for j in range(width)] for i in range(rows)]
    for _ in range(draw(st.integers(0, 3)) if rows else 0):
        table[draw(st.integers(0, rows - 1))][draw(st.integers(0, width - 1))] = draw(cells)
    lines = [[draw(heads) for _ in range(width)]]
    if draw(st.booleans()):
        lines.append([draw(units) for _ in range(width)])
    text = draw(st.sampled_from(["\n", "\r\n"])).join(delimiter.join(line) for line in lines + table)
    return text.encode(draw(st.sampled_from(["utf-8", "utf-16", "utf-8-sig"])), "replace")


@FOLDER
@given(content=st.one_of(recordings(), st.binary(max_size=300)))
def test_a_recording_is_read_or_refused_by_name(tmp_path, content):
    case = {key: CASE[key] for key in ("title", "geometry", "mesh", "material")}
    case |= {"recordings": [{"mode": "axial", "file": "axial.csv"}]}
    result = run(tmp_path, "check", document(case), axial=content)
    assert result.exit_code in (0, 2)
    assert result.exit_code == 0 or "axial.csv" in result.stderr


BIG = {
    "digits": AXIAL + "9" * 20_000 + ",1.2,360\n",
    "fewer digits": AXIAL + "9" * 19_000 + "x,1.2,360\n",
    "columns": "\n".join([",".join(f"c{i}" for i in range(100_000)), *[",".join(["1"] * 100_000)] * 6]),
    "a thousand columns": "\n".join([",".join(["force"] * 1001), *[",".join(["1.5"] * 1001)] * 20]),
    "one line": "x" * 5_000_000,
    "blanks": "a" + " " * 19_000 + "b\n" + AXIAL,
    "brackets": "[" * 19_000 + "\n" + AXIAL,
    "many lines": "1,2,3\n" * 200_000,
    "quotes": ('"' * 9_001 + "\n") * 20 + AXIAL,
    "nulls": "\0" * 1_000_000,
}


@pytest.mark.parametrize("name", BIG)
def test_a_large_recording_ends_promptly(tmp_path, name):
    case = CASE | {"coupons": [], "effects": []}
    run(tmp_path, "check", document(case))  # imports
    start = time.process_time()
    result = run(tmp_path, "check", document(case), axial=BIG[name])
    assert time.process_time() - start < PROMPT
    assert result.exit_code == (0 if name in ("blanks", "brackets", "quotes") else 2)
    assert len(result.stderr) < 2_000


DEEP = {
    "dotted key": "a" + ".a" * 50_000 + " = 1\n",
    "table": "[a" + ".a" * 50_000 + "]\n",
    "quoted key": '"a,"' + '."a,"' * 50_000 + " = 1\n",
    "inline key": "a = {b" + ".b" * 50_000 + " = 1}\n",
    "lists": "a = " + "[" * 50_000 + "]" * 50_000 + "\n",
    "inline tables": "a = " + "{b=" * 50_000 + "1" + "}" * 50_000 + "\n",
    "digits": "a = " + "9" * 20_000 + "\n",
    "digits in a text": 'a = "' + "9" * 20_000 + '"\n',
    "entries": 'x = 1\n[[load_cases]]\nmode = "axial"\n' * 20_000,
    "keys": "".join(f"k{i} = 1\n" for i in range(60_000)),
    "string": 'a = "' + "x." * 400_000 + '"\n',
    "size": "# " + "x" * 2_000_000 + "\n",
}


@pytest.mark.parametrize("name", DEEP)
def test_a_large_case_file_ends_promptly(tmp_path, name):
    run(tmp_path, "check", document(CASE))
    start = time.process_time()
    result = run(tmp_path, "check", DEEP[name] + document(CASE))
    assert time.process_time() - start < PROMPT
    assert result.exit_code == 2
    assert len(result.stderr) < 10_000
    assert "sys." not in result.stderr
    assert "recursion" not in result.stderr


def test_a_number_of_20000_digits_on_the_command_line_is_refused_promptly(tmp_path):
    run(tmp_path, "check", document(CASE))
    start = time.process_time()
    result = run(tmp_path, "check", document(CASE), "--set", "geometry.length=1" + "0" * 20_000)
    assert time.process_time() - start < PROMPT
    assert result.exit_code == 2
    assert len(result.stderr) < 10_000


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/full", "/dev/null", "fifo"])
def test_what_is_no_file_is_refused_promptly(tmp_path, device):
    if device == "fifo":
        device = str(tmp_path / "fifo")
        os.mkfifo(device)
    run(tmp_path, "check", document(CASE))
    start = time.perf_counter()
    for arguments in (
        ["check", device],
        ["check", str(tmp_path / "case.toml"), f'--set=recordings.0.file="{device}"'],
    ):
        result = call(*arguments)
        assert result.exit_code == 2
        assert "is a device or a pipe" in result.stderr
    # Reading a pipe waits without using the processor, so wall clock is limited here, generously for a busy machine.
    assert time.perf_counter() - start < 10 * PROMPT


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (["geometry.length=1e5", "geometry.outer_radius=12.000001"], "no bushing is so large"),
        (["geometry.inner_radius=1e5", "geometry.outer_radius=100000.000001"], "no bushing is so large"),
        # A load of five times the rubber's thickness.
        (
            ["geometry.length=2e3", "geometry.outer_radius=12.001", "load_cases.0.amplitude=0.005"],
            "elements (",
        ),
        (["mesh.elements_across=400", "mesh.elements_along=400", "load_cases.0.mode=radial"], "elements ("),
    ],
)
@pytest.mark.parametrize("command", ["check", "mesh", "direct", "inverse", "diagnose"])
def test_a_mesh_without_bounds_is_refused_before_it_is_made(tmp_path, command, overrides, said):
    start = time.process_time()
    result = run(tmp_path, command, document(CASE), *(f"--set={one}" for one in overrides))
    assert result.exit_code == 2
    assert said in result.stderr
    assert time.process_time() - start < 10 * PROMPT


SEEN = [
    ("load_cases.0.amplitude=1e-90", "load_cases[0].amplitude: a travel of 1e-90 mm is too small"),
    (
        "material.bulk_modulus=1e-10",
        "1e-10 is too small for a shear modulus of 1 MPa (at least 0.667",
    ),
    ("material.parameters={C10=2e5, C20=0, C30=0}", "out of bounds"),
    (
        "geometry={shape='plain', inner_radius=0.012, outer_radius=0.022, length=0.04}",
        "dimensions are in mm; if this one is in metres, write 40",
    ),
    ("geometry.inner_radius=1e-9", "geometry.inner_radius = 1e-09 is too small to mesh (at least 0.001 mm)"),
    (
        "geometry.inner_sleeve={thickness=1e-90}",
        "geometry.inner_sleeve.thickness = 1e-90 is too small to mesh",
    ),
    (
        "geometry.outer_sleeve={thickness=1.0, youngs_modulus=1e-90}",
        "youngs_modulus = 1e-90 is softer than rubber",
    ),
    ("effects.debonding.length=41", "length = 41.0 is out of bounds (0 to 36 mm: 0.9 of the rubber's length"),
    (
        "effects.swaging.reduction=2.5",
        "reduction = 2.5 is out of bounds (0 to 1.2 mm: 0.12 of the rubber's thickness",
    ),
]


@pytest.mark.parametrize(("override", "sentence"), SEEN)
@pytest.mark.parametrize("command", ["check", "direct"])
def test_what_was_seen_to_crash_is_refused(tmp_path, command, override, sentence):
    result = run(tmp_path, command, document(CASE), f"--set={override}")
    assert result.exit_code == 2
    assert sentence in result.stderr


@pytest.mark.parametrize("width", [8.0, 50.0])
@pytest.mark.parametrize("place", ["load_cases", "recordings"])
@pytest.mark.parametrize("command", ["check", "direct"])
def test_free_play_as_large_as_the_travel_is_refused(tmp_path, command, place, width):
    case = {key: CASE[key] for key in ("geometry", "mesh", "material")} | {place: CASE[place][:1]}
    case["effects"] = [{"name": "free_play", "parameters": {"half_width": width}}]
    result = run(tmp_path, command, document(case))
    assert result.exit_code == 2
    assert f"free_play.half_width = {width:g} takes up all of the travel of axial" in result.stderr


extremes = st.sampled_from([0.0, 1e-300, 1e-9, 1e-3, 0.1, 1.0, 8.0, 21.9, 40.0, 1e3, 1e9, 1e99])
places_of_numbers = st.sampled_from(
    [
        "geometry.inner_radius",
        "geometry.outer_radius",
        "geometry.length",
        "material.bulk_modulus",
        "material.parameters.C10",
        "material.parameters.C20",
        "material.parameters.C30",
        "load_cases.0.amplitude",
        "load_cases.0.rate",
        "effects.free_play.half_width",
        "effects.swaging.reduction",
        "effects.offset.force",
        "effects.rig_compliance.stiffness",
        "effects.gain.error",
    ]
)


@pytest.mark.slow
@settings(FOLDER, max_examples=40)
@given(changes=st.dictionaries(places_of_numbers, extremes, min_size=1, max_size=3))
def test_extreme_numbers_are_simulated_or_refused(tmp_path, changes):
    case = {key: CASE[key] for key in ("geometry", "mesh", "material")} | {
        "load_cases": CASE["load_cases"][:1]
    }
    run(
        tmp_path,
        "direct",
        document(case),
        "-q",
        *(f"--set={key}={value!r}" for key, value in changes.items()),
    )
