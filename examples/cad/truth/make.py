"""Make ``bushing.step``, ``axial.csv`` and ``radial.csv`` of this example from ``truth.json``.

``setup/enter python -m examples.cad.truth.make`` runs this file with NGSolve and Netgen, which it installs from PyPI in
an environment of their own where they are missing; some minutes. Another code on another mesh: displacements of third
and pressures of second order on Netgen's curved tetrahedra, of the part as it was made, which is not the part as drawn.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
TRUTH = json.loads((HERE / "truth.json").read_text(encoding="utf-8"))
# Of Newton's method: residual of what is free over the reactions of what is held.
TOLERANCE = 1e-7


def say(text):
    """Tell how far it is."""
    sys.stderr.write(text + "\n")


def part(offset, mirrors=""):
    """Rubber with two kidney voids across the load, its bore off centre by so many mm, cut at planes of symmetry."""
    from netgen import occ

    d = TRUTH["drawn"]
    low, length, reach = -0.5 * d["length"], d["length"], 2.0 * d["outer_radius"]

    def cylinder(x, y, radius, name, share=1.0):
        made = occ.Cylinder(occ.Pnt(x, y, share * low), occ.Z, r=radius, h=share * length)
        made.faces.name = name
        return made

    rubber = cylinder(0, 0, d["outer_radius"], "outer")
    rubber.faces.Min(occ.Z).name = rubber.faces.Max(occ.Z).name = "free"
    half = math.radians(0.5 * d["void_angle"])
    inside, outside = d["void_inner_radius"], d["void_outer_radius"]
    for side in (1.0, -1.0):
        # Between two radii and two planes through the axis, with round ends.
        void = cylinder(0, 0, outside, "free", 2.0) - cylinder(0, 0, inside, "free", 2.0)
        far = [(reach * math.sin(a), side * reach * math.cos(a)) for a in (-side * half, side * half)]
        wedge = occ.WorkPlane(occ.Axes(occ.Pnt(0, 0, 2.0 * low), occ.Z, occ.X)).MoveTo(0.0, 0.0)
        sector = wedge.LineTo(*far[1]).LineTo(*far[0]).LineTo(0.0, 0.0).Face().Extrude(2.0 * length * occ.Z)
        void = void * sector
        for angle in (-half, half):
            middle = 0.5 * (inside + outside)
            x, y = middle * math.sin(angle), side * middle * math.cos(angle)
            void = void + cylinder(x, y, 0.5 * (outside - inside), "free", 2.0)
        void.faces.name = "free"
        rubber = rubber - void
    rubber = rubber - cylinder(offset, 0.0, d["inner_radius"], "inner", 2.0)
    for plane in mirrors:
        corner = [0.0 if axis == plane else -reach for axis in "xyz"]
        quarter = occ.Box(occ.Pnt(*corner), occ.Pnt(reach, reach, reach))
        quarter.faces.Min({"x": occ.X, "y": occ.Y, "z": occ.Z}[plane]).name = f"mirror_{plane}"
        rubber = rubber * quarter
    return rubber


def curve(direction, mirrors, targets):
    """Force of the part as made at displacements (mm) of its inner bond, in N."""
    import ngsolve as ngs
    from netgen import occ

    solid = part(TRUTH["effects"]["misalignment"]["offset"], mirrors)
    mesh = ngs.Mesh(occ.OCCGeometry(solid).GenerateMesh(maxh=TRUTH["mesh_size"], curvaturesafety=1.0))
    mesh.Curve(3)
    fixed = {f"dirichlet{a}": "inner|outer" + (f"|mirror_{a}" if a in mirrors else "") for a in "xyz"}
    space = ngs.VectorH1(mesh, order=3, **fixed) * ngs.H1(mesh, order=2)
    u, p = space.TrialFunction()
    F = ngs.Id(3) + ngs.Grad(u)
    J = ngs.Det(F)
    e = J ** (-2 / 3) * ngs.InnerProduct(F, F) - 3
    c, kappa = TRUTH["parameters"], TRUTH["bulk_modulus"]
    W = c["C10"] * e + c["C20"] * e**2 + c["C30"] * e**3 + p * (J - 1) - p * p / (2 * kappa)
    energy = ngs.BilinearForm(space, symmetric=True, condense=True)
    energy += ngs.Variation((2.0 ** len(mirrors) * W).Compile() * ngs.dx)
    state, lift = ngs.GridFunction(space), ngs.GridFunction(space)
    lift.components[0].Set(ngs.CoefficientFunction(direction), definedon=mesh.Boundaries("inner"))
    free = space.FreeDofs(True)
    held = np.array([not f for f in space.FreeDofs()])
    motion = lift.vec.FV().NumPy().copy()
    residual, step = state.vec.CreateVector(), state.vec.CreateVector()
    say(f"{space.ndof} unknowns, {mesh.ne} tetrahedra")
    known, forces = [(0.0, state.vec.FV().NumPy().copy())], []
    for q in targets:
        guess = 0.0
        for i, (n, x) in enumerate(known):
            others = [(q - m) / (n - m) for j, (m, _) in enumerate(known) if j != i]
            guess = guess + x * np.prod(others)
        moved = float(guess @ motion) / float(motion @ motion)
        state.vec.FV().NumPy()[:] = guess + (q - moved) * motion
        for _ in range(30):
            energy.Apply(state.vec, residual)
            r = residual.FV().NumPy()
            if np.linalg.norm(r[~held]) <= TOLERANCE * np.linalg.norm(r[held]):
                break
            energy.AssembleLinearization(state.vec)
            residual.data += energy.harmonic_extension_trans * residual
            step.data = energy.mat.Inverse(free, inverse="sparsecholesky") * residual
            step.data += energy.harmonic_extension * step
            step.data += energy.inner_solve * residual
            state.vec.data -= step
        else:
            raise SystemExit(f"no convergence at {q:g} mm")
        forces.append(float(residual.FV().NumPy() @ motion))
        known = [*known, (float(q), state.vec.FV().NumPy().copy())][-3:]
        say(f"{q:.3g} mm: {forces[-1]:.6g} N")
    return np.array(forces)


def recorded(mode, direction, mirrors, rng):
    """Time, displacement and force at the samples: to one side, to the other and back, twice; with noise."""
    from numpy.polynomial import Polynomial

    program = TRUTH["program"][mode]
    reach = program["amplitude"]
    ends = np.linspace(0.0, reach, 9)[1:]
    q = np.concatenate([-ends[::-1], [0.0], ends])
    f = np.concatenate([curve(direction, mirrors, -ends)[::-1], [0.0], curve(direction, mirrors, ends)])
    # What a polynomial of ninth degree leaves at the 17 points is told: some 1e-6 %.
    smooth = Polynomial.fit(q, f, 9)
    say(f"{mode}: the polynomial leaves {100 * float(np.abs(smooth(q) - f).max() / np.ptp(f)):.2g} %")
    corners = np.array([0.0, 1.0, -1.0, 1.0, -1.0, 0.0]) * reach
    lengths = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners)))])
    time = np.linspace(0.0, lengths[-1] / program["rate"], TRUTH["samples"])
    path = np.interp(time * program["rate"], lengths, corners)
    force = smooth(path) - smooth(0.0)
    noise = TRUTH["noise_percent"] / 100 * float(np.ptp(force))
    force = force + noise * rng.standard_normal(len(force))
    return time, path + TRUTH["displacement_noise"] * rng.standard_normal(len(path)), force


def main():
    """Draw, simulate, add noise, write with the digits of a rig."""
    drawn = part(0.0)
    drawn.name = "rubber"
    drawn.WriteStep(str(HERE.parent / "bushing.step"))
    rng = np.random.default_rng(TRUTH["seed"])
    for mode, direction, mirrors in (("axial", (0, 0, 1), "y"), ("radial", (1, 0, 0), "yz")):
        columns = recorded(mode, direction, mirrors, rng)
        rows = [f"{t:.3f},{q:.4f},{f:.2f}" for t, q, f in zip(*columns, strict=True)]
        text = "\n".join(["time_s,displacement_mm,force_N", *rows, ""])
        (HERE.parent / f"{mode}.csv").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    try:
        import ngsolve  # noqa: F401
    except ImportError:
        from benchmarks.install import interpreter

        raise SystemExit(subprocess.call([str(interpreter("ngsolve")), __file__])) from None
    main()
