"""Radial curve of a bushing by FElupe: second-order hexahedra, three fields, continuous pressure and volume.

    python solid.py < task.json

Run by `external.py` in FElupe's environment; it needs only NumPy, SciPy and FElupe. The task: `dimensions` (mm),
`yeoh` (MPa), `bulk`, `volumetric` ("simple" or "log"), `targets` (mm, one side, outward), and as needed `free` (mm of
debonded length, with `sleeve`, `end` and `on_line`: a line of the mesh where the bond ends), `reduction`, `shrinkage`
and `offset`, each a mean and a slope (along the axis over half the length; of the shrinkage across the thickness).
Prints the forces as JSON.
"""

import json
import sys

import felupe as fem
import numpy as np
from felupe.math import cdya_ik, cdya_il, det, dya, inv, transpose
from scipy.sparse.linalg import splu

TOLERANCE, MOST, HALVINGS = 1e-7, 25, 5
ACROSS, HALF, AROUND = 3, 4, 6
# Further lines beside one where a bond ends, over the distance to its neighbours.
CLOSING_IN = (0.5, 0.2, 0.07)


class Yeoh:
    """Isochoric Yeoh law."""

    def __init__(self, C10, C20, C30):
        self.c = C10, C20, C30
        self.x = [np.eye(3), np.zeros(0)]

    def parts(self, F):
        """F^-T, J^(-2/3), I1 of C, first and second derivative of W by the isochoric one."""
        T = transpose(inv(F))
        s = det(F) ** (-2 / 3)
        I1 = np.einsum("ij...,ij...->...", F, F)
        e = s * I1 - 3
        a, b, c = self.c
        return T, s, I1, a + 2 * b * e + 3 * c * e**2, 2 * b + 6 * c * e

    def gradient(self, x, *args, out=None, **kwargs):
        """First Piola-Kirchhoff stress."""
        F = x[0]
        T, s, I1, slope, _ = self.parts(F)
        return [2 * slope * s * (F - I1 / 3 * T), x[-1]]

    def hessian(self, x, *args, out=None, **kwargs):
        """Derivative of the stress by F."""
        F = x[0]
        T, s, I1, slope, curvature = self.parts(F)
        D = 2 * s * (F - I1 / 3 * T)
        unit = np.broadcast_to(np.eye(3).reshape(3, 3, *[1] * (F.ndim - 2)), F.shape)
        mixed = 2 * s * cdya_ik(unit, unit) - 2 / 3 * dya(D, T) - 4 / 3 * s * dya(T, F)
        return [curvature * dya(D, D) + slope * (mixed + 2 * s * I1 / 3 * cdya_il(T, T))]


def graded_points(n, ratio, fine):
    k, m = np.arange(n), max(n - 1, 1)
    depth = {"stop": k, "both": np.abs(2 * k - m)}[fine] / m
    lengths = ratio**-depth
    return np.append(0.0, np.cumsum(lengths) / lengths.sum())


