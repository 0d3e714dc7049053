"""Vibrations of finite amplitude about an equilibrium: harmonic balance for rubber that softens with amplitude.

A branch whose relaxation the motion itself speeds up (`forms.branches.payne`) answers a sine of local shear amplitude
gamma with a first harmonic s(gamma) that depends on it. The bushing's state and the local moduli are brought into
balance: from the amplitude at each point follows s there, from s everywhere the state, and so on until the stiffness
rests. Everything is done on the vectors to which the body was reduced; those vectors grow by the residuals that uneven
moduli leave, each solved with the factorisation of K_eq that the march has left.

Higher harmonics of the motion are left out: at fixed sleeves they change the first one by their square. The third one
of the force is the work of the third harmonic of the stress on the same state.

References
----------
Krack and Gross (2019), Harmonic Balance for Nonlinear Vibration Problems, doi:10.1007/978-3-030-14023-6.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cases.dynamic.model import Branches, modulus
from cases.dynamic.reduction import Change, ReducedPencil, Sweep, VectorBasis
from cases.ranks import sum_over_ranks
from cases.sine import TabulatedHarmonics, ThinnedSpectrum

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# The stiffness has settled when it moves by less than this share; else `Balance.moved` says by how much it still moves.
# Each turn shrinks the change: from 0.01 to 20 % strain two to four turns were enough (`benchmarks/amplitude.py`).
SETTLED, MOST_TURNS = 1e-4, 60
# Share of the largest eigenvalue of a point's moduli below which a direction is rounding.
FLAT = 1e-9
# A residual this small beside the motion, solved with K_eq, is rounding.
ROUNDED = 1e-8
# Vectors are added while they change the stiffness by more than this share, at most for so many rounds.
ENOUGH, MOST_ROUNDS = 5e-4, 4
# Local amplitudes are tabulated up to this many times the elastic body's largest: strain gathers where rubber thins.
ABOVE = 4.0


@dataclass(frozen=True)
class Balance:
    """A vibration in which moduli and state are in balance.

    Attributes
    ----------
    amplitude, frequency : float
        Of the sleeve, mm or rad; Hz.
    stiffness : complex
        N/mm or N mm/rad.
    third : float
        Third harmonic of the force over the first; nan where it was not asked for.
    state : shape (k,)
        Coefficients of the vectors under a unit motion.
    local : shape (points,)
        Local shear amplitude over the sleeve's.
    moved : float
        Relative change of the stiffness in the last turn, at most `SETTLED` where it settled.
    """

    amplitude: float
    frequency: float
    stiffness: complex
    third: float
    state: Complex
    local: Array
    moved: float


class UnevenModel:
    """The reduced body with moduli that differ from point to point.

    Parameters
    ----------
    basis
        Vectors and matrices; vectors are added to it.
    thinned
        The relaxation that amplitude thins.
    branches
        Maxwell branches beside it.
    motion
        Number of the motion that vibrates.
    transfer
        Whether the force is taken at the held sleeve.
    """

    def __init__(
        self, basis: VectorBasis, thinned: ThinnedSpectrum, branches: Branches, motion: int, transfer: bool
    ) -> None:
        self._basis, self._thinned, self._branches = basis, thinned, branches
        self._motion, self._transfer = motion, transfer
        pencil = basis.pencil
        points = pencil.model.body.rubber.points
        self._root = _roots(pencil.spring, points.rows)
        self._weight = points.weight.reshape(-1)
        self._mu = pencil.model.shear_modulus
        self._strains = np.zeros((0, len(self._weight) * self._root.shape[1]))
        self._take()

    def _take(self) -> None:
        """Compute the strains of the new vectors, and the matrices over all vectors."""
        basis, points = self._basis, self._basis.pencil.model.body.rubber.points
        new_vectors = basis.vectors[len(self._strains) :]
        strains = [
            np.einsum("prk,pk->pr", self._root, points.gradients(vector)).ravel() for vector in new_vectors
        ]
        self._strains = np.vstack([self._strains, *strains])
        self._reduced = basis.reduced_pencil()
        #: Local shear amplitude of the elastic body over the sleeve's, shape (points,).
        self._elastic = self._local(np.eye(len(self._strains))[self._motion].astype(np.complex128))

    @property
    def vectors(self) -> int:
        """Vectors to which the body is reduced."""
        return len(self._strains)

    def stiffness(self, amplitude: Array, frequency: Array) -> tuple[Complex, Array]:
        """Return the stiffness, and the third harmonic of the force over the first one, shape (n,) each.

        Parameters
        ----------
        amplitude : shape (n,)
            Of the sleeve, mm or rad.
        frequency : shape (n,)
            Hz.
        """
        balances = self.balances(amplitude, frequency, third=True)
        return np.array([balance.stiffness for balance in balances]), np.array(
            [balance.third for balance in balances]
        )

    def balances(self, amplitude: Array, frequency: Array, third: bool = False) -> list[Balance]:
        """Return the balance of each pair of amplitude and frequency.

        Parameters
        ----------
        amplitude : shape (n,)
            Of the sleeve, mm or rad.
        frequency : shape (n,)
            Hz.
        third : bool
            Whether the third harmonic of the force is asked for.
        """
        balances: dict[int, Balance] = {}
        for f, response in self._responses(frequency, float(amplitude.max()), third).items():
            indices = np.flatnonzero(frequency == f)
            local = self._elastic
            for i in map(int, indices[np.argsort(amplitude[indices])]):
                balances[i] = self._balance(float(amplitude[i]), f, response, local)
                local = balances[i].local
        return [balances[i] for i in range(len(amplitude))]

    def of(self, thinned: ThinnedSpectrum, branches: Branches, density: float | None = None) -> UnevenModel:
        """Return the model of another relaxation over the same vectors.

        Parameters
        ----------
        thinned, branches
            As for the model.
        density : float or None
            Of the rubber, t/mm^3; None = the present one.
        """
        model = copy(self)
        model._relax(thinned, branches, density)
        return model

    def _relax(self, thinned: ThinnedSpectrum, branches: Branches, density: float | None) -> None:
        self._thinned, self._branches = thinned, branches
        if density is not None:
            self._reduced = replace(self._reduced, density=density)

    def loads(self, balances: Sequence[Balance]) -> list[Complex]:
        """Return the products with which `slope` weighs the tables of other relaxations, (k + 1,) for each balance.

        Parameters
        ----------
        balances : sequence of Balance
        """
        responses = self._responses(*_range(balances))
        return [
            self._over_ranks(
                responses[balance.frequency].loads(
                    balance.amplitude * balance.local, self._weight * self._squares(balance.state)
                )
            )
            for balance in balances
        ]

    def slope(
        self, balances: Sequence[Balance], loads: Sequence[Complex], more: UnevenModel, less: UnevenModel
    ) -> Complex:
        """Return by how much the stiffness of balances (n,) differs between two relaxations near this one.

        To first order, with the local amplitudes held: the stiffness is stationary in the state. What the amplitudes
        change by moving within the body is left out.

        Parameters
        ----------
        balances : sequence of Balance
        loads : sequence of array
            Of `loads`.
        more, less : UnevenModel
            Those of `of`.
        """
        high, low = (model._responses(*_range(balances)) for model in (more, less))
        pairs = [(balance.frequency, load) for balance, load in zip(balances, loads, strict=True)]
        return np.array([high[f].loaded(load) - low[f].loaded(load) for f, load in pairs])

    def along(self, change: Change, balances: Sequence[Balance]) -> Complex:
        """Return the derivative of the stiffness of balances (n,) by a parameter of the model that is no relaxation's.

        The viscous forces change as those of an even modulus that gives the same stiffness.

        Parameters
        ----------
        change : Change
            Derivatives of the matrices over all vectors.
        balances : sequence of Balance
        """
        i, values, reduced = self._motion, [], self._reduced
        mass = reduced.density * reduced.rubber + reduced.metal
        by_mass = reduced.density * change.rubber + change.metal
        for balance in balances:
            x, squared = balance.state, (2.0 * np.pi * balance.frequency) ** 2
            viscous = (
                balance.stiffness - reduced.static[i, i] - x @ (reduced.equilibrium - squared * mass) @ x
            )
            if self._transfer and reduced.motions > reduced.driven:
                viscous -= squared * mass[reduced.driven + i] @ x
            s = viscous / (x @ reduced.viscous @ x)
            matrix = change.equilibrium + s * change.viscous - squared * by_mass
            values.append(change.static[i, i] + x @ matrix @ x)
        return np.array(values)

    def enrich(self, amplitude: float, frequency: float) -> float:
        """Add vectors until they hardly change the stiffness; return by how much the last ones did, a ratio.

        Parameters
        ----------
        amplitude : float
            Of the sleeve, mm or rad.
        frequency : float
            Hz.
        """
        response = self._responses(np.array([frequency]), amplitude)[frequency]
        balance = self._balance(amplitude, frequency, response, self._elastic)
        for _ in range(MOST_ROUNDS):
            previous, local = balance.stiffness, balance.local
            vectors = self._residuals(response.first(amplitude * local), frequency)
            comm = self._basis.pencil.model.comm
            # Real and imaginary part may be parallel: of their span what is larger than rounding errors is added.
            motion = self._basis.vectors[self._motion : self._motion + 1]
            gram = sum_over_ranks(comm, vectors @ vectors.T)
            square = float(sum_over_ranks(comm, motion @ motion.T)[0, 0])
            squares, axes = np.linalg.eigh(gram)
            independent = squares > ROUNDED**2 * square
            if not independent.any():
                # Even moduli, as without any relaxation: the vectors at hand are enough.
                break
            self._basis.add((axes[:, independent] * np.sqrt(square / squares[independent])).T @ vectors)
            self._take()
            balance = self._balance(amplitude, frequency, response, local)
            if abs(balance.stiffness - previous) <= ENOUGH * abs(balance.stiffness):
                break
        return abs(balance.stiffness - previous) / abs(balance.stiffness)

    def _responses(
        self, frequency: Array, amplitude: float, third: bool = False
    ) -> dict[float, TabulatedHarmonics]:
        """Return the local harmonics at each frequency up to what the largest amplitude (mm or rad) may cause."""
        frequency = np.unique(frequency)
        responses = self._thinned.responses(frequency, ABOVE * amplitude * float(self._elastic.max()), third)
        beside = modulus(frequency, self._branches)
        return {
            float(f): replace(harmonics, beside=s)
            for f, harmonics, s in zip(frequency, responses, beside, strict=True)
        }

    def _balance(
        self, amplitude: float, frequency: float, response: TabulatedHarmonics, local: Array
    ) -> Balance:
        """Iterate until the moduli and the local amplitudes agree.

        Parameters
        ----------
        amplitude, frequency
            mm or rad, Hz.
        response
            At this frequency.
        local : shape (points,)
            Local amplitude over the sleeve's from which to begin.
        """
        previous, change = 0j, np.inf
        for _ in range(MOST_TURNS):
            trial = local
            stiffness, x = self._stiffness(response.first(amplitude * trial), frequency)
            local, change, previous = self._local(x), abs(stiffness - previous) / abs(stiffness), stiffness
            if change <= SETTLED:
                break
        third = np.nan
        if len(response.coefficients) > 1:
            third = abs(self._work(x, response.third(amplitude * trial))) / abs(stiffness)
        return Balance(amplitude, frequency, stiffness, float(third), x, local, change)

    def _stiffness(self, s: Complex, frequency: float) -> tuple[complex, Complex]:
        """Return stiffness and coefficients of the state under the motion, at local moduli s."""
        uneven: ReducedPencil = replace(self._reduced, viscous=self._over(s))  # type: ignore[arg-type]
        sweep = Sweep(np.ones(1, dtype=np.complex128), np.array([(2.0 * np.pi * frequency) ** 2]))
        i = self._motion
        stiffness = uneven.stiffness(sweep)[int(self._transfer)]
        return complex(stiffness[0, i, i]), uneven.states(sweep)[0, :, i]

    def _over(self, s: Complex) -> Complex:
        """Integral of a local modulus over the body, between all vectors, shape (k, k)."""
        weights = np.repeat(self._weight * s, self._root.shape[1])
        strains = self._strains
        parts = np.array([(strains * part) @ strains.T for part in (weights.real, weights.imag)])
        integral = self._basis.pencil.model.multiplicity * sum_over_ranks(
            self._basis.pencil.model.comm, parts
        )
        m, d = self._reduced.motions, self._reduced.driven
        # Of rigid motions there is the mass alone.
        integral[:, d:m] = 0.0
        integral[:, :, d:m] = 0.0
        return np.asarray(integral[0] + 1j * integral[1])

    def _work(self, x: Complex, s: Complex) -> complex:
        """Integral of a local modulus times the square of a state's strain."""
        return complex(self._over_ranks(np.array([(self._weight * s) @ self._squares(x)]))[0])

    def _squares(self, x: Complex) -> Complex:
        """Square of a state's strain at each point; rigid motions have none."""
        reduced = self._reduced
        x = x.copy()
        x[reduced.driven : reduced.motions] = 0.0
        return np.asarray(((x @ self._strains) ** 2).reshape(len(self._weight), -1).sum(axis=1))

    def _over_ranks(self, parts: Complex) -> Complex:
        """Sum of the parts (n,) of an integral over all ranks, and over the symmetric copies of the body."""
        model = self._basis.pencil.model
        real, imaginary = (sum_over_ranks(model.comm, part) for part in (parts.real, parts.imag))
        return np.asarray(model.multiplicity * (real + 1j * imaginary))

    def _local(self, x: Complex) -> Array:
        """Shear amplitude at each point, per unit of the sleeve's motion."""
        parts = np.array([x.real, x.imag]) @ self._strains
        squares = (parts**2).sum(axis=0).reshape(len(self._weight), -1).sum(axis=1)
        return np.asarray(np.sqrt(squares / self._mu))

    def _residuals(self, s: Complex, frequency: float) -> Array:
        """Real and imaginary part of the residual, solved with K_eq, shape (2, n)."""
        _, x = self._stiffness(s, frequency)
        basis, pencil = self._basis, self._basis.pencil
        points = pencil.model.body.rubber.points
        strain = (x @ self._strains).reshape(len(self._weight), -1)
        stress = np.einsum("prk,pr->pk", self._root, s[:, None] * strain)
        forces = basis.forces_of(x, frequency, self._reduced.density)
        for part, force in zip((stress.real, stress.imag), forces, strict=True):
            points.add_forces(np.ascontiguousarray(part), force)
        return pencil.solve(forces)


def _roots(packed: Array, rows: int) -> Array:
    """Return B with B^T B the moduli of each point, shape (points, rank, rows)."""
    a, b = np.triu_indices(rows)
    full = np.zeros((len(packed), rows, rows))
    full[:, a, b] = full[:, b, a] = packed
    values, vectors = np.linalg.eigh(full)
    rank = int(np.count_nonzero(values > FLAT * values.max(), axis=1).max())
    roots = np.sqrt(np.maximum(values[:, -rank:], 0.0))
    return np.ascontiguousarray(roots[:, :, None] * vectors[:, :, -rank:].transpose(0, 2, 1))


def _range(balances: Sequence[Balance]) -> tuple[Array, float]:
    """Return the frequencies (n,), Hz, and the largest amplitude, mm or rad, of balances."""
    return np.array([one.frequency for one in balances]), max(one.amplitude for one in balances)
