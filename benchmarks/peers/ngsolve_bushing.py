"""The problem in NGSolve: second-order mixed u-p, static condensation, parabolic predictor, full Newton.

    python ngsolve_bushing.py axial|radial RADIALxAXIALxAROUND [THREADS]

Elements: across the rubber; along its length (half of it for radial load); around half the circumference. Prints one
line of JSON.
"""

import json
import sys
import time
from pathlib import Path

begin = time.perf_counter()
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import ngsolve as ngs  # noqa: E402
import numpy as np  # noqa: E402
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh  # noqa: E402
from problem import C10, C20, C30, KAPPA, arguments, heights, radii  # noqa: E402

# The fastest of the wheel's factorisations for indefinite systems.
INVERSE = "sparsecholesky"
TOLERANCE = 1e-7


def at(vertices, index):
    return float(np.interp(index, np.linspace(0, 1, len(vertices)), vertices))


def model(mode, elements):
    """Mesh, space, form of the stored energy, name of the inner bond, and objects that must outlive them."""
    across, along, *around = elements
    R, Z = radii(across), heights(along, mode)
    if mode == "axial":
        mesh = MakeStructured2DMesh(True, across, along, mapping=lambda s, t: (at(R, s), at(Z, t)))
        inner, bend = "left", None
        displacement = ngs.VectorH1(mesh, order=2, dirichletx="left|right", dirichlety="left|right")
    else:
        # A box of radius, angle and height, curved by a displacement of third order.
        box = lambda s, a, t: (at(R, s), np.pi * a, at(Z, t))  # noqa: E731
        mesh = MakeStructured3DMesh(True, across, around[0], along, mapping=box)
        bend = ngs.GridFunction(ngs.VectorH1(mesh, order=3))
        bend.Set(ngs.CoefficientFunction((ngs.x * ngs.cos(ngs.y) - ngs.x, ngs.x * ngs.sin(ngs.y) - ngs.y, 0)))
        # NGSolve names the faces of the unit cube back and front (x), left and right (y), bottom and top (z).
        inner, bonds = "back", "back|front"
        displacement = ngs.VectorH1(
            mesh, order=2, dirichletx=bonds, dirichlety=f"{bonds}|left|right", dirichletz=f"{bonds}|bottom"
        )
        mesh.SetDeformation(bend)
    V = displacement * ngs.H1(mesh, order=1)
    u, p = V.TrialFunction()
    if mode == "axial":
        g = ngs.Grad(u)
        F2 = ngs.Id(2) + g
        hoop = 1 + u[0] / ngs.x
        J = ngs.Det(F2) * hoop
        I1 = ngs.InnerProduct(F2, F2) + hoop * hoop
        weight = 2 * np.pi * ngs.x
    else:
        F = ngs.Id(3) + ngs.Grad(u)
        J, I1 = ngs.Det(F), ngs.InnerProduct(F, F)
        weight = 4.0
    e = J ** (-2 / 3) * I1 - 3
    W = C10 * e + C20 * e**2 + C30 * e**3 + p * (J - 1) - p * p / (2 * KAPPA)
    a = ngs.BilinearForm(V, symmetric=True, condense=True)
    a += ngs.Variation((weight * W).Compile() * ngs.dx)
    return mesh, V, a, inner, bend


def main():
    task, elements = arguments()
    mesh, V, a, sleeve, _bend = model(task.mode, elements)
    state, lift = ngs.GridFunction(V), ngs.GridFunction(V)
    residual = state.vec.CreateVector()
    lift.components[0].Set(
        ngs.CoefficientFunction((0, 1) if task.mode == "axial" else (1, 0, 0)),
        definedon=mesh.Boundaries(sleeve),
    )
    inner, free = lift.vec.CreateVector(), V.FreeDofs(True)
    inner.data = lift.vec
    direction = inner.FV().NumPy().copy()
    fixed = np.array([not f for f in V.FreeDofs()])
    setup = time.perf_counter()
    known, forces, iterations = [(0.0, state.vec.FV().NumPy().copy())], [], 0
    for q in task.displacement:
        guess = 0.0
        for i, (n, x) in enumerate(known):
            guess = guess + x * np.prod([(q - m) / (n - m) for j, (m, _) in enumerate(known) if j != i])
        state.vec.FV().NumPy()[:] = guess
        # The predictor has also extrapolated the inner bond: set it to the prescribed displacement.
        moved = np.dot(state.vec.FV().NumPy(), direction) / np.dot(direction, direction)
        state.vec.data += float(q - moved) * inner
        for _ in range(25):
            a.Apply(state.vec, residual)
            r = residual.FV().NumPy()
            if np.linalg.norm(r[~fixed]) <= TOLERANCE * np.linalg.norm(r[fixed]):
                break
            a.AssembleLinearization(state.vec)
            solve(a, state, residual, free)
            iterations += 1
        else:
            raise SystemExit(f"no convergence at {q}")
        forces.append(float(np.dot(residual.FV().NumPy(), inner.FV().NumPy())))
        known = [*known, (float(q), state.vec.FV().NumPy().copy())][-3:]
    end = time.perf_counter()
    print(
        json.dumps(
            {
                "version": ngs.__version__,
                "unknowns": V.ndof,
                "newton": iterations,
                "setup": setup - begin,
                "solve": end - setup,
                "displacement": task.displacement.tolist(),
                "force": forces,
            }
        )
    )


def solve(a, state, residual, free):
    """One Newton step with the interior unknowns of elements condensed."""
    step = state.vec.CreateVector()
    residual.data += a.harmonic_extension_trans * residual
    step.data = a.mat.Inverse(free, inverse=INVERSE) * residual
    step.data += a.harmonic_extension * step
    step.data += a.inner_solve * residual
    state.vec.data -= step


if __name__ == "__main__":
    threads = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    ngs.SetNumThreads(threads)
    if threads > 1:
        with ngs.TaskManager():
            main()
    else:
        main()
