"""Hertz's contact: a rubber ball between hard plates, in the half-plane, and the theory of small contacts.

Johnson (1985), Contact Mechanics, sections 4.2 and 5.6, doi:10.1017/CBO9781139171731.
"""

from __future__ import annotations

from typing import ClassVar

import gmsh
import numpy as np
from scipy.optimize import brentq
from typing_extensions import override

from cases.simulate import Rubber
from forms.law import laws
from geometry.shape import Meeting, Meets, Sleeve

RUBBER = Rubber(laws()["neo_hookean"], {"C10": 0.5}, 2000.0)
RADIUS, BULK, SHEAR = 10.0, 2000.0, 1.0
#: E / (1 - nu^2), MPa.
PLANE = 2 * SHEAR / (1 - (3 * BULK - 2 * SHEAR) / (2 * (3 * BULK + SHEAR)))


def hertz(approach: float) -> float:
    """Force (N) on a ball whose centre a hard plate approaches (mm); valid for contacts much smaller than the ball."""
    return float(4.0 / 3.0 * PLANE * np.sqrt(RADIUS) * approach**1.5)


def johnson(approach: float) -> float:
    """Force (N/mm) on a cylinder between two hard plates; `approach` is that of one plate to its axis, mm."""

    def of(force: float) -> float:
        width = np.sqrt(4 * force * RADIUS / (np.pi * PLANE))
        return float(2 * force / (np.pi * PLANE) * (np.log(4 * RADIUS / width) - 0.5))

    return float(brentq(lambda force: of(force) - approach, 1e-6, 10.0))


class Ball(Meets):
    """Half of a ball, R 10, its equator (`outer`) held along the axis alone, below a hard plate at z = 10."""

    contact: Meeting = True

    name: ClassVar[str] = "ball"
    summary: ClassVar[str] = "half of a ball below a hard plate"
    structured: ClassVar[bool] = False
    axisymmetric: ClassVar[bool] = True
    # Thickness of the plate, mm.
    thick: ClassVar[float] = 0.5
    size: float = 2.0
    # Size of the elements within the radius `around` of the pole, mm.
    near: float = 0.02
    around: float = 0.3

    @property
    @override
    def elastic_sleeves(self):
        return {"plate": Sleeve(thickness=self.thick, youngs_modulus=1e6, poissons_ratio=0.3)}

    @override
    def generate(self, dimension, mirrors, refinement):
        occ, R = gmsh.model.occ, RADIUS
        quarter = occ.addRectangle(0, 0, 0, R, R)
        body, _ = occ.intersect([(2, occ.addDisk(0, 0, 0, R, R))], [(2, quarter)])
        plate = occ.addRectangle(0, R, 0, 3.0, self.thick)
        occ.synchronize()
        near = gmsh.model.mesh.field.add("Ball")
        values = {"Radius": self.around, "Thickness": 9.0, "VIn": self.near, "VOut": self.size, "YCenter": R}
        for key, value in values.items():
            gmsh.model.mesh.field.setNumber(near, key, value / refinement.factor if key[0] == "V" else value)
        gmsh.model.mesh.field.setAsBackgroundMesh(near)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        parts: dict[str, list[int]] = {}
        for _, tag in gmsh.model.getBoundary([*body, (2, plate)], oriented=False):
            low, high = gmsh.model.getParametrizationBounds(1, tag)
            r, z, _ = gmsh.model.getValue(1, tag, [0.5 * (low[0] + high[0])])
            top = R + self.thick
            name = "axis" if r < 1e-6 else "outer" if z < 1e-6 else "inner" if z > top - 1e-6 else "free"
            parts.setdefault(name, []).append(tag)
        names = {1: {}, 2: {"rubber": [body[0][1]], "plate": [plate]}}
        names[2] = {name: gmsh.model.addPhysicalGroup(2, tags) for name, tags in names[2].items()}
        names[1] = {name: gmsh.model.addPhysicalGroup(1, tags) for name, tags in parts.items()}
        return names
