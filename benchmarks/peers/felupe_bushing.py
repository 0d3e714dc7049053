"""The problem in FElupe: second-order elements, three-field u-p-J, SuperLU, parabolic predictor, full Newton.

    python felupe_bushing.py axial|radial RADIALxAXIALxAROUND

Elements: across the rubber; along its length (half of it for radial load); around half the circumference. Prints
one line of JSON.
"""

import json
import sys
import time
from pathlib import Path

begin = time.perf_counter()
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import felupe as fem  # noqa: E402
import numpy as np  # noqa: E402
from felupe.math import cdya_ik, cdya_il, det, dya, inv, transpose  # noqa: E402
from problem import C10, C20, C30, INNER_RADIUS, KAPPA, OUTER_RADIUS, arguments, heights, radii  # noqa: E402
from scipy.sparse.linalg import spsolve  # noqa: E402

TOLERANCE = 1e-7


class Yeoh:
    """Isochoric Yeoh law with derivatives by hand: FElupe's is differentiated automatically, which is slower."""

    def __init__(self):
        self.x = [np.eye(3), np.zeros(0)]

    def parts(self, F):
        """F^-T, J^(-2/3), the first invariant of C, first and second derivative of W by the isochoric one."""
        T = transpose(inv(F))
        s = det(F) ** (-2 / 3)
        I1 = np.einsum("ij...,ij...->...", F, F)
        e = s * I1 - 3
        return T, s, I1, C10 + 2 * C20 * e + 3 * C30 * e**2, 2 * C20 + 6 * C30 * e

    def gradient(self, x, *args, out=None, **kwargs):
        """First Piola-Kirchhoff stress."""
        F = x[0]
        T, s, I1, slope, _ = self.parts(F)
        return [2 * slope * s * (F - I1 / 3 * T), x[-1]]

    def hessian(self, x, *args, out=None, **kwargs):
        """Derivative of the stress by the deformation gradient."""
        F = x[0]
        T, s, I1, slope, curvature = self.parts(F)
        D = 2 * s * (F - I1 / 3 * T)
        unit = np.broadcast_to(np.eye(3).reshape(3, 3, *[1] * (F.ndim - 2)), F.shape)
        return [
            curvature * dya(D, D)
            + slope
            * (
                2 * s * cdya_ik(unit, unit)
                - 2 / 3 * dya(D, T)
                - 4 / 3 * s * dya(T, F)
                + 2 * s * I1 / 3 * cdya_il(T, T)
            )
        ]


def model(mode, elements):
    """Mixed field, and the points of the inner bond, the outer bond and the mirror planes by component."""
    across, along, *around = elements
    R, Z = radii(across), heights(along, mode)
    if mode == "axial":
        # FElupe's axis of revolution is the first coordinate, the radius the second.
        mesh = fem.mesh.Grid(Z, R).add_midpoints_edges().add_midpoints_faces()
        radius, mirrors = mesh.points[:, 1].copy(), {}
        region = fem.RegionBiQuadraticQuad(mesh)
    else:
        angle = np.linspace(0, np.pi, around[0] + 1)
        mesh = fem.mesh.Grid(R, angle, Z).add_midpoints_edges().add_midpoints_faces().add_midpoints_volumes()
        radius, angle, height = mesh.points.T.copy()
        mirrors = {1: np.isclose(angle, 0) | np.isclose(angle, np.pi), 2: np.isclose(height, 0)}
        mesh.points[:] = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
        region = fem.RegionTriQuadraticHexahedron(mesh)
    # Continuous dual fields: half the error of FElupe's default (discontinuous fields), and fewer unknowns.
    field = fem.FieldsMixed(region, n=3, axisymmetric=mode == "axial", disconnect=False)
    return field, np.isclose(radius, INNER_RADIUS), np.isclose(radius, OUTER_RADIUS), mirrors


def main():
    task, elements = arguments()
    field, inner, outer, mirrors = model(task.mode, elements)
    body = fem.SolidBody(fem.NearlyIncompressible(Yeoh(), bulk=KAPPA), field)
    sizes = [f.values.size for f in field.fields]
    shape = field[0].values.shape
    held = np.zeros(shape, dtype=bool)
    held[inner | outer] = True
    for component, points in mirrors.items():
        held[points, component] = True
    driven = np.zeros(shape)
    # Along the axis, which is the first coordinate, or along x.
    driven[inner, 0] = 1.0
    fixed = np.concatenate([held.ravel(), np.zeros(sum(sizes[1:]), dtype=bool)])
    driven = np.concatenate([driven.ravel(), np.zeros(sum(sizes[1:]))])
    free = np.flatnonzero(~fixed)
    share = 1 if task.mode == "axial" else 4
    setup = time.perf_counter()

    def put(x):
        for f, part in zip(field.fields, np.split(x, np.cumsum(sizes)[:-1]), strict=True):
            f.values[:] = part.reshape(f.values.shape)

    x = np.concatenate([f.values.ravel() for f in field.fields])
    known, forces, iterations = [(0.0, x)], [], 0
    for q in task.displacement:
        x = 0.0
        for i, (n, state) in enumerate(known):
            x = x + state * np.prod([(q - m) / (n - m) for j, (m, _) in enumerate(known) if j != i])
        x = np.where(fixed, q * driven, x)
        for _ in range(25):
            put(x)
            r = body.assemble.vector(field).toarray().ravel()
            if np.linalg.norm(r[free]) <= TOLERANCE * np.linalg.norm(r[fixed]):
                break
            K = body.assemble.matrix(field).tocsr()
            x[free] -= spsolve(K[free][:, free].tocsc(), r[free])
            iterations += 1
        else:
            raise SystemExit(f"no convergence at {q}")
        forces.append(share * float(r @ driven))
        known = [*known, (float(q), x)][-3:]
    end = time.perf_counter()
    print(
        json.dumps(
            {
                "version": fem.__version__,
                "unknowns": len(x),
                "newton": iterations,
                "setup": setup - begin,
                "solve": end - setup,
                "displacement": task.displacement.tolist(),
                "force": forces,
            }
        )
    )


if __name__ == "__main__":
    main()
