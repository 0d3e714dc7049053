"""Kernels of a point: one for each law, branch and kinematics; their combinations need no further kernels."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cases import compiling, jit, kernels, records
from cases.feature import Feature, Installed
from cases.march import march
from cases.mode import modes
from cases.precompile import functions, parameter_sets
from cases.program import Program
from cases.rates import Rates
from cases.simulate import prepare
from forms import answers
from forms.branch import branches
from forms.branch_answers import branch_functions
from forms.law import law
from forms.potential import Attached
from forms.setting import SETTINGS
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=4, around=8)


def attached(name, title):
    branch = branches()[name]
    return Installed(title, Feature(branches=lambda values: [Attached(branch, values)]), branch.typical)


def test_a_combination_of_effects_needs_the_usual_kernels_only(monkeypatch, reference_bushing, rubber):
    monkeypatch.setattr(kernels, "_KERNELS", {})
    features = [
        attached("maxwell", "a"),
        attached("ogden_roxburgh", "b"),
        attached("elastoplastic", "c"),
        attached("maxwell", "d"),
    ]
    model = prepare(reference_bushing, modes()["axial"], rubber("yeoh", 200.0), COARSE, features=features)
    program = Program(np.array([1.0, 0.5]), np.array([1.0, 2.0]))
    march(model, program, sensitivity=("C10", "compliance", "a.tau", "b.m", "c.slip"))
    needed = set(kernels._KERNELS)
    assert needed <= {function.key for function in functions()}
    # Kinematics, law, volumetric part, and three branches: the second Maxwell branch needs no kernel of its own.
    assert len(needed) <= 4 + 3 + 3 + 3 * 7


def test_the_library_of_loops_depends_on_every_c_file_and_header():
    folder = Path(kernels.__file__).parent
    assert {file.relative_to(folder).as_posix() for file in folder.rglob("*.[ch]")} == set(kernels.SOURCES)


def test_laws_with_terms_are_compiled_with_one_after_the_other():
    assert parameter_sets(law("yeoh")) == [("C10", "C20", "C30")]
    assert [len(names) for names in parameter_sets(law("ogden"))] == [2, 4, 6]


@pytest.mark.parametrize(("mode", "reach"), [("axial", 6.0), ("torsional", 0.3), ("radial", 1.8)])
def test_rates_with_an_old_factorisation_are_those_of_a_fresh_one(
    mode, reach, reference_bushing, rubber, monkeypatch
):
    """`cases.rates` states an error of 4e-7 of the largest derivative; 2e-6 is allowed here."""
    chosen = rubber("yeoh", 2000.0)
    model = prepare(reference_bushing, modes()[mode], chosen, COARSE)
    program = Program(np.linspace(0, reach, 9)[1:])
    names = tuple(chosen.parameters)
    found = march(model, program, sensitivity=names).sensitivity
    monkeypatch.setattr(Rates, "iterate", lambda *_: None)
    exact = march(model, program, sensitivity=names).sensitivity
    assert np.abs((found - exact) / np.abs(exact).max(axis=0)).max() < 2e-6
    assert np.abs(found - exact).max() > 0


def test_springs_of_a_bond_follow_the_law_s_shear_modulus(rubber):
    """A bond's springs are stiff in units of it; Ogden's modulus depends on two parameters."""
    from bushcli.case.catalogue import effects
    from bushcli.effects.active import ActiveEffect
    from bushcli.effects.assembly import features_of

    active = [ActiveEffect(effects()["debonding"], {"length": 3.0, "bond": 0.0})]
    shape = shapes()["plain"](inner_radius=9.0, outer_radius=18.0, length=20.0)
    chosen = rubber("ogden", 500.0)
    model = prepare(shape, modes()["axial"], chosen, COARSE, features=features_of(active))
    program = Program(np.array([1.0]))
    exact = march(model, program, tolerance=1e-10, sensitivity=("mu1", "alpha1")).sensitivity[0]
    for name, slope in zip(("mu1", "alpha1"), exact, strict=True):
        value, forces = chosen.parameters[name], []
        for h in (1e-4, -1e-4):
            model.set_parameters({name: value * (1 + h)})
            forces.append(march(model, program, tolerance=1e-10).force[0])
        model.set_parameters({name: value})
        assert slope == pytest.approx((forces[0] - forces[1]) / (2e-4 * value), rel=1e-4)


def own_energy(strain, *, C1):
    return C1 * (strain.I1 - 3)


@pytest.fixture
def compiled(monkeypatch, tmp_path):
    """A function that was compiled in a new folder, and the records there; compiling it again is an error."""
    monkeypatch.setenv("BUSHCLI_CACHE", str(tmp_path))
    jit._locked_folder.cache_clear()
    function = answers.volumetric_slopes(SETTINGS["axisymmetric"])
    kernels.Kernel(function)

    def again(function):
        raise RuntimeError("compiled again")

    monkeypatch.setattr(compiling, "compiled_function", again)
    yield function, list(jit.cache_directory().glob("point-*.json"))
    jit._locked_folder.cache_clear()


def test_a_compiled_kernel_is_found_by_its_note(compiled):
    function, (note,) = compiled
    inputs = {
        "strain": np.array([[1.1, 1.0, 1.0, 1.0, 0.1, 0.3]]),
        "parameters": np.array([1e-3, 1.0, 1.0]),
    } | {"guard": np.zeros((1, 2))}
    found = kernels.Kernel(function)(1, inputs)
    assert found.shape == (1, 3 * 7)
    assert found[0, 0] == pytest.approx(-0.5 * 0.3**2)  # the mixed energy is p (J - 1) - p^2 / 2 kappa
    assert json.loads(note.read_text())["size"] == 21


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"library": "../x.so", "size": 1, "names": []}', "\0"])
def test_a_damaged_note_counts_as_none(compiled, text):
    function, (note,) = compiled
    note.write_text(text)
    with pytest.raises(RuntimeError, match="compiled again"):
        kernels.Kernel(function)


def test_a_note_of_a_damaged_library_counts_as_none(compiled):
    function, (note,) = compiled
    library = note.parent / json.loads(note.read_text())["library"]
    os.truncate(library, library.stat().st_size // 2)
    with pytest.raises(RuntimeError, match="compiled again"):
        kernels.Kernel(function)


def test_a_note_counts_for_one_revision_of_the_mathematics(compiled, monkeypatch):
    monkeypatch.setattr(records, "_revision", lambda: "another text of forms")
    with pytest.raises(RuntimeError, match="compiled again"):
        kernels.Kernel(compiled[0])


def test_a_law_from_elsewhere_has_no_note(compiled):
    """The revision does not cover its source: another energy of the same name must not find the old library."""
    function = answers.law_answer(
        SETTINGS["axisymmetric"],
        replace(law("neo_hookean"), energy=own_energy),
        ("C1",),
        moduli=False,
    )
    assert records.find(function) is None
    assert records._file(function) is None
    known = answers.law_answer(SETTINGS["axisymmetric"], law("neo_hookean"), ("C10",), moduli=False)
    assert records._file(known) is not None


def test_sets_of_inputs_are_added_up_or_kept_apart():
    """Two branches of one formula, their strains alike: rows of points (n, width), and of branches (2, n, width)."""
    setting, branch = SETTINGS["axisymmetric"], branches()["maxwell"]
    functions = branch_functions(setting, branch)
    kernel, n, rng = kernels.kernel(functions.stress), 4, np.random.default_rng(3)
    memory = np.array(functions.virgin) * (1.0 + 0.01 * rng.normal(size=(2, n, functions.memory)))
    strain = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])[: len(setting.names)] + 0.05 * rng.normal(
        size=(n, len(setting.names))
    )
    common = {"strain": np.column_stack([strain, np.zeros(n)]), "law energy": np.zeros((n, 1))}
    parameters = np.array([[[0.3, 2.0, 0.5, 1.0]], [[0.1, 9.0, 0.5, 1.0]]])
    together, apart = np.ones((n, kernel.size)), np.ones((2, n, kernel.size))
    kernel.bind(together, {**common, "memory": memory, "parameters": parameters}, clear=True)()
    kernel.bind(apart, {**common, "memory": memory, "parameters": parameters}, clear=True)()
    singly = [
        kernel(n, {**common, "memory": m, "parameters": p[0]})
        for m, p in zip(memory, parameters, strict=True)
    ]
    np.testing.assert_array_equal(apart, singly)
    np.testing.assert_allclose(together, sum(singly), rtol=1e-14)
    assert np.abs(singly[0] - singly[1]).max() > 1e-3
    with pytest.raises(AssertionError, match="memory"):
        kernel.bind(together, {**common, "memory": memory[:, :3], "parameters": parameters})
    empty = {key: value[..., :0, :] for key, value in {**common, "memory": memory}.items()}
    kernel.bind(np.zeros((0, kernel.size)), {**empty, "parameters": parameters}, clear=True)()
