"""The doctor recognises conditions that slow the program down or stop it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from bushcli.runtime import doctor
from bushcli.runtime.doctor import MODULES, blas_among, examine
from cases.checksum import note_checksum

PYPI_NUMPY = "/venv/lib/python3.13/site-packages/numpy.libs/libscipy_openblas64_-ff651d7f.so"


# Paths as the dynamic linker shows them in Debian 13 and in conda-forge environments.
@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/usr/lib/x86_64-linux-gnu/openblas-pthread/libopenblasp-r0.3.29.so", "OpenBLAS"),
        ("/usr/lib/x86_64-linux-gnu/blas/libblas.so.3.12.1", "reference"),
        ("/opt/conda/envs/bushcli/lib/librefblas.so.3", "reference"),
        ("/opt/conda/envs/bushcli/lib/libopenblasp-r0.3.28.so", "OpenBLAS"),
        ("/opt/conda/envs/bushcli/lib/libmkl_core.so.2", "MKL"),
        ("/usr/lib/x86_64-linux-gnu/libm.so.6", ""),
    ],
)
def test_blas_is_named(path, kind):
    assert blas_among([PYPI_NUMPY, path]) == kind


def test_this_environment_has_everything():
    found = examine()
    missing = {f"no_{name}" for name in MODULES} | {"no_compiler", "untried_dolfinx", "foreign_mpirun"}
    assert [p for p in found.problems if p.name in missing] == []
    assert found.facts["C compiler"].endswith("works")


def test_missing_compiler_is_a_problem_with_a_remedy(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    problem = next(p for p in examine().problems if p.name == "no_compiler")
    assert "no-such-compiler" in problem.message
    assert "gcc" in problem.remedy


def test_unset_threads_are_a_problem(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS")
    assert "threads_not_set" in [p.name for p in examine().problems]


def test_ranks_of_a_foreign_mpirun_are_a_problem(monkeypatch):
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "3")
    assert "foreign_mpirun" in [p.name for p in examine().problems]


def test_cache_is_reported_where_it_is(monkeypatch, tmp_path):
    monkeypatch.setenv("BUSHCLI_CACHE", str(tmp_path))
    assert examine().facts["form cache"].startswith(str(tmp_path))


def test_compiled_forms_that_are_cut_short_are_named(tmp_path, monkeypatch):
    whole = Path(sys.executable).resolve().read_bytes()
    cache = tmp_path / "kernels"
    cache.mkdir()
    (cache / "libffcx_forms_1.so").write_bytes(whole)
    (cache / "libffcx_forms_2.so").write_bytes(whole[: len(whole) // 2])
    monkeypatch.setattr(doctor, "cache_directory", lambda: cache)
    (problem,) = doctor._cache().problems
    assert problem.name == "damaged_kernels"
    assert "libffcx_forms_2.so" in problem.message


def test_compiled_forms_that_differ_from_their_checksum_are_named(tmp_path, monkeypatch):
    content = Path(sys.executable).resolve().read_bytes()
    library = tmp_path / "libffcx_forms_1.so"
    library.write_bytes(content)
    note_checksum(library)
    monkeypatch.setattr(doctor, "cache_directory", lambda: tmp_path)
    assert not doctor._cache().problems
    middle = len(content) // 2
    library.write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])
    (problem,) = doctor._cache().problems
    assert problem.name == "damaged_kernels"
    assert "differ from their checksum, such as libffcx_forms_1.so" in problem.message
