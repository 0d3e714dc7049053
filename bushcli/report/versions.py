"""Versions of the programs on which the numbers of a result depend."""

from __future__ import annotations

import importlib
import importlib.metadata
import platform
import sys

from bushcli import __version__

# Program -> its Python package, and the distribution that declares its version.
_PROGRAMS = {
    "dolfinx": ("dolfinx", "fenics-dolfinx"),
    "gmsh": ("gmsh", "gmsh"),
    "numpy": ("numpy", "numpy"),
    "scipy": ("scipy", "scipy"),
}


def versions() -> dict[str, str]:
    """Return program -> version: bushcli, python, dolfinx, gmsh, numpy, scipy, petsc.

    The programs are not loaded where avoidable: `bushcli check` needs no finite elements, which take half a second to
    load.
    """
    found = {"bushcli": __version__, "python": platform.python_version()}
    for name, (module, distribution) in _PROGRAMS.items():
        found[name] = str(getattr(sys.modules.get(module), "__version__", "")) or _declared(
            module, distribution
        )
    petsc = sys.modules.get("petsc4py.PETSc")
    if petsc is not None:
        found["petsc"] = ".".join(map(str, petsc.Sys.getVersion()))
    else:
        # petsc4py is released with PETSc, and their version numbers agree except for the last part.
        found["petsc"] = ".".join(_declared("petsc4py", "petsc4py").split(".")[:2])
    return found


def _declared(module: str, distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return str(importlib.import_module(module).__version__)
