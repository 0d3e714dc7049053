"""Common fixtures of all tests: one thread, and the rubber of the reference curves."""

from __future__ import annotations

import gc
import importlib.util
import os
import sys
from pathlib import Path

# Matrices are small: more BLAS threads only slow each other down. To be set before NumPy is imported.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect tests without collecting garbage, which takes a quarter of the time: what they make stays to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


# Laws of the reference curves (tests/verification/data/README.md), and Gent with the same shear modulus and a limit
# that its neighbours' stretches do not reach.
LAWS = {
    "neo_hookean": {"C10": 0.5},
    "mooney_rivlin": {"C10": 0.4, "C01": 0.1},
    "yeoh": {"C10": 0.5, "C20": -0.05, "C30": 0.01},
    "ogden": {"mu1": 0.6, "alpha1": 1.3, "mu2": 0.005, "alpha2": 5.0, "mu3": -0.02, "alpha3": -2.0},
    "arruda_boyce": {"mu": 1.0, "lambda_m": 3.0},
    "gent": {"mu": 1.0, "Jm": 30.0},
}


@pytest.fixture(scope="session")
def rubber():
    """Make a rubber of a law by name, with the parameters of the references or others (MPa)."""
    from cases.simulate import Rubber
    from forms.law import law

    def make(name="yeoh", bulk_modulus=2000.0, **parameters):
        chosen = law(name)
        given = parameters or LAWS.get(name) or {p.name: p.start for p in chosen.parameters}
        return Rubber(chosen, given, bulk_modulus)

    return make


@pytest.fixture(scope="session")
def reference_bushing():
    """Return the plain bushing 12/22/40 mm of the reference curves."""
    from geometry.shape import shapes

    return shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)


def _beside(name):
    """Import a module of this folder by its path, because test folders are not packages."""
    spec = importlib.util.spec_from_file_location(
        f"bushcli_tests_{name}", Path(__file__).with_name(f"{name}.py")
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def diagnoses():
    """Return the module that makes diagnoses by hand."""
    return _beside("diagnoses")


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Start (or find) a headless Chromium; the test is skipped where there is none."""
    with _beside("browser").started(tmp_path_factory.mktemp("browser")) as found:
        if found is None:
            pytest.skip(
                "no Chromium: set BUSHCLI_CHROMIUM to one, or run tests/with-browser (make test does)"
            )
        yield found
