"""The modules that a command loads: libraries that it does not need would take longer than most of its work."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

from bushcli import faults, recording, report

ROOT = Path(__file__).parents[2]
BATCH = ROOT / "examples" / "batch" / "case.toml"
PLAIN = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[material]
law = "yeoh"
bulk_modulus = 2000.0
parameters = { C10 = 0.5, C20 = -0.05, C30 = 0.01 }
[[load_cases]]
mode = "axial"
amplitude = 8.0
steps = 20
"""
# Runs a command, and prints which modules are loaded at its end.
PROBE = """
import json, sys
from pathlib import Path
from types import ModuleType
try:
    from bushcli.cli import main
    main(sys.argv[2:])
except SystemExit as end:
    code = end.code or 0
Path(sys.argv[1]).write_text(json.dumps([code, sorted(sys.modules)]))
"""
# What every simulation has to load: the process to which times are compared (benchmarks/README.md).
STACK = "from mpi4py import MPI; import dolfinx.fem.petsc, gmsh"
REPORTS = ("matplotlib", "jinja2", "ezdxf", "meshio", "pandas", "bushcli.diagnosis")
STATISTICS = ("scipy.stats", "scipy.optimize", "scipy.interpolate", "scipy.special", "scipy.sparse")
RECORDINGS = (
    "bushcli.recording.read",
    "bushcli.recording.header.units",
    "bushcli.faults.find",
    "bushcli.case.schema_recordings",
)
EFFECTS = ("bushcli.effects.effect", "bushcli.case.effects")
# What single functions of NumPy load. (The median and `unique` load numpy.ma; DOLFINx 0.11 calls the latter.)
OF_NUMPY = ("numpy.polynomial",)
FINITE_ELEMENTS = ("dolfinx", "petsc4py.PETSc", "mpi4py.MPI", "gmsh", "basix")


@pytest.fixture
def plain(tmp_path):
    file = tmp_path / "plain.toml"
    file.write_text(PLAIN)
    return file


def loaded(tmp_path: Path, *arguments: object) -> set[str]:
    """Return the modules that are loaded when a command has succeeded."""
    out = tmp_path / "modules.json"
    command = [sys.executable, "-c", PROBE, str(out), *map(str, arguments)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    code, modules = json.loads(out.read_text())
    assert code == 0, run.stderr
    return set(modules)


def present(modules: set[str], unwanted: tuple[str, ...]) -> list[str]:
    """Return those of the unwanted packages and modules that are loaded, in whole or in part."""
    return [name for name in unwanted if any(one == name or one.startswith(f"{name}.") for one in modules)]


def test_help_loads_nothing_but_the_command_line(tmp_path):
    assert not present(loaded(tmp_path, "--help"), ("numpy", "pydantic", "rich", *FINITE_ELEMENTS, *REPORTS))


@pytest.mark.parametrize("kind", ["laws", "shapes", "modes", "effects"])
def test_lists_load_no_finite_elements(tmp_path, kind):
    unwanted = ("rich", "pint", *FINITE_ELEMENTS, *REPORTS, *STATISTICS)
    assert not present(loaded(tmp_path, "list", kind), unwanted)


def test_check_loads_no_finite_elements(tmp_path, plain):
    unwanted = ("pint", "bushcli.inverse.identify", *FINITE_ELEMENTS, *REPORTS, *STATISTICS)
    assert not present(loaded(tmp_path, "check", BATCH), (*unwanted, "ufl", "cffi"))
    # The law's stability is judged by a kernel, which has been compiled before; UFL declares it.
    loaded(tmp_path, "check", plain)
    assert not present(loaded(tmp_path, "check", plain), unwanted)


def test_direct_loads_what_it_solves_with(tmp_path, plain):
    modules = loaded(tmp_path, "direct", plain, "-q", "--json")
    unwanted = (
        "rich",
        "pint",
        "bushcli.inverse.identify",
        "bushcli.simulate.reaction",
        *REPORTS,
        *STATISTICS,
    )
    assert not present(modules, (*unwanted, *RECORDINGS, *EFFECTS, *OF_NUMPY))
    probe = f"{STACK}; import json, sys; print(json.dumps(sorted(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    # 284 when this was written (some 30 more with Python 3.14 and its pydantic), two thirds of them bushcli's own; once
    # more than twice as many. Then loads by force and vibrations of a case came, and each result got a view and JSON.
    assert len(modules - set(json.loads(run.stdout))) < 345


def test_a_case_with_a_section_loads_its_shape_alone(tmp_path, plain):
    modules = loaded(tmp_path, "check", plain)
    assert "geometry.shapes.plain" in modules
    assert not present(modules, ("geometry.shapes.cad", "geometry.shapes.section", "geometry.cad"))


def test_nothing_is_left_to_the_environment(tmp_path, plain):
    """A command changes settings of pydantic to start faster, but keeps those that the user has set."""
    code = "from bushcli.cli import main\ntry:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
    code += "import os; print(os.environ['PYDANTIC_DISABLE_PLUGINS'])"
    run = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYDANTIC_DISABLE_PLUGINS": "one"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.splitlines()[-1] == "one"


def test_every_result_has_a_view_keys_and_files():
    from bushcli.report.results import Result

    assert set(Result.split(" | ")) == report._NAMES.keys()
    for name in report._NAMES.values():
        for module, kind in (
            (f"json.{name}", "json"),
            (f"views.{name}", "document"),
            ("writers.files", "files"),
        ):
            assert callable(getattr(import_module(f"bushcli.report.{module}"), f"{name}_{kind}"))


@pytest.mark.parametrize("package", [recording, faults])
def test_every_name_that_is_loaded_late_is_where_it_is_looked_for(package):
    assert not [name for name in package.__all__ if isinstance(getattr(package, name), ModuleType)]