def main():
    task = json.load(sys.stdin)
    d = task["dimensions"]
    a, b = d["inner_radius"], d["outer_radius"]
    lengths = [d.get(k, d.get("length")) for k in ("inner_length", "outer_length")]
    reduction, offset = task.get("reduction", [0, 0]), task.get("offset", [0, 0])
    shrinkage, free = task.get("shrinkage", [0, 0]), task.get("free", 0.0)
    whole = bool(free or reduction[1] or offset[1])
    t = graded_points(HALF, 6.0, "stop")
    if whole:
        t = np.unique(np.concatenate([-t, t]))
    if task.get("on_line"):
        half = 0.5 * lengths[0 if task["sleeve"] == "inner" else 1]
        at = (1 if task["end"] == "top" else -1) * (1 - free / half)
        i = 1 + int(np.argmin(np.abs(t[1:-1] - at)))
        t = np.interp(t, [-1.0, t[i], 1.0], [-1.0, at, 1.0])
        below, above = t[i] - t[i - 1], t[i + 1] - t[i]
        closer = [at + share * np.array([-below, above]) for share in CLOSING_IN]
        t = np.unique(np.concatenate([t, *closer]))
    mesh = fem.mesh.Grid(graded_points(ACROSS, 2.0, "both"), np.linspace(0, np.pi, AROUND + 1), t)
    mesh = mesh.add_midpoints_edges().add_midpoints_faces().add_midpoints_volumes()
    s, angle, t = mesh.points.T.copy()
    r, half = a + s * (b - a), 0.5 * (lengths[0] + s * (lengths[1] - lengths[0]))
    # The inner sleeve is off its axis at rest, and the rubber is shifted in proportion, free of stress.
    moved = (offset[0] + offset[1] * t) * (1 - s)
    mesh.points[:] = np.column_stack([r * np.cos(angle) + moved, r * np.sin(angle), t * half])
    field = fem.FieldsMixed(fem.RegionTriQuadraticHexahedron(mesh), n=3, disconnect=False)
    # A number where nothing shrinks: larger meshes are integrated in parts.
    strain = 0.0
    if shrinkage[0] or shrinkage[1]:
        X = fem.Field(field.region, dim=1, values=s[:, None]).interpolate()[0]
        strain = shrinkage[0] + shrinkage[1] * (X - 0.5)
    rest = (1 - strain) ** 3
    if task.get("volumetric") == "log":
        dU, ddU = (
            (lambda J, k: k / 2 * (J / rest - rest / J)),
            (lambda J, k: k / 2 * (1 / rest + rest / J**2)),
        )
    else:
        dU, ddU = (lambda J, k: k * (J / rest - 1)), (lambda J, k: k / rest * np.ones_like(J))
    material = fem.NearlyIncompressible(Yeoh(*task["yeoh"]), bulk=task["bulk"], dUdJ=dU, d2UdJdJ=ddU)
    body = fem.SolidBody(material, field)
    sizes, shape = [f.values.size for f in field.fields], field[0].values.shape
    inner, outer = np.isclose(s, 0), np.isclose(s, 1)
    bonded = {"inner": inner, "outer": outer}
    if free:
        top = 1 if task["end"] == "top" else -1
        sleeve = bonded[task["sleeve"]]
        bonded[task["sleeve"]] = sleeve & (top * t * half <= half - free + 1e-9)
    held = np.zeros(shape, dtype=bool)
    held[bonded["inner"] | bonded["outer"]] = True
    held[np.isclose(angle, 0) | np.isclose(angle, np.pi), 1] = True
    if not whole:
        held[np.isclose(t, 0), 2] = True
    base, driven = np.zeros(shape), np.zeros(shape)
    driven[bonded["inner"], 0] = 1.0
    inward = np.where(bonded["outer"], reduction[0] + reduction[1] * t, 0.0)
    base[:, 0], base[:, 1] = -inward * np.cos(angle), -inward * np.sin(angle)
    rest_of = np.zeros(sum(sizes[1:]))
    fixed = np.concatenate([held.ravel(), rest_of.astype(bool)])
    driven, base = np.concatenate([driven.ravel(), rest_of]), np.concatenate([base.ravel(), rest_of])
    free_dofs = np.flatnonzero(~fixed)
    # Factors for half of the circumference and half of the length.
    share = 2 if whole else 4

    def put(x):
        for f, part in zip(field.fields, np.split(x, np.cumsum(sizes)[:-1]), strict=True):
            f.values[:] = part.reshape(f.values.shape)

    def solve(x, target):
        """Newton's method, whose first step moves boundary and interior together."""
        size = None
        for k in range(MOST):
            put(x)
            r = body.assemble.vector(field).toarray().ravel()
            rest = np.linalg.norm(r[free_dofs])
            size = np.linalg.norm(r[fixed])
            jump = np.where(fixed, target - x, 0.0)
            if not np.any(jump) and (rest <= TOLERANCE * max(size, 1e-3)):
                return x, float(r @ driven)
            if not np.isfinite(rest) or (k > 1 and rest > 1e8):
                return None
            K = body.assemble.matrix(field).tocsr()
            right = r[free_dofs] + (K @ jump)[free_dofs]
            step = splu(K[free_dofs][:, free_dofs].tocsc()).solve(right)
            x = x + jump
            x[free_dofs] -= step
        return None

    def go(x, begin, end, halvings):
        """From one boundary state to another, halved where that fails."""
        solution = solve(x, end)
        if solution is not None:
            return solution
        if halvings == 0:
            raise SystemExit("no convergence")
        middle = 0.5 * (begin + end)
        x, _ = go(x, begin, middle, halvings - 1)
        return go(x, middle, end, halvings - 1)

    x = np.concatenate([f.values.ravel() for f in field.fields])
    at = np.zeros(len(x))
    if shrinkage[0] or shrinkage[1] or np.any(base):
        for k in range(1, 5):
            x, force = go(x, at, base * k / 4, HALVINGS)
            at = base * k / 4
    forces, last = [], at
    for q in task["targets"]:
        x, force = go(x, last, base + q * driven, HALVINGS)
        last = base + q * driven
        forces.append(share * force)
    print(json.dumps(forces))


if __name__ == "__main__":
    main()
