"""Versions of what the numbers of a result depend on."""

from __future__ import annotations

import importlib
import importlib.metadata
import platform

from bushcli import __version__


def versions() -> dict[str, str]:
    """Return program -> version: bushcli, python, dolfinx, gmsh, numpy, scipy, petsc."""
    found = {"bushcli": __version__, "python": platform.python_version()}
    for name in ("dolfinx", "gmsh", "numpy", "scipy"):
        module = importlib.import_module(name)
        found[name] = str(getattr(module, "__version__", "")) or importlib.metadata.version(name)
    petsc = importlib.import_module("petsc4py.PETSc")
    found["petsc"] = ".".join(map(str, petsc.Sys.getVersion()))
    return found
