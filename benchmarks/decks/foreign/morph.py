"""Axial force of a bushing of MORPH rubber by FElupe, with FElupe's model and automatic differentiation.

    python morph.py < task.json

Run by `external.py` in FElupe's environment. The task: `dimensions` (mm), `p` (the eight parameters), `bulk` (MPa),
`displacement` (mm, samples in order). Prints the forces as JSON.
"""

import json
import sys

import felupe as fem
import felupe.constitution.tensortrax as mat
import numpy as np
from scipy.sparse.linalg import splu

TOLERANCE, MOST, HALVINGS = 1e-6, 20, 5
ACROSS, ALONG = 4, 8


def graded_points(n, ratio):
    k, m = np.arange(n), max(n - 1, 1)
    lengths = ratio ** -(np.abs(2 * k - m) / m)
    return np.append(0.0, np.cumsum(lengths) / lengths.sum())


def main():
    task = json.load(sys.stdin)
    d = task["dimensions"]
    a, b = d["inner_radius"], d["outer_radius"]
    lengths = [d.get(k, d.get("length")) for k in ("inner_length", "outer_length")]
    mesh = (
        fem.mesh.Grid(2 * graded_points(ALONG, 2.0) - 1, graded_points(ACROSS, 2.0))
        .add_midpoints_edges()
        .add_midpoints_faces()
    )
    t, s = mesh.points.T.copy()
    mesh.points[:] = np.column_stack(
        [0.5 * t * (lengths[0] + s * (lengths[1] - lengths[0])), a + s * (b - a)]
    )
    region = fem.RegionBiQuadraticQuad(mesh)
    field = fem.FieldsMixed(region, n=3, axisymmetric=True, disconnect=False)
    umat = mat.Material(mat.models.lagrange.morph, p=task["p"], nstatevars=13)
    body = fem.SolidBody(fem.NearlyIncompressible(umat, bulk=task["bulk"]), field)
    # The state of virgin rubber: C is the unit tensor.
    body.results.statevars[1] = body.results.statevars[4] = body.results.statevars[6] = 1.0
    sizes, shape = [f.values.size for f in field.fields], field[0].values.shape
    inner, outer = np.isclose(s, 0), np.isclose(s, 1)
    held, driven = np.zeros(shape, dtype=bool), np.zeros(shape)
    held[inner | outer] = True
    driven[inner, 0] = 1.0
    others = np.zeros(sum(sizes[1:]))
    fixed = np.concatenate([held.ravel(), others.astype(bool)])
    driven = np.concatenate([driven.ravel(), others])
    free = np.flatnonzero(~fixed)
    largest = [1e-3]

    def put(x):
        for f, part in zip(field.fields, np.split(x, np.cumsum(sizes)[:-1]), strict=True):
            f.values[:] = part.reshape(f.values.shape)

    def solve(x, q):
        lu = None
        for _ in range(MOST):
            put(x)
            r = body.assemble.vector(field).toarray().ravel()
            rest, size = np.linalg.norm(r[free]), np.linalg.norm(r[fixed])
            jump = np.where(fixed, q * driven - x, 0.0)
            if not np.any(jump) and rest <= TOLERANCE * max(size, 0.05 * max(largest)):
                largest.append(size)
                return x, float(r @ driven)
            if not np.isfinite(rest) or rest > 1e8:
                return None
            K = body.assemble.matrix(field).tocsr()
            lu = splu(K[free][:, free].tocsc())
            step = lu.solve(r[free] + (K @ jump)[free])
            x = x + jump
            x[free] -= step
        return None

    def go(x, begin, end, halvings):
        state = body.results.statevars.copy()
        solution = solve(x, end)
        if solution is not None:
            body.results.statevars = body.results._statevars
            return solution
        if halvings == 0:
            raise SystemExit("no convergence")
        body.results.statevars = state
        middle = 0.5 * (begin + end)
        x, _ = go(x, begin, middle, halvings - 1)
        return go(x, middle, end, halvings - 1)

    x = np.concatenate([f.values.ravel() for f in field.fields])
    forces, last = [], 0.0
    for q in task["displacement"]:
        if q == last:
            forces.append(forces[-1] if forces else 0.0)
            continue
        x, force = go(x, last, q, HALVINGS)
        last = q
        forces.append(force)
    print(json.dumps(forces))


if __name__ == "__main__":
    main()
