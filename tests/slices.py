"""Slices of bushings, a block and a cylinder in plane strain: one layer of elements, held in its plane."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import gmsh
import numpy as np
from typing_extensions import override

from geometry.shape import Meeting, Meets, Sleeve

# Half of the model's thickness (mm); the force of the whole model is divided by twice this.
LAYER = 1.0


class Slice(Meets):
    """The upper half (y > 0) of a plane region, extruded; both faces are planes of symmetry."""

    contact: Meeting = True

    name: ClassVar[str] = "slice"
    summary: ClassVar[str] = "a slab in plane strain"
    structured: ClassVar[bool] = False
    size: float = 0.8

    @property
    @override
    def mirror_planes(self):
        return frozenset({"y", "z"})

    def draw(self) -> int:
        """Return the tag of the plane region, whole or its upper half."""
        raise NotImplementedError

    def boundary(self, x: float, y: float) -> str:
        """Return the name of the boundary to which the edge with this midpoint belongs."""
        raise NotImplementedError

    @override
    def generate(self, dimension, mirrors, refinement):
        size = self.size / refinement.factor
        face = self.draw()
        half = gmsh.model.occ.addRectangle(-100, 0, 0, 200, 100)
        out, _ = gmsh.model.occ.intersect([(2, face)], [(2, half)])
        gmsh.model.occ.synchronize()
        # Auxiliary points of the geometry would become nodes without an element.
        used = set(gmsh.model.getBoundary(out, recursive=True))
        gmsh.model.occ.remove([point for point in gmsh.model.getEntities(0) if point not in used])
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 0.2 * size)
        gmsh.option.setNumber("Mesh.Algorithm", 8)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)
        self.grade(size)
        for _, tag in out:
            gmsh.model.mesh.setRecombine(2, tag)
        gmsh.model.occ.extrude(out, 0, 0, LAYER, numElements=[1], recombine=True)
        gmsh.model.occ.synchronize()
        _generate()
        gmsh.model.mesh.setOrder(2)
        return self.groups()

    def grade(self, size: float) -> None:
        """Refine the mesh locally; a subclass says where."""

    def regions(self, volumes: list[int]) -> dict[str, list[int]]:
        """Return the volumes of each body."""
        return {"rubber": volumes}

    def groups(self):
        names: dict[int, dict[str, int]] = {2: {}, 3: {}}
        volumes = [tag for _, tag in gmsh.model.getEntities(3)]
        for region, tags in self.regions(volumes).items():
            names[3][region] = gmsh.model.addPhysicalGroup(3, tags)
        parts: dict[str, list[int]] = {}
        for _, tag in gmsh.model.getBoundary([(3, v) for v in volumes], oriented=False):
            _, _, z0, _, y1, z1 = gmsh.model.getBoundingBox(2, tag)
            lower, upper = gmsh.model.getParametrizationBounds(2, tag)
            middle = gmsh.model.getValue(2, tag, [0.5 * (a + b) for a, b in zip(lower, upper, strict=True)])
            if z1 - z0 < 1e-3:
                name = "mirror_z"
            elif y1 < 1e-3 and "y" in self.mirror_planes:
                name = "mirror_y"
            else:
                name = self.boundary(middle[0], middle[1])
            parts.setdefault(name, []).append(tag)
        for name, tags in parts.items():
            names[2][name] = gmsh.model.addPhysicalGroup(2, tags)
        return names


def _generate() -> None:
    """Mesh the layer; base curves with an odd number of elements get one more, because newer Gmsh refuses them."""
    try:
        gmsh.model.mesh.generate(3)
    except Exception as error:
        if "divided by 2" not in str(error):
            raise
        gmsh.model.mesh.clear()
        gmsh.model.mesh.generate(1)
        for _, curve in gmsh.model.getEntities(1):
            _, _, low, _, _, high = gmsh.model.getBoundingBox(1, curve)
            number = sum(map(len, gmsh.model.mesh.getElements(1, curve)[1]))
            if number % 2 and max(abs(low), abs(high)) < 1e-3:
                gmsh.model.mesh.setTransfiniteCurve(curve, number + 2)
        gmsh.model.mesh.clear()
        gmsh.model.mesh.generate(3)


class KidneySlice(Slice):
    """The kidney bushing of the references (10/22, voids 14 to 18 over +-50 degrees), with or without its bump stop."""

    name: ClassVar[str] = "kidney_slice"
    bump: bool = False
    # Size of the elements around the voids' tips, mm; None = as everywhere else.
    tip: float | None = None

    @override
    def draw(self) -> int:
        occ = gmsh.model.occ
        ring, _ = occ.cut([(2, occ.addDisk(0, 0, 0, 22, 22))], [(2, occ.addDisk(0, 0, 0, 10, 10))])
        voids = [(2, self._void(1.0)), (2, self._void(-1.0))]
        out, _ = occ.cut(ring, voids)
        if self.bump:
            out, _ = occ.fuse(out, [(2, self._bump())])
        assert len(out) == 1
        return int(out[0][1])

    @override
    def grade(self, size):
        if self.tip is None:
            return
        half = math.radians(42.81924421854172)
        balls = []
        for side in (-1, 1):
            ball = gmsh.model.mesh.field.add("Ball")
            values = {"Radius": 2.5, "Thickness": 4.0, "VIn": self.tip * size / self.size, "VOut": size}
            values |= {"XCenter": side * 16 * math.cos(half), "YCenter": 16 * math.sin(half)}
            for key, value in values.items():
                gmsh.model.mesh.field.setNumber(ball, key, value)
            balls.append(ball)
        least = gmsh.model.mesh.field.add("Min")
        gmsh.model.mesh.field.setNumbers(least, "FieldsList", balls)
        gmsh.model.mesh.field.setAsBackgroundMesh(least)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)

    def _void(self, side: float) -> int:
        occ, half = gmsh.model.occ, math.radians(42.81924421854172)
        outer = occ.addDisk(0, 0, 0, 18, 18)
        annulus, _ = occ.cut([(2, outer)], [(2, occ.addDisk(0, 0, 0, 14, 14))])
        far = 100.0
        points = [
            occ.addPoint(0, 0, 0),
            occ.addPoint(side * far * math.cos(half), -far * math.sin(half), 0),
            occ.addPoint(side * far * math.cos(half), far * math.sin(half), 0),
        ]
        lines = [occ.addLine(points[i], points[(i + 1) % 3]) for i in range(3)]
        wedge = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        arc, _ = occ.intersect(annulus, [(2, wedge)])
        ends = [
            (2, occ.addDisk(side * 16 * math.cos(half), sign * 16 * math.sin(half), 0, 2, 2))
            for sign in (-1, 1)
        ]
        out, _ = occ.fuse(arc, ends)
        return int(out[0][1])

    def _bump(self) -> int:
        occ = gmsh.model.occ

        def at(r: float, degrees: float) -> int:
            angle = math.radians(degrees)
            return int(occ.addPoint(r * math.cos(angle), r * math.sin(angle), 0))

        centre = occ.addPoint(0, 0, 0)
        corners = [at(14, -20), at(17.2, -12), at(17.2, 12), at(14, 20)]
        loop = [
            occ.addLine(corners[0], corners[1]),
            occ.addCircleArc(corners[1], centre, corners[2]),
            occ.addLine(corners[2], corners[3]),
            occ.addCircleArc(corners[3], centre, corners[0]),
        ]
        return int(occ.addPlaneSurface([occ.addCurveLoop(loop)]))

    @override
    def boundary(self, x, y):
        r = math.hypot(x, y)
        return "inner" if abs(r - 10) < 1e-3 else "outer" if abs(r - 22) < 1e-3 else "void"


class Pillow(Slice):
    """A block of 20 by 6 mm held at its sides: whole, or cut into two that touch and are meshed separately."""

    name: ClassVar[str] = "pillow"
    split: bool = False
    height: ClassVar[float] = 6.0

    @override
    def generate(self, dimension, mirrors, refinement):
        occ = gmsh.model.occ
        spans = [(-10.0, 10.0, 7)] if not self.split else [(-10.0, 0.0, 4), (0.0, 10.0, 7)]
        faces = [occ.addRectangle(x, 0, 0, end - x, self.height) for x, end, _ in spans]
        occ.synchronize()
        for face, (_, _, count) in zip(faces, spans, strict=True):
            for _, line in gmsh.model.getBoundary([(2, face)], oriented=False):
                gmsh.model.mesh.setTransfiniteCurve(line, count)
            gmsh.model.mesh.setTransfiniteSurface(face)
            gmsh.model.mesh.setRecombine(2, face)
        occ.extrude([(2, face) for face in faces], 0, 0, LAYER, numElements=[1], recombine=True)
        occ.synchronize()
        _generate()
        gmsh.model.mesh.setOrder(2)
        return self.groups()

    @override
    def boundary(self, x, y):
        if abs(y - self.height) < 1e-3:
            return "mirror_y"
        return "inner" if abs(x + 10) < 1e-3 else "outer" if abs(x - 10) < 1e-3 else "void"


class Arches(Slice):
    """Two arches between plates at x = -6 and 6, curved towards the plane y = 0; or the upper one alone."""

    name: ClassVar[str] = "arches"
    both: bool = False

    @property
    @override
    def mirror_planes(self):
        return frozenset({"z"} if self.both else {"y", "z"})

    @override
    def generate(self, dimension, mirrors, refinement):
        occ = gmsh.model.occ
        faces = [self._arch(sign) for sign in ((1, -1) if self.both else (1,))]
        occ.synchronize()
        for face in faces:
            for _, line in gmsh.model.getBoundary([(2, face)], oriented=False):
                low, high = gmsh.model.getParametrizationBounds(1, line)
                upright = (
                    abs(gmsh.model.getValue(1, line, low)[0] - gmsh.model.getValue(1, line, high)[0]) < 1e-3
                )
                gmsh.model.mesh.setTransfiniteCurve(line, 3 if upright else 11)
            gmsh.model.mesh.setTransfiniteSurface(face)
            gmsh.model.mesh.setRecombine(2, face)
        occ.extrude([(2, face) for face in faces], 0, 0, LAYER, numElements=[1], recombine=True)
        occ.synchronize()
        _generate()
        gmsh.model.mesh.setOrder(2)
        return self.groups()

    def _arch(self, sign: int) -> int:
        occ = gmsh.model.occ
        lower, upper = (
            [occ.addPoint(x, sign * (0.2 + rise + 2.0 * (x / 6.0) ** 2), 0) for x in (-6, -3, 0, 3, 6)]
            for rise in (0.0, 1.5)
        )
        curves = [occ.addBSpline(lower), occ.addLine(lower[-1], upper[-1])]
        curves += [occ.addBSpline(upper), occ.addLine(upper[0], lower[0])]
        # Control points would become nodes without an element.
        occ.remove([(0, point) for point in (*lower[1:-1], *upper[1:-1])])
        return int(occ.addPlaneSurface([occ.addCurveLoop(curves)]))

    @override
    def boundary(self, x, y):
        return "inner" if abs(x + 6) < 1e-3 else "outer" if abs(x - 6) < 1e-3 else "void"


class Roller(Slice):
    """Half of a rubber cylinder, R 10, with a hard plate at x = 10; its mid-plane is held along x only."""

    name: ClassVar[str] = "roller"
    radius: ClassVar[float] = 10.0
    near: float = 0.1

    @property
    @override
    def elastic_sleeves(self):
        return {"plate": Sleeve(thickness=0.5, youngs_modulus=1e5, poissons_ratio=0.3)}

    @override
    def generate(self, dimension, mirrors, refinement):
        occ, R = gmsh.model.occ, self.radius
        quarter = occ.addRectangle(0, 0, 0, R, R)
        body, _ = occ.intersect([(2, occ.addDisk(0, 0, 0, R, R))], [(2, quarter)])
        plate = occ.addRectangle(R, 0, 0, 0.5, 3.0)
        occ.synchronize()
        ball = gmsh.model.mesh.field.add("Ball")
        values = {"Radius": 1.1, "Thickness": 8.0, "VIn": self.near, "VOut": self.size, "XCenter": R}
        for key, value in values.items():
            gmsh.model.mesh.field.setNumber(ball, key, value)
        gmsh.model.mesh.field.setAsBackgroundMesh(ball)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.Algorithm", 8)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)
        for _, face in (*body, (2, plate)):
            gmsh.model.mesh.setRecombine(2, face)
        occ.extrude([*body, (2, plate)], 0, 0, LAYER, numElements=[1], recombine=True)
        occ.synchronize()
        _generate()
        gmsh.model.mesh.setOrder(2)
        return self.groups()

    @override
    def regions(self, volumes):
        at = {tag: gmsh.model.occ.getCenterOfMass(3, tag)[0] for tag in volumes}
        hard = [tag for tag in volumes if at[tag] > self.radius]
        return {"rubber": [tag for tag in volumes if tag not in hard], "plate": hard}

    @override
    def boundary(self, x, y):
        return "outer" if x < 1e-3 else "inner" if x > self.radius + 0.5 - 1e-3 else "void"


def slices(shape: Slice, mode: Any, rubber: Any, q: Any, **more: Any) -> tuple[Any, Any]:
    """Return the model and the march of a slice; forces are per unit length (N/mm)."""
    from dataclasses import replace

    from cases.march import march
    from cases.program import Program
    from cases.simulate import prepare

    model = prepare(shape, mode, rubber)
    history = march(model, Program(np.asarray(q)), **more)
    return model, replace(history, force=history.force / (2 * LAYER))
