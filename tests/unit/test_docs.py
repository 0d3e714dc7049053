"""The documentation against the code: keys, units, commands and links, so that they stay in agreement."""

from __future__ import annotations

import ast
import importlib.util
import json
import re
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.case import dynamic, load_case, schema, schema_recordings
from bushcli.cli import main
from bushcli.effects.effect import effects, effects_on
from bushcli.export import all_writers
from bushcli.recording import read_recording
from bushcli.recording.header.name import match_quality
from bushcli.recording.source import UNITS, Source
from bushcli.report.json.diagnosis import diagnosis_json
from cases.mode import Mode, modes
from forms.law import Law, laws

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted(DOCS.glob("*.md")),
]
EXAMPLE = ROOT / "examples" / "batch" / "case.toml"


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def section(text: str, heading: str) -> str:
    """Return what stands under a heading, up to the next one of any level."""
    lines = text.splitlines()
    start = lines.index(heading) + 1
    stop = next((i for i in range(start, len(lines)) if re.match(r"#+ ", lines[i])), len(lines))
    return "\n".join(lines[start:stop])


def rows(text: str) -> dict[str, list[str]]:
    """Return the cells of the Markdown tables in a text by the first cell, without its quotes."""
    found = {}
    for line in re.findall(r"^\| (`.*) \|$", text, re.MULTILINE):
        first, *cells = re.split(r"\s*\|\s*", line)
        for key in first.split(", "):
            found[key.strip("`")] = cells
    return found


# -- the case file ---------------------------------------------------------------------------------------------------

TABLES = {
    "## `[mesh]`": schema.MeshTable,
    "## `[material]`": schema.MaterialTable,
    "## `[[load_cases]]`": schema.LoadCaseTable,
    "## `[[recordings]]`": schema_recordings.RecordingTable,
    "### Dynamic tests": schema.VibrationTable,
    "### Six motions": schema.PathTable,
    "### Tables of dynamic stiffness": dynamic.DynamicRecordingTable,
    "## `[[effects]]`": schema.EffectTable,
}


@pytest.mark.parametrize("heading", TABLES)
def test_every_key_of_a_table_is_documented_with_its_default(heading):
    documented = rows(section(page("case-file.md"), heading))
    model = TABLES[heading]
    assert documented.keys() == set(model.model_fields)
    for name, field in model.model_fields.items():
        default = documented[name][1]
        assert (default == "required") == field.is_required(), name
        if isinstance(field.default, (int, float)):
            assert default == f"`{field.default:g}`", name


def test_a_coupon_has_the_keys_of_a_recording_and_those_documented():
    own = (
        schema_recordings.CouponTable.model_fields.keys()
        - schema_recordings.RecordingTable.model_fields.keys()
    )
    assert rows(section(page("case-file.md"), "## `[[coupons]]`")).keys() == own


@pytest.mark.parametrize("model", [schema.ColumnsTable, schema.UnitsTable])
def test_columns_and_units_are_documented_with_their_other_names(model):
    documented = rows(section(page("case-file.md"), "### `columns` and `units`"))
    assert documented.keys() == model.model_fields.keys()
    for name, field in model.model_fields.items():
        choices = getattr(field.validation_alias, "choices", [name])
        assert set(re.findall(r"`(\w+)`", documented[name][0])) == set(choices) - {name}


def test_top_level_keys_are_documented():
    # The message for an unknown key lists the valid ones.
    refused = CliRunner().invoke(main, ["check", str(EXAMPLE), "--set", "nonsense=1"])
    known = re.search(r"\(([\w, ]+)\)\s*$", refused.output)
    assert known, refused.output
    assert rows(section(page("case-file.md"), "## Top level")).keys() == set(known[1].split(", "))


