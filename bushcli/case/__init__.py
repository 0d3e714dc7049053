"""TOML -> Case: one validated, frozen value with internal units (N, mm, MPa, s, rad).

``load_case`` reads a case file; ``case_json`` turns a case back into plain JSON-ready data with angles in degrees.
Everything that is wrong is reported at once, with file, key, what was expected and the nearest valid name.
"""

from bushcli.case.case import Case, Material, MeshOptions, case_json
from bushcli.case.load import load_case, load_part, shape_of_part
from bushcli.case.loads import DynamicTest, LoadCase
from bushcli.case.starter import starter_case

__all__ = [
    "Case",
    "DynamicTest",
    "LoadCase",
    "Material",
    "MeshOptions",
    "case_json",
    "load_case",
    "load_part",
    "shape_of_part",
    "starter_case",
]
