"""A STEP file in NGSolve: a quarter of the kidney bushing, marched radially in the same steps as bushcli.

    python ngsolve_step.py FILE.step REACH STEPS SIZE

Netgen's second-order tetrahedra of at most SIZE mm, mixed u-p with static condensation, a parabola through the last
three states as predictor, full Newton. Prints one line of JSON with the force of the whole bushing at every step.
"""

import json
import math
import resource
import sys
import time

begin = time.perf_counter()
import ngsolve as ngs  # noqa: E402
import numpy as np  # noqa: E402
from netgen import occ  # noqa: E402

C10, C20, C30, KAPPA = 0.5, -0.05, 0.01, 2000.0
INVERSE, TOLERANCE = "sparsecholesky", 1e-7


def quarter(path):
    """Return the part with positive y and z, its faces named by their position."""
    solid, far = occ.OCCGeometry(path).shape, 1000.0
    for axis, (low, way) in {"y": ((-far, 0, -far), occ.Y), "z": ((-far, -far, 0), occ.Z)}.items():
        half = occ.Box(occ.Pnt(*low), occ.Pnt(far, far, far))
        half.faces.name = "cut"
        half.faces.Min(way).name = f"mirror_{axis}"
        solid = solid * half
    radii = {}
    for number, face in enumerate(solid.faces):
        if (face.name or "").startswith("mirror"):
            continue
        corners = [math.hypot(v.p[0], v.p[1]) for v in face.vertices]
        heights = [v.p[2] for v in face.vertices]
        if max(corners) - min(corners) < 1e-6 and max(heights) - min(heights) > 1.0:
            radii[number] = corners[0]
    least, most = min(radii.values()), max(radii.values())
    for number, face in enumerate(solid.faces):
        if number in radii and abs(radii[number] - least) < 1e-6:
            face.name = "inner"
        elif number in radii and abs(radii[number] - most) < 1e-6:
            face.name = "outer"
        elif not (face.name or "").startswith("mirror"):
            face.name = "free"
    return solid


def main():
    path, reach, steps, size = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
    mesh = ngs.Mesh(occ.OCCGeometry(quarter(path)).GenerateMesh(maxh=size, curvaturesafety=1.0))
    mesh.Curve(2)
    held = "inner|outer"
    displacement = ngs.VectorH1(
        mesh, order=2, dirichletx=held, dirichlety=f"{held}|mirror_y", dirichletz=f"{held}|mirror_z"
    )
    V = displacement * ngs.H1(mesh, order=1)
    u, p = V.TrialFunction()
    F = ngs.Id(3) + ngs.Grad(u)
    J = ngs.Det(F)
    e = J ** (-2 / 3) * ngs.InnerProduct(F, F) - 3
    W = C10 * e + C20 * e**2 + C30 * e**3 + p * (J - 1) - p * p / (2 * KAPPA)
    a = ngs.BilinearForm(V, symmetric=True, condense=True)
    a += ngs.Variation((4.0 * W).Compile() * ngs.dx)
    state, lift = ngs.GridFunction(V), ngs.GridFunction(V)
    lift.components[0].Set(ngs.CoefficientFunction((1, 0, 0)), definedon=mesh.Boundaries("inner"))
    residual, step, free = state.vec.CreateVector(), state.vec.CreateVector(), V.FreeDofs(True)
    direction = lift.vec.FV().NumPy().copy()
    fixed = np.array([not f for f in V.FreeDofs()])
    setup = time.perf_counter()
    known, forces, iterations = [(0.0, state.vec.FV().NumPy().copy())], [], 0
    targets = np.linspace(0.0, reach, steps + 1)[1:]
    for q in targets:
        guess = 0.0
        for i, (n, x) in enumerate(known):
            guess = guess + x * np.prod([(q - m) / (n - m) for j, (m, _) in enumerate(known) if j != i])
        moved = float(np.dot(guess, direction)) / float(np.dot(direction, direction))
        state.vec.FV().NumPy()[:] = guess + (q - moved) * direction
        for _ in range(25):
            a.Apply(state.vec, residual)
            r = residual.FV().NumPy()
            if np.linalg.norm(r[~fixed]) <= TOLERANCE * np.linalg.norm(r[fixed]):
                break
            a.AssembleLinearization(state.vec)
            residual.data += a.harmonic_extension_trans * residual
            step.data = a.mat.Inverse(free, inverse=INVERSE) * residual
            step.data += a.harmonic_extension * step
            step.data += a.inner_solve * residual
            state.vec.data -= step
            iterations += 1
        else:
            raise SystemExit(f"no convergence at {q}")
        forces.append(float(np.dot(residual.FV().NumPy(), direction)))
        known = [*known, (float(q), state.vec.FV().NumPy().copy())][-3:]
    print(
        json.dumps(
            {
                "version": ngs.__version__,
                "unknowns": V.ndof,
                "newton": iterations,
                "setup": setup - begin,
                "solve": time.perf_counter() - setup,
                "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
                "displacement": targets.tolist(),
                "force": forces,
            }
        )
    )


if __name__ == "__main__":
    ngs.SetNumThreads(1)
    main()
