"""Print this interpreter's path if it imports a real-valued DOLFINx of a tested release; else say why not."""

import re
import sys
from pathlib import Path

import dolfinx
from petsc4py import PETSc

python = ".".join(map(str, sys.version_info[:2]))
if tuple(map(int, python.split("."))) < (3, 11):
    sys.exit(f"Python {python} is older than 3.11")
listed = Path(__file__).with_name("packages.txt").read_text(encoding="utf-8")
bounds = re.search(r"fenics-dolfinx>=(\d+)\.(\d+),<(\d+)\.(\d+)", listed)
first, beyond = tuple(map(int, bounds.groups()[:2])), tuple(map(int, bounds.groups()[2:]))
if not first <= tuple(int(part) for part in dolfinx.__version__.split(".")[:2]) < beyond:
    sys.exit(f"DOLFINx {dolfinx.__version__} is not a tested release: {bounds.group()}")
if PETSc.ScalarType(0).dtype.kind != "f":
    sys.exit("this PETSc computes with complex numbers")
sys.stdout.write(sys.executable + "\n")
