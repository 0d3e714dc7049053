"""Print this interpreter's path if it imports a real-valued DOLFINx >= 0.9; fail with the reason if not."""

import sys

import dolfinx
from petsc4py import PETSc

python = ".".join(map(str, sys.version_info[:2]))
if tuple(map(int, python.split("."))) < (3, 11):
    sys.exit(f"Python {python} is older than 3.11")
if tuple(int(part) for part in dolfinx.__version__.split(".")[:2]) < (0, 9):
    sys.exit(f"DOLFINx {dolfinx.__version__} is older than 0.9")
if PETSc.ScalarType(0).dtype.kind != "f":
    sys.exit("PETSc computes with complex numbers here")
sys.stdout.write(sys.executable + "\n")