def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("docs_tables", DOCS / "tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_shapes_laws_and_modes_are_those_of_the_code():
    text = page("case-file.md")
    assert generator().brought_up_to_date(text) == text, "run: setup/enter python docs/tables.py"
    for name in (*laws(), *modes()):
        assert f"`{name}`" in text or f'"{name}"`' in text


def test_effects_are_those_of_the_code():
    text = page("effects.md")
    assert generator().brought_up_to_date(text) == text, "run: setup/enter python docs/tables.py"
    for name in effects():
        words, mark, _ = section(text, f"### `{name}`").partition(f"<!-- effect {name} -->")
        assert mark, name
        assert len(words.split()) > 12, f"{name} is not explained"


def test_odds_and_priors_are_those_of_the_code():
    text = page("diagnosis-details.md")
    assert generator().brought_up_to_date(text) == text, "run: setup/enter python docs/tables.py"
    for name in effects_on("static"):
        assert f"[`{name}`]" in text
        assert f"`{name}." in text


def test_each_constant_of_the_calculation_says_what_it_is():
    tables = generator()
    rows = [
        (file.stem, *row)
        for room in tables._WITH_CONSTANTS
        for file in (tables.ROOT / "bushcli" / room).glob("*.py")
        for row in tables.constants(file)
    ]
    assert len(rows) > 100
    assert [row[:2] for row in rows if len(row[2].split()) < 4] == []


def test_exports_are_those_of_the_code():
    text = page("exports.md")
    assert generator().brought_up_to_date(text) == text, "run: setup/enter python docs/tables.py"
    assert [name for name in all_writers() if f"`{name}`" not in text] == []


def test_the_effects_shown_are_valid(tmp_path):
    case = tmp_path / "case.toml"
    shown = blocks(DOCS / "effects.md", "toml")[0], blocks(DOCS / "case-file.md", "toml")[-1]
    for text in shown:
        case.write_text(blocks(DOCS / "case-file.md", "toml")[0] + text, encoding="utf-8")
        assert all(effect.parameters_without_value == () for effect in load_case(case).effects)


# -- recordings ------------------------------------------------------------------------------------------------------


def test_documented_column_names_are_understood():
    documented = rows_by_word(section(page("recordings.md"), "## Column names"))
    assert documented.keys() == {*UNITS, "stretch"}
    for kind, names in documented.items():
        for name in names:
            assert match_quality(name, kind) >= 3, (kind, name)
        # The first name of each is the project's own.
        assert match_quality(names[0], kind) == 4, (kind, names[0])


def test_documented_units_are_those_that_are_read():
    documented = rows_by_word(section(page("recordings.md"), "## Units"))
    assert documented == {kind: list(units) for kind, units in UNITS.items()}


def rows_by_word(text: str) -> dict[str, list[str]]:
    table = re.findall(r"^\| (\w+) \| (.*`.*) \|$", text, re.MULTILINE)
    return {kind: re.findall(r"`([^`]+)`", cells) for kind, cells in table}


# -- results ---------------------------------------------------------------------------------------------------------

COARSE = ["elements_across=2", "elements_along=4", "elements_around=4"]
# Below these keys the names come from the data; results.md writes NAME, MODE or CHANNEL.
NAMED = {
    "versions": "NAME", "timings_s": "NAME", "parameters": "NAME", "correlation": "NAME", "weights": "NAME",
    "misfit": "MODE", "stability": "MODE", "boundaries": "NAME", "regions": "NAME", "measures": "NAME",
    "channels": "CHANNEL", "by_channel": "CHANNEL", "rms_percent_before": "CHANNEL", "rms_percent_after": "CHANNEL",
    "relaxation_percent_after": "SECONDS", "relaxation_percent_after_std": "SECONDS",
}  # fmt: skip
# Keys that a result has only where they apply.
SOMETIMES = {
    "problems[].name", "problems[].message", "problems[].remedy",
    "identifiability.undetermined[].text", "identifiability.undetermined[].weights.NAME",
    "identifiability.undetermined[].singular_value",
    "standards[].channel", "standards[].standard", "standards[].clauses[].text", "standards[].clauses[].found",
    "standards[].clauses[].met", "standards[].clauses[].practice", "remarks[].channel", "remarks[].text",
    "misfit.MODE.branch", "misfit.MODE.samples",
    "form_error.fast.CHANNEL",
    "open_questions[].channels", "open_questions[].question", "open_questions[].why", "open_questions[].remedy",
}  # fmt: skip


# `NAMED` for an identification.
IDENTIFIED = NAMED | {"leverage": "CHANNEL", "start": "NAME", "held_out": "MODE"}

# `NAMED` for a diagnosis.
DIAGNOSED = {
    "versions": "NAME", "timings_s": "NAME", "parameters": "NAME", "derived": "NAME",
    "probability": "NAME", "untestable": "NAME", "percent": "CHANNEL", "fast": "CHANNEL",
    "before": "CHANNEL", "after": "CHANNEL", "noise": "CHANNEL",
    "held_out_before": "CHANNEL", "held_out_after": "CHANNEL",
}  # fmt: skip


def keys(value: Any, path: str = "", names: Mapping[str, str] = NAMED) -> Iterator[str]:
    """Yield the dotted keys of a result, as results.md writes them."""
    name = re.sub(r".*\.", "", path)
    if path in ("case", "fit"):
        yield path
    elif isinstance(value, dict) and value:
        for key, item in value.items():
            named = "NAME" if re.search(r"correlation\.NAME$", path) else names.get(name, key)
            yield from keys(item, f"{path}.{named}" if path else named, names)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for item in value:
            yield from keys(item, f"{path}[]", names)
    else:
        yield path


def documented_keys(command: str) -> set[str]:
    text = page("results.md")
    return set(rows(section(text, "## Every result"))) | set(rows(section(text, f"## `bushcli {command}`")))


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> dict[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("results")
    options = [word for key in COARSE for word in ("--set", f"mesh.{key}")]
    found = {}
    for command, more in {"check": [], "mesh": ["-o", folder], "fit": [], "direct": ["--mesh-check"]}.items():
        arguments = [command, EXAMPLE, "--json", "-q", *options, *more]
        done = CliRunner().invoke(main, [str(word) for word in arguments])
        assert done.exit_code == 0, done.output
        found[command] = json.loads(done.output)
    return found


@pytest.mark.slow
def test_every_key_of_an_identification_is_documented():
    options = [word for key in COARSE for word in ("--set", f"mesh.{key}")]
    laws = ["--model", "yeoh,neo_hookean", "--hold-out", "radial"]
    done = CliRunner().invoke(main, ["inverse", str(EXAMPLE), "--json", "-q", *options, *laws])
    assert done.exit_code == 0, done.output
    # Loops and holds have the keys of those of `direct`, which are tested below.
    lists = re.compile(r"^(channels\.CHANNEL\.(cycles|holds))\[\].*")
    whole = json.loads(done.output)
    found = {lists.sub(r"\1", key) for key in keys(whole, names=IDENTIFIED)}
    found = {re.sub(r"^(leverage\.CHANNEL)\..*", r"\1.NAME", key) for key in found}
    fitted = set(rows(section(page("results.md"), "## `bushcli fit`"))) - {"weighting"}
    documented = documented_keys("inverse") | fitted
    containers = {
        key for key in documented if any(other.startswith((f"{key}.", f"{key}[]")) for other in documented)
    }
    assert found - SOMETIMES - {"problems"} <= documented
    assert documented - SOMETIMES - containers - found <= {
        f"profiles[].{n}" for n in ("name", "values", "rise", "limits")
    }


@pytest.mark.parametrize("command", ["check", "mesh", "fit", "direct"])
def test_every_key_of_a_result_is_documented(results, command):
    # The keys of `coupons` are documented as those of `recordings`.
    found = {re.sub(r"^coupons\[\]", "recordings[]", key) for key in keys(results[command])}
    documented = documented_keys(command)
    # A container that may be empty is documented in addition to its contents.
    containers = {
        key for key in documented if any(other.startswith((f"{key}.", f"{key}[]")) for other in documented)
    }
    assert found - SOMETIMES - {"problems"} <= documented
    assert documented - SOMETIMES - containers <= found


def test_every_key_of_a_diagnosis_is_documented(diagnoses):
    result = diagnosis_json(diagnoses.rivalling(load_case(EXAMPLE))) | {"timings_s": {"total": 1.0}}
    # The remaining misfit has the keys of the misfit before.
    found = {key for key in keys(result, names=DIAGNOSED) if not key.startswith("remaining")}
    documented = documented_keys("diagnose") - {"remaining"}
    containers = {
        key for key in documented if any(other.startswith((f"{key}.", f"{key}[]")) for other in documented)
    }
    assert found - SOMETIMES <= documented
    assert documented - SOMETIMES - containers <= found


def test_every_named_problem_is_documented():
    names = set()
    for path in (ROOT / "bushcli").rglob("*.py"):
        if path.name == "doctor.py":  # the set-up's problems, not a result's
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Condition":
                names |= {part.value for part in ast.walk(node.args[0]) if isinstance(part, ast.Constant)}
    assert rows(section(page("results.md"), "### Problems")).keys() == names


# -- worked examples -------------------------------------------------------------------------------------------------


def blocks(path: Path, language: str) -> list[str]:
    text = path.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def test_the_case_shown_is_valid(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(blocks(DOCS / "case-file.md", "toml")[0], encoding="utf-8")
    loaded = load_case(case)
    assert [load.mode for load in loaded.load_cases] == ["axial", "torsional"]


def test_the_path_of_six_motions_shown_is_valid(tmp_path):
    case, shown = tmp_path / "case.toml", blocks(DOCS / "case-file.md", "toml")
    (path,) = [block for block in shown if 'mode = "path"' in block]
    rest = shown[0].partition("[[load_cases]]")[0]
    case.write_text(rest + path, encoding="utf-8")
    (load,) = load_case(case).load_cases
    assert load.six is not None
    assert load.six.free == (4,)
    assert load.six.moving == (0, 2, 4, 5)


@pytest.mark.parametrize(("number", "mode"), [(0, "axial"), (1, "torsional"), (2, "uniaxial")])
def test_the_recordings_shown_can_be_read(tmp_path, number, mode):
    lines = blocks(DOCS / "recordings.md", "csv")[number].splitlines()
    # The page shows two rows of the five that a recording needs.
    last = [float(field) for field in lines[-1].split(",")]
    lines += [",".join(str(value + step) for value in last) for step in (1, 2, 3)]
    file = tmp_path / "shown.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    assert len(read_recording(Source(mode, file)).force) == 5


def test_the_law_and_the_mode_shown_are_what_the_code_asks_for():
    _, law, mode = blocks(ROOT / "CONTRIBUTING.md", "python")
    shown: dict[str, Any] = {}
    exec(law, shown)
    assert isinstance(shown["LAW"], Law)
    # mu = 2 (dW/dI1 + dW/dI2) at rest.
    assert shown["LAW"].shear_modulus(C1=0.3, C2=0.3) == pytest.approx(2 * (0.3 + 0.3 / 3))
    exec(mode, shown)
    assert isinstance(shown["MODE"], Mode)
    x = np.ones((3, 2))
    step = shown["motion"](x, 1.0 + 1e-6) - shown["motion"](x, 1.0)
    np.testing.assert_allclose(step / 1e-6, shown["rate"](x, 1.0), atol=1e-9)


def test_the_walks_through_the_code_find_what_they_name():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    walks = [
        re.findall(r"^\| `(\S+\.py)` \| `(\w+)` \| .+ \|$", table, re.MULTILINE)
        for table in section(text, "## Five walks through the code").split("| --- | --- | --- |")[1:]
    ]
    assert len(walks) == 5
    for walk in walks:
        assert 5 <= len(walk) < 10
        for file, name in walk:
            tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
            assert name in {getattr(node, "name", "") for node in tree.body}, f"{file} has no {name}"


# -- every page ------------------------------------------------------------------------------------------------------


def commands() -> list[tuple[str, str]]:
    """Return (page, command line) for each call of bushcli or make in a code block."""
    found = []
    for path in PAGES:
        lines = [line for block in blocks(path, "sh") for line in block.splitlines()]
        lines += [
            line for block in blocks(path, "console") for line in block.splitlines() if line.startswith("$ ")
        ]
        for line in lines:
            line = re.sub(r"\s#.*", "", line)
            found += [
                (path.name, call) for call in re.findall(r"(?<!concealed )\b(?:bushcli|make) [^|;&>)]*", line)
            ]
    return found


@pytest.mark.parametrize(("where", "line"), commands(), ids=lambda value: value[:60])
def test_commands_in_the_documentation_exist(where, line):
    program, *arguments = shlex.split(line)
    if program == "make":
        makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
        targets = [word for word in arguments if "=" not in word]
        assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in targets)
        return
    context = main.make_context("bushcli", list(arguments), resilient_parsing=arguments[0].startswith("-"))
    if not arguments[0].startswith("-"):
        name, command, rest = main.resolve_command(context, list(arguments))
        assert command is not None
        command.make_context(name, rest, parent=context)


def test_the_readme_names_every_command():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert [name for name in main.commands if f"bushcli {name}" not in text] == []


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_links_resolve(path):
    text = path.read_text(encoding="utf-8")
    for target in re.findall(
        r"\]\(([^)\s]+)\)", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    ):
        if re.match(r"https?://", target):
            continue
        name, _, anchor = target.partition("#")
        file = path.parent / name if name else path
        assert file.exists(), f"{path.name} links to {target}"
        if anchor:
            headings = re.findall(r"^#+ (.*)$", file.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in map(slug, headings), f"{path.name} links to {target}"


def slug(heading: str) -> str:
    """Return the anchor that a heading gets."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def test_pictures_are_small():
    for picture in (DOCS / "pictures").iterdir():
        assert picture.stat().st_size < 200_000, picture.name
