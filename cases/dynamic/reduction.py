"""Reduction of the matrices of small vibrations to a few real vectors, with a bound of its error.

The state is sought as the sum of the responses at rest to the sleeves' motions and of a few free vectors (Galerkin).
The stiffness is then a stationary value: its error is a product of two residuals, r^T K^-1 r. Each further vector is a
residual, solved with K_eq, whose factorisation the march has left: all that it takes are back-substitutions. The
real and imaginary parts of all residuals over the frequencies are compressed to the few directions that matter.

With the norm |r| = sqrt(r^H K_eq^-1 r) the error is at most |r| |r'| / beta, where beta is the least |x^H K x| /
(x^H K_eq x). Branches only add to the real part, so that without inertia beta is at least 1; with inertia it is
estimated from the reduced matrices.

References
----------
Hetmaniuk, Tezaur and Farhat (2012), Review and assessment of interpolatory model order reduction methods for frequency
response structural dynamics and acoustics problems, Int. J. Numer. Methods Eng. 90:1636-1662, doi:10.1002/nme.4271.
Prud'homme et al. (2002), Reliable real-time solution of parametrized partial differential equations, J. Fluids Eng.
124:70-80, doi:10.1115/1.1448332 (the bound; primal and dual residuals).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cases.dynamic.pencil import Actions, Pencil

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Vectors that a round adds for each motion, and rounds. A radial vibration of a solid bushing to 1 kHz takes two or
# three rounds; a resonance takes more.
ADDED, MOST_ROUNDS = 4, 12
# A direction of the residuals this small beside the largest is left for a later round; an eigenvalue of their products
# this small beside the largest, and a residual this small, are rounding.
NEGLIGIBLE, ROUNDING, SMALLEST = 1e-2, 1e-13, 1e-8


@dataclass(frozen=True)
class Sweep:
    """Points at which stiffness is asked.

    Attributes
    ----------
    s : shape (f,)
        Complex modulus of the branches over the law's initial shear modulus.
    squared : shape (f,)
        omega^2, 1/s^2.
    """

    s: Complex
    squared: Array


@dataclass(frozen=True)
class Change:
    """Matrices over the vectors of a `ReducedPencil`, or their derivatives by a parameter; as its attributes."""

    equilibrium: Array
    viscous: Array
    rubber: Array
    metal: Array
    static: Array


@dataclass(frozen=True)
class ReducedPencil:
    """Matrices over the responses to motions of the driven sleeve, rigid motions of the body, and free vectors.

    The work of the momentum on a rigid motion is the difference between the force where the bushing is driven and that
    on all that holds it, be it bonded or in contact. Rigid motions have their mass alone here.

    Attributes
    ----------
    motions, driven : int
        m, the number of both kinds of motions together, and the number of the former.
    equilibrium, viscous, rubber, metal : shape (m + k, m + k)
        As in `cases.dynamic.pencil.Actions`.
    static : shape (m, m)
        As in `Pencil`.
    density : float
        Density of the rubber for which the vectors were chosen, t/mm^3.
    residuals : shape (k + 2 (m + k), same)
        Products in K_eq of the free vectors and of the responses to viscous and inertial forces, of which the residuals
        are sums.
    """

    motions: int
    driven: int
    equilibrium: Array
    viscous: Array
    rubber: Array
    metal: Array
    static: Array
    density: float
    residuals: Array

    def states(self, sweep: Sweep, density: float | None = None) -> Complex:
        """Return the coefficients of the vectors in the state under each motion, shape (f, m + k, m).

        Parameters
        ----------
        sweep : Sweep
            Points, shape (f,).
        density : float or None
            Of the rubber, t/mm^3; None = `density`.
        """
        m, P = self.motions, self._dynamic(sweep, density)
        free = -np.linalg.solve(P[:, m:, m:], P[:, m:, :m])
        unit = np.broadcast_to(np.eye(m), (len(P), m, m))
        return np.concatenate([unit, free], axis=1)

    def stiffness(self, sweep: Sweep, density: float | None = None) -> tuple[Complex, Complex]:
        """Return driving-point and transfer stiffness, shape (f, driven, driven) each.

        Parameters
        ----------
        sweep : Sweep
            Points, shape (f,).
        density : float or None
            Of the rubber, t/mm^3; None = `density`.
        """
        m, P = self.motions, self._dynamic(sweep, density)
        return self._split(P[:, :m, :m] + P[:, :m, m:] @ self.states(sweep, density)[:, m:], self.static)

    def _split(self, forces: Complex, static: Array | float = 0.0) -> tuple[Complex, Complex]:
        """Return driving-point and transfer stiffness from the works of forces on all motions, (f, m, m)."""
        d = self.driven
        driving = np.asarray(static + forces[:, :d, :d])
        return driving, driving - forces[:, d:, :d] if self.motions > d else driving

    def slopes(self, sweep: Sweep, density: float | None = None) -> tuple[Complex, Complex]:
        """Return the derivatives x^T (dK/dp) x of both stiffnesses by s and by the rubber's density.

        Parameters
        ----------
        sweep : Sweep
            Points, shape (f,).
        density : float or None
            Of the rubber, t/mm^3; None = `density`.

        Returns
        -------
        by_s, by_density : shape (2, f, driven, driven)
            Driving-point stiffness first.
        """
        x = self.states(sweep, density)
        transposed = x.transpose(0, 2, 1)
        by_density = -sweep.squared[:, None, None] * (transposed @ self.rubber @ x)
        return np.array(self._split(transposed @ self.viscous @ x)), np.array(self._split(by_density))

    def along(self, change: Change, sweep: Sweep, density: float | None = None) -> Complex:
        """Return the derivatives x^T (dK/dp) x of both stiffnesses by a parameter, (2, f, driven, driven).

        Parameters
        ----------
        change : Change
            Derivatives of the matrices by the parameter.
        sweep : Sweep
            Points, shape (f,).
        density : float or None
            Of the rubber, t/mm^3; None = `density`.
        """
        x = self.states(sweep, density)
        mass = (self.density if density is None else density) * change.rubber + change.metal
        s, squared = sweep.s[:, None, None], sweep.squared[:, None, None]
        matrix = change.equilibrium + s * change.viscous - squared * mass
        return np.array(self._split(x.transpose(0, 2, 1) @ matrix @ x, change.static))

    def errors(self, sweep: Sweep, density: float | None = None) -> Array:
        """Return the bound of the error of each stiffness over its own size, shape (f,); the worst of its motions.

        Driving-point and transfer stiffness of every motion are looked at.

        Parameters
        ----------
        sweep : Sweep
            Points, shape (f,).
        density : float or None
            Of the rubber, t/mm^3; None = `density`.
        """
        return self.errors_and_weights(sweep, density)[0]

    def _dynamic(self, sweep: Sweep, density: float | None) -> Complex:
        mass = (self.density if density is None else density) * self.rubber + self.metal
        s, squared = sweep.s[:, None, None], sweep.squared[:, None, None]
        return np.asarray(self.equilibrium + s * self.viscous - squared * mass)

    def left_over(self, sweep: Sweep, density: float | None = None) -> Complex:
        """Return the residuals solved with K_eq, as coefficients of the vectors of `residuals`, (f, m, vectors).

        Parameters
        ----------
        sweep : Sweep
            Points, shape (f,).
        density : float or None
            Of the rubber, t/mm^3; None = `density`.
        """
        m = self.motions
        x = self.states(sweep, density).transpose(0, 2, 1)
        share = 1.0 if density is None else density / self.density
        s, inertia = sweep.s[:, None, None], -share * sweep.squared[:, None, None]
        return np.concatenate([x[:, :, m:], s * x, inertia * x], axis=2)

    def errors_and_weights(self, sweep: Sweep, density: float | None = None) -> tuple[Array, Array]:
        """Return `errors`, (f,), and the weight of each residual in the choice of further vectors, (f, m).

        Parameters
        ----------
        sweep : Sweep
            Points, shape (f,).
        density : float or None
            Of the rubber, t/mm^3; None = `density`. Residuals of elastic sleeves then count in proportion.
        """
        m, d = self.motions, self.driven
        residuals = self.left_over(sweep, density)
        squares = np.einsum("fma,ab,fmb->fm", residuals.conj(), self.residuals, residuals, optimize=True).real
        norms, beta = np.sqrt(np.maximum(squares, 0.0)), np.ones((len(residuals), 1))
        if len(self.equilibrium) > m:
            root = np.linalg.inv(np.linalg.cholesky(self.equilibrium[m:, m:]))
            within = root @ self._dynamic(sweep, density)[:, m:, m:] @ root.T
            beta = np.minimum(np.linalg.svd(within, compute_uv=False)[:, -1:], 1.0)
        driving, transfer = (
            np.abs(np.diagonal(stiffness, axis1=1, axis2=2)) for stiffness in self.stiffness(sweep, density)
        )
        driven, rigid = norms[:, :d], norms[:, d:] if m > d else 0.0
        errors = np.maximum(driven**2 / driving, (driven**2 + driven * rigid) / transfer) / beta
        sizes = np.tile(np.minimum(driving, transfer), (1, m // d))
        return np.asarray(errors.max(axis=1)), np.asarray(1.0 / np.sqrt(sizes * beta))


def basis_for(pencil: Pencil, sweep: Sweep, density: float, tolerance: float) -> VectorBasis:
    """Choose vectors until the bound of the error is below a tolerance at every point, or no vector makes it smaller.

    Parameters
    ----------
    pencil : Pencil
    sweep : Sweep
        Points for which the vectors are chosen.
    density : float
        Of the rubber, t/mm^3.
    tolerance : float
        Relative error of driving-point and transfer stiffness, a ratio.
    """
    basis = VectorBasis(pencil, density)
    basis.add(pencil.followed_motions())
    basis.add_rigid()
    for _ in range(MOST_ROUNDS):
        reduced = basis.reduced_pencil()
        errors, weights = reduced.errors_and_weights(sweep)
        if float(errors.max()) <= tolerance:
            break
        vectors = basis.residuals(reduced, sweep, weights)
        if not len(vectors):
            break
        basis.add(vectors)
    return basis


class VectorBasis:
    """The vectors, what the matrices make of them, and the responses to these forces.

    Attributes
    ----------
    vectors : shape (m + k, n)
        Motions of the sleeve, rigid motions, and free vectors.
    """

    def __init__(self, pencil: Pencil, density: float) -> None:
        self.pencil, self._density = pencil, density
        none: Array = np.zeros((0, pencil.motions.shape[1]))
        self.vectors, self._viscous, self._inertial = none, none, none
        self._forces = pencil.act(none)

    @property
    def _motions(self) -> int:
        return len(self.pencil.motions) + len(self.pencil.rigid)

    @property
    def _mass(self) -> Array:
        return self._density * self._forces.rubber + self._forces.metal

    def add_rigid(self) -> None:
        """Add the rigid motions, with their mass alone: what is fixed to the ground would move with the body."""
        actions = self.pencil.act(self.pencil.rigid)
        none = np.zeros_like(self.pencil.rigid)
        self._add(self.pencil.rigid, replace(actions, equilibrium=none, viscous=none))

    def add(self, vectors: Array) -> None:
        """Add vectors, shape (k, n)."""
        self._add(vectors, self.pencil.act(vectors))

    def _add(self, vectors: Array, forces: Actions) -> None:
        count = len(self.vectors)
        self.vectors = np.vstack([self.vectors, vectors])
        self._forces = self._forces.with_(forces)
        right = np.vstack([self._forces.viscous[count:], self._mass[count:]])
        viscous, inertial = np.split(self.pencil.solve(right), 2)
        self._viscous = np.vstack([self._viscous, viscous])
        self._inertial = np.vstack([self._inertial, inertial])

    def forces_of(self, x: Complex, frequency: float, density: float) -> Array:
        """Return the forces of a state without branches, real and imaginary part, this rank's contributions (2, n).

        Parameters
        ----------
        x : Complex
            Coefficients of the vectors, shape (m + k,).
        frequency : float
            Hz.
        density : float
            Of the rubber, t/mm^3.
        """
        mass = density * self._forces.rubber + self._forces.metal
        forces = self._forces.equilibrium - (2.0 * np.pi * frequency) ** 2 * mass
        return np.array([x.real @ forces, x.imag @ forces])

    @property
    def _parts(self) -> Array:
        m = self._motions
        return np.vstack([self.vectors[m:], self._viscous, self._inertial])

    def reduced_pencil(self) -> ReducedPencil:
        """Return the matrices over the present vectors."""
        pencil, m = self.pencil, self._motions
        matrices = self._matrices(pencil, self.vectors, self._forces)
        forces = np.vstack([self._forces.equilibrium[m:], self._forces.viscous, self._mass])
        inner = _symmetric_part(pencil.products(self._parts, forces))
        return ReducedPencil(m, len(pencil.motions), **vars(matrices), density=self._density, residuals=inner)

    def at(self, pencil: Pencil) -> Change:
        """Return the matrices of a pencil near by (`Pencil.at`) over the same vectors, moved with the sleeve."""
        driven, m = len(pencil.motions), self._motions
        vectors = self.vectors.copy()
        vectors[:driven] += pencil.motions - self.pencil.motions
        vectors[driven:m] = pencil.rigid
        forces = pencil.act(vectors)
        for free_of_ground in (forces.equilibrium, forces.viscous):
            free_of_ground[driven:m] = 0.0
        return self._matrices(pencil, vectors, forces)

    def _matrices(self, pencil: Pencil, vectors: Array, forces: Actions) -> Change:
        rigid = slice(len(pencil.motions), self._motions)

        def matrix(part: Array) -> Array:
            products = pencil.products(vectors, part)
            # Of rigid motions the forces alone are without those of the ground.
            products[rigid] = products[:, rigid].T
            return _symmetric_part(products)

        return Change(**{name: matrix(part) for name, part in vars(forces).items()}, static=pencil.static)

    def residuals(self, reduced: ReducedPencil, sweep: Sweep, weights: Array) -> Array:
        """Return the directions in which most of the residuals lie, of unit length in K_eq, shape (k, n).

        Parameters
        ----------
        reduced : ReducedPencil
            Of the present vectors.
        sweep : Sweep
            Points, shape (f,).
        weights : Array
            Of the residuals, shape (f, m), a ratio.
        """
        residuals = reduced.left_over(sweep) * weights[:, :, None]
        complex_columns = residuals.reshape(-1, residuals.shape[2]).T
        columns: Array = np.hstack([complex_columns.real, complex_columns.imag])
        size = np.sqrt(np.maximum(np.diag(reduced.residuals), 0.0))
        # Weighted, a residual's square is a relative error: parts of this size are rounding.
        significant = size * np.abs(columns).max(axis=1) > SMALLEST
        size, columns = size[significant], columns[significant]
        values, axes = np.linalg.eigh(
            reduced.residuals[np.ix_(significant, significant)] / np.outer(size, size)
        )
        real = values > ROUNDING * values.max(initial=0.0)
        root, axes = np.sqrt(values[real]), axes[:, real]
        scaled = root[:, None] * (axes.T @ (size[:, None] * columns))
        directions, sizes, _ = np.linalg.svd(scaled, full_matrices=False)
        large = int(np.count_nonzero(sizes > NEGLIGIBLE * sizes.max(initial=0.0)))
        number = min(ADDED * reduced.motions, large)
        coefficients = (axes / size[:, None]) @ (directions[:, :number] / root[:, None])
        return np.asarray(coefficients.T @ self._parts[significant])


def _symmetric_part(matrix: Array) -> Array:
    """Remove the rounding by which a symmetric matrix is not symmetric."""
    return 0.5 * (matrix + matrix.T)
