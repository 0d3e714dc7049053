"""Dynamic stiffness of the problem about a radial preload in NGSolve: one complex factorisation for each frequency.

    python ngsolve_dynamic.py radial RADIALxAXIALxAROUND PRELOAD FREQUENCIES

The march, the meshes and the matrices K_eq, K_N and M are NGSolve's; K_eq + s K_N - omega^2 M is factorised at each of
as many frequencies from 1 to 500 Hz. Prints one line of JSON: K' and K'' at the driving point, N/mm, and seconds.
"""

import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))
import ngsolve as ngs
import numpy as np
from ngsolve_bushing import INVERSE, TOLERANCE, model, solve
from problem import C10, arguments

BRANCHES = ((0.15, 0.05), (0.25, 0.004))
DENSITY = 1.1e-9
WEIGHT = 4.0


def state_at_preload(mesh, V, a, sleeve, preload):
    """Equilibrium at a preload in five steps, and the sleeve's unit motion."""
    state, lift = ngs.GridFunction(V), ngs.GridFunction(V)
    lift.components[0].Set(ngs.CoefficientFunction((1, 0, 0)), definedon=mesh.Boundaries(sleeve))
    residual, free = state.vec.CreateVector(), V.FreeDofs(True)
    fixed = np.array([not f for f in V.FreeDofs()])
    for _ in range(5):
        state.vec.data += preload / 5.0 * lift.vec
        for _ in range(25):
            a.Apply(state.vec, residual)
            r = residual.FV().NumPy()
            if np.linalg.norm(r[~fixed]) <= TOLERANCE * np.linalg.norm(r[fixed]):
                break
            a.AssembleLinearization(state.vec)
            solve(a, state, residual, free)
    return state, lift


def space(mesh):
    """Complex unknowns in the order of the real ones."""
    bonds = "back|front"
    fixed = {"dirichletx": bonds, "dirichlety": f"{bonds}|left|right", "dirichletz": f"{bonds}|bottom"}
    return ngs.VectorH1(mesh, order=2, complex=True, **fixed) * ngs.H1(mesh, order=1, complex=True)


def matrices(V, a, state):
    """Values of tangent, mu K_N and mass, which have one pattern."""
    (u, _), (v, _) = V.TnT()
    back = ngs.Inv(ngs.Id(3) + ngs.Grad(state.components[0]))

    def deviator(w):
        strain = ngs.Sym(ngs.Grad(w) * back)
        return strain - ngs.Trace(strain) / 3.0 * ngs.Id(3)

    viscous, mass = ngs.BilinearForm(V), ngs.BilinearForm(V)
    viscous += WEIGHT * 2.0 * 2.0 * C10 * ngs.InnerProduct(deviator(u), deviator(v)) * ngs.dx
    mass += WEIGHT * DENSITY * u * v * ngs.dx
    viscous.Assemble()
    mass.Assemble()
    tangent = ngs.BilinearForm(V)
    for integrator in a.integrators:
        tangent += integrator
    tangent.AssembleLinearization(state.vec)
    return [form.mat.AsVector().FV().NumPy().copy() for form in (tangent, viscous, mass)]


def main():
    """March, assemble, and factorise for each frequency."""
    preload, count = float(sys.argv[3]), int(sys.argv[4])
    task, elements = arguments()
    mesh, V, a, sleeve, _bend = model(task.mode, elements)
    state, lift = state_at_preload(mesh, V, a, sleeve, preload)
    begin = time.perf_counter()
    parts = matrices(V, a, state)
    unit = lift.vec.FV().NumPy().copy()
    free, stiffness = V.FreeDofs(), []
    frequencies = np.geomspace(1.0, 500.0, count)
    Vc = space(mesh)
    (u, p), (v, q) = Vc.TnT()
    form = ngs.BilinearForm(Vc)
    form += (u * v + p * q) * ngs.dx
    form.Assemble()
    matrix = form.mat
    for frequency in frequencies:
        omega = 2.0 * np.pi * frequency
        s = sum(g * 1j * omega * tau / (1 + 1j * omega * tau) for g, tau in BRANCHES)
        matrix.AsVector().FV().NumPy()[:] = parts[0] + s * parts[1] - omega**2 * parts[2]
        x, r, step = (matrix.CreateColVector() for _ in range(3))
        x.FV().NumPy()[:] = unit
        r.data = matrix * x
        step.data = matrix.Inverse(free, inverse=INVERSE) * r
        x.data -= step
        r.data = matrix * x
        stiffness.append(complex(np.dot(r.FV().NumPy(), unit)))
    end = time.perf_counter()
    result = {"version": ngs.__version__, "unknowns": V.ndof, "seconds": end - begin}
    result |= {
        "frequency": frequencies.tolist(),
        "storage": [k.real for k in stiffness],
        "loss": [k.imag for k in stiffness],
    }
    print(json.dumps(result))


if __name__ == "__main__":
    ngs.SetNumThreads(1)
    main()
