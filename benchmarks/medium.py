"""Rubber and a third medium in plane strain: energies, equilibrium and march, for `third_medium.py`.

A third medium is a soft solid that fills the void and shares its nodes with the rubber. Where the void closes, the
medium's volume ratio J tends to zero, and its pressure, which contains ln J / J, to infinity. Terms in the second
derivatives of the displacement keep its elements in shape. The rubber has second-order displacements and first-order
pressures (P2-P1) with the project's own energies. Pressures of nodes without rubber are constrained to zero, so that
the pressure exists in the rubber alone, and nothing is added in the medium.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import basix.ufl
import dolfinx
import numpy as np
import ufl
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc

from benchmarks.contact import YEOH
from forms.kinematics import strain_of
from forms.setting import SETTINGS
from forms.volumetric import mixed_energy

RUBBER, MEDIUM = 1, 2
SHEAR = YEOH.law.shear_modulus(**YEOH.parameters)
# Bulk modulus of a medium with gamma = 1: a Poisson's ratio of 0.4. With the rubber's own ratio of moduli, 2000, the
# medium would be incompressible, and resist long before surfaces meet.
BULK = 14 / 3 * SHEAR
WIDTH = 4.0  # of the void, mm: the length that makes second derivatives comparable with strains
SMALLEST = 1 / 64  # of a step; a march that needs less has failed


@dataclass(frozen=True)
class Medium:
    """A third medium.

    Attributes
    ----------
    gamma : float
        Its stiffness over the rubber's initial shear modulus; zero: no medium.
    curvature : float
        k_r over gamma K L^2, where K is `BULK` and L is `WIDTH`.
    variant : str
        What its second derivatives cost, a key of `CURVATURES`.
    """

    gamma: float = 1e-5
    curvature: float = 1.0
    variant: str = "hessian"


def hessian(F: Any) -> Any:
    """Return H:H, H being the second derivatives of the displacement (Bluhm et al., without their exponential)."""
    H = ufl.grad(F)
    return ufl.inner(H, H)


def damped(F: Any) -> Any:
    """Return exp(-5 |F|) H:H, where |F| is read as det F: at rest exp(-5) of the above, all of it where J is zero."""
    return ufl.exp(-5 * ufl.det(F)) * hessian(F)


def distortion(F: Any) -> Any:
    """Return H:H - L.L/2, L being the Laplacian: some quadratic displacements are free (Frederiksen et al.)."""
    L = ufl.div(F)
    return hessian(F) - ufl.inner(L, L) / 2


def rotation(F: Any) -> Any:
    """Return the squared gradients of the angle of rotation and of J (Wriggers et al.)."""
    turned = ufl.grad(ufl.atan2(F[1, 0] - F[0, 1], F[0, 0] + F[1, 1]))
    swollen = ufl.grad(ufl.det(F))
    return ufl.inner(turned, turned) + ufl.inner(swollen, swollen)


CURVATURES = {curvature.__name__: curvature for curvature in (hessian, damped, distortion, rotation)}


def medium_energy(u: Any, gamma: Any, stiffness: Any, variant: str) -> Any:
    """Return the medium's energy per reference area and mm of thickness, MPa.

    gamma (K/2 (ln J)^2 + mu/2 (J^(-2/3) I1 - 3)) + k_r/2 times the variant's measure of second derivatives.

    Parameters
    ----------
    u : UFL vector, shape (2,)
        Displacement, mm.
    gamma, stiffness : UFL scalar
        The medium's gamma, and k_r in N.
    variant : str
        A key of `CURVATURES`.

    The papers were not at hand: the variants follow descriptions of them and codes of others.

    References
    ----------
    Bluhm, Sigmund and Poulios (2021), Internal contact modeling for finite strain topology optimization, Comput. Mech.
    67:1099-1114, doi:10.1007/s00466-021-01974-x. Frederiksen, Dalklint, Sigmund and Poulios (2025), Improved third
    medium formulation for 3D topology optimization with contact, Comput. Methods Appl. Mech. Eng. 436:117595,
    doi:10.1016/j.cma.2024.117595. Wriggers, Korelc and Junker (2025), A third medium approach for contact using first
    and second order finite elements, Comput. Methods Appl. Mech. Eng. 436:117740, doi:10.1016/j.cma.2025.117740.
    """
    F = ufl.Identity(2) + ufl.grad(u)
    J = ufl.det(F)
    stretched = J ** (-2 / 3) * (ufl.inner(F, F) + 1) - 3
    return gamma * (BULK / 2 * ufl.ln(J) ** 2 + SHEAR / 2 * stretched) + stiffness / 2 * CURVATURES[variant](
        F
    )


def rubber_energy(u: Any, p: Any) -> Any:
    """Return the rubber's energy per reference area and mm of thickness, MPa.

    Parameters
    ----------
    u : UFL vector, shape (2,)
        Displacement, mm.
    p : UFL scalar
        Pressure-like multiplier, MPa.
    """
    G = ufl.grad(u)
    setting = SETTINGS["cartesian"]
    F = setting.deformation((G[0, 0], G[0, 1], 0, G[1, 0], G[1, 1], 0, 0, 0, 0))
    strain = strain_of([ufl.variable(ufl.as_ufl(component)) for component in setting.strain(F)])
    return YEOH.law.energy(strain, **YEOH.parameters) + mixed_energy(strain.J, p, 1 / YEOH.bulk_modulus)


class Problem:
    """Equilibrium of rubber and medium on a mesh.

    Parameters
    ----------
    mesh, cells
        Mesh and tags of its cells.
    medium : Medium
        The third medium; without stiffness, its nodes are constrained.
    held : sequence of (test of places, component, rate)
        Where displacements are prescribed: component of the displacement, and its value over the load q.
    """

    def __init__(self, mesh: Any, cells: Any, medium: Medium, held: Sequence[tuple[Any, int, float]]) -> None:
        cell = mesh.basix_cell()
        element = basix.ufl.mixed_element(
            [basix.ufl.element("P", cell, 2, shape=(2,)), basix.ufl.element("P", cell, 1)]
        )
        self.space = dolfinx.fem.functionspace(mesh, element)
        self.state = dolfinx.fem.Function(self.space)
        u, p = ufl.split(self.state)
        gamma, stiffness = (dolfinx.fem.Constant(mesh, 0.0) for _ in range(2))
        gamma.value = medium.gamma
        stiffness.value = medium.curvature * medium.gamma * BULK * WIDTH**2
        dx = ufl.Measure("dx", mesh, subdomain_data=cells, metadata={"quadrature_degree": 4})
        energy = rubber_energy(u, p) * dx(RUBBER)
        if medium.gamma:
            energy += medium_energy(u, gamma, stiffness, medium.variant) * dx(MEDIUM)
        residual = ufl.derivative(energy, self.state, ufl.TestFunction(self.space))
        self.energy = dolfinx.fem.form(energy)
        self.residual = dolfinx.fem.form(residual)
        self.tangent = dolfinx.fem.form(ufl.derivative(residual, self.state, ufl.TrialFunction(self.space)))
        self.loads: list[tuple[Any, Any, float]] = []
        self.bcs = [self._constraint(place, component, rate) for place, component, rate in held]
        self.bcs.append(self._without_rubber(cells))
        fixed = np.unique(np.concatenate([bc.dof_indices()[0] for bc in self.bcs]))
        self.unknowns = self.space.dofmap.index_map.size_global - len(fixed)
        self.matrix = fem_petsc.create_matrix(self.tangent)
        # One process: no ghosts. `create_vector` has other arguments since DOLFINx 0.10.
        self.vector = self.matrix.createVecLeft()
        self.solver = PETSc.KSP().create(mesh.comm)
        self.solver.setType("preonly")
        self.solver.getPC().setType("cholesky")
        self.solver.getPC().setFactorSolverType("mumps")
        self.solver.setOperators(self.matrix)
        self.iterations = 0

    def _constraint(self, place: Any, component: int, rate: float) -> Any:
        mesh, part = self.space.mesh, self.space.sub(0).sub(component)
        facets = dolfinx.mesh.locate_entities_boundary(mesh, 1, place)
        dofs = dolfinx.fem.locate_dofs_topological(part, 1, facets)
        value = dolfinx.fem.Constant(mesh, 0.0)
        self.loads.append((value, dofs, rate))
        return dolfinx.fem.dirichletbc(value, dofs, part)

    def _without_rubber(self, cells: Any) -> Any:
        """Constrain the pressures of nodes without rubber to zero."""
        self.space.mesh.topology.create_connectivity(2, 2)
        pressure = self.space.sub(1)
        rubber, medium = (
            dolfinx.fem.locate_dofs_topological(pressure, 2, cells.find(tag)) for tag in (RUBBER, MEDIUM)
        )
        return dolfinx.fem.dirichletbc(
            dolfinx.fem.Function(self.space), np.setdiff1d(medium, rubber).astype(np.int32)
        )

    def load(self, q: float) -> None:
        """Prescribe the displacements of a load q, mm."""
        for value, _, rate in self.loads:
            value.value = rate * q

    def reaction(self) -> float:
        """Force at the displacements that follow the load, N/mm; of the half that is meshed."""
        vector = self.unconstrained_residual()
        return sum(rate * float(vector[dofs].sum()) for _, dofs, rate in self.loads if rate)

    def unconstrained_residual(self) -> Any:
        """Residual without constraints, which is not finite where a volume ratio is not positive."""
        return dolfinx.fem.assemble_vector(self.residual).array

    def misfit(self) -> float:
        """Norm of the residual of unconstrained displacements and pressures."""
        vector = self.unconstrained_residual()
        for bc in self.bcs:
            vector[bc.dof_indices()[0]] = 0.0
        return float(np.linalg.norm(vector))

    def newton(self, tolerance: float = 1e-8, most: int = 25) -> bool:
        """Find the equilibrium from the present state by Newton's method; return whether it was found.

        A correction is halved while a volume ratio is not positive, or while the residual is ten times as large as
        before. A residual that has to decrease stalled where the medium was thin, and ended marches much earlier. The
        load is applied by the first correction, and if that is halved by those that follow.

        Parameters
        ----------
        tolerance : float
            Norm of the residual, N/mm.
        most : int
            Iterations after which it fails.
        """
        array, correction = self.state.x.array, self.vector.duplicate()
        allowed, loaded = np.inf, False
        for _ in range(most):
            self.iterations += 1
            self._correction(correction)
            begin = array.copy()
            for share in 0.5 ** np.arange(9):
                array[:] = begin - share * correction.array
                misfit = self.misfit()
                if np.isfinite(misfit) and misfit <= allowed:
                    break
            else:
                return False
            allowed, loaded = 10 * misfit, loaded or share == 1
            if loaded and misfit < tolerance:
                return True
        return False

    def _correction(self, correction: Any) -> None:
        self.matrix.zeroEntries()
        fem_petsc.assemble_matrix(self.matrix, self.tangent, bcs=self.bcs)
        self.matrix.assemble()
        with self.vector.localForm() as local:
            local.set(0.0)
        state = self.state.x.petsc_vec
        fem_petsc.assemble_vector(self.vector, self.residual)
        fem_petsc.apply_lifting(self.vector, [self.tangent], [self.bcs], x0=[state], alpha=-1.0)
        fem_petsc.set_bc(self.vector, self.bcs, state, -1.0)
        self.solver.solve(self.vector, correction)


def march_path(problem: Problem, path: Sequence[float], tell: Callable[[], None]) -> tuple[int, int]:
    """March along a path, cutting steps back where they fail; return how many steps were tried, and cut back.

    Parameters
    ----------
    problem : Problem
        At rest.
    path : sequence of float
        Loads q, mm.
    tell : callable
        Called when a load of the path has been reached. Those after a step that failed are not reached.
    """
    tried = cut = 0
    q = 0.0
    for target in path:
        whole = step = target - q
        while q < target - 1e-9:
            saved = problem.state.x.array.copy()
            problem.load(min(q + step, target))
            tried += 1
            if problem.newton():
                q = min(q + step, target)
                continue
            problem.state.x.array[:] = saved
            cut += 1
            step /= 2
            if step < SMALLEST * whole:
                return tried, cut
        tell()
    return tried, cut
