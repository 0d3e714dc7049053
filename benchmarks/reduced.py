"""Whether a hyper-reduced march would pay: where the time of a march goes, and how far its parts can be reduced.

A march of a recording is profiled in processor time. POD of displacement and pressure and empirical cubature (ECSW)
then say how many vectors and cells the same march needs at a force error of 0.1 %, for laws beside the training's.

References
----------
Farhat, Chapman and Avery (2015), Structure-preserving, stability, and accuracy properties of the energy-conserving
sampling and weighting method, Int. J. Numer. Methods Eng. 102:1077-1110, doi:10.1002/nme.4820.
"""

from __future__ import annotations

import cProfile
import pstats
import sys
import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects
from bushcli.simulate.simulation import Simulation
from cases.equilibrium import Equilibrium
from cases.march import march
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.reaction import reaction
from cases.simulate import Rubber
from forms.law import law
from geometry.shape import Refinement
from geometry.shapes.plain import Plain

Array = NDArray[np.float64]

RING = Plain(inner_radius=12.0, outer_radius=22.0, length=40.0)
LAW = {"C10": 0.5, "C20": -0.05, "C30": 0.01}
REACH = {"axial": 6.0, "radial": 3.0}
#: Laws of the training, and others on which the reduced model is judged: factors of `LAW`.
TRAINING = tuple((a, b, c) for a in (0.8, 1.4) for b in (0.4, 1.2) for c in (0.7, 1.8))
OTHERS = ((1.0, 1.0, 1.0), (0.9, 1.1, 0.8), (1.3, 0.6, 1.6))
#: Error of the forces of the cells that the cubature may leave, relative.
CUBATURE = 1e-3


def channel(mode: str, memory: bool) -> Simulation:
    """A recording of four cycles to three amplitudes; the rubber is viscoelastic, or elastic."""
    time_, turns = np.linspace(0.0, 80.0, 161), np.array([0, 0.6, -0.6, 0.8, -0.8, 1, -1, 1, 0])
    q = REACH[mode] * np.interp(time_, 10.0 * np.arange(9), turns)
    name, values = ("viscoelasticity", {"g1": 0.3, "tau1": 4.0}) if memory else ("offset", {"force": 1.0})
    active = [ActiveEffect(effects()[name], values).with_start_values()]
    return Simulation(
        RING, modes()[mode], Rubber(law("yeoh"), LAW, 2000.0), Refinement(), active, time_, q, 1e-4
    )


def shares(mode: str, memory: bool) -> list[str]:
    """Return a row of the table of shares: processor time of a trial of a fit, and of its parts in percent."""
    fit_channel = channel(mode, memory)
    names = (*LAW, *(("viscoelasticity.g1", "viscoelasticity.tau1") if memory else ()))
    fit_channel.solve(LAW, names)
    times = []
    for i in range(5):
        begin = time.process_time()
        answer = fit_channel.solve({**LAW, "C10": 0.5 + 0.001 * (i + 1)}, names)
        times.append(time.process_time() - begin)
    profile = cProfile.Profile(time.process_time)
    profile.runcall(fit_channel.solve, {**LAW, "C10": 0.52}, names)
    points = factor = back = 0.0
    for (_, _, name), (_, _, own, _, _) in pstats.Stats(profile).stats.items():  # type: ignore[attr-defined]
        points += own if "bushcli_points" in name else 0.0
        factor += own if "'setUp' of 'petsc4py" in name else 0.0
        back += own if "olve' of 'petsc4py.PETSc.KSP" in name else 0.0
    whole = float(np.median(times))
    percent = [100.0 * part / whole for part in (points, factor, back)]
    space = fit_channel.model.space.dofmap
    rest = 100.0 - sum(percent)
    return [
        f"{mode}, {'viscoelastic' if memory else 'elastic'}",
        f"{space.index_map.size_global * space.index_map_bs}",
        f"{len(answer.history.displacement)}",
        f"{whole:.3f}",
        *(f"{part:.0f}" for part in (*percent, rest)),
        f"{100.0 / rest:.1f}",
    ]


class Reduced:
    """Vectors and cells of a reduced model of a mode, from marches by several laws.

    Parameters
    ----------
    mode : str
    """

    def __init__(self, mode: str) -> None:
        self.model: FiniteElementModel = channel(mode, memory=False).model
        self.program = Program(np.linspace(0.0, REACH[mode], 9)[1:])
        self.solver = Equilibrium(self.model, 1e-8)
        self.matrix, self.b = self.model.system.create_matrix(), self.model.system.create_vector()
        fixed = self.model.system.owned_constrained
        self.free = np.setdiff1d(np.arange(self.model.system.owned), fixed)
        self.states, self.stresses = self._states_and_stresses(TRAINING)
        self.weight = self.model.body.rubber.points.weight.copy()

    def _set(self, factors: tuple[float, ...]) -> None:
        self.model.set_parameters(
            {name: f * value for f, (name, value) in zip(factors, LAW.items(), strict=True)}
        )

    def _states_and_stresses(self, laws: tuple[tuple[float, ...], ...]) -> tuple[Array, list[Array]]:
        states, stresses = [], []

        def keep(_: Equilibrium) -> None:
            rubber, x = self.model.body.rubber, self.model.state.x.array
            rubber.look(x)
            stresses.append(rubber.answer().copy())
            states.append(x.copy())

        for factors in laws:
            self._set(factors)
            march(self.model, self.program, observer=keep)
        return np.array(states), stresses

    def vectors(self, count: int) -> Array:
        """Return the first modes of the displacements and of the pressures, (free unknowns, <= 2 count)."""
        pressed = np.isin(self.free, self.model.system.owned_pressures)
        blocks = []
        for part in (~pressed, pressed):
            u = np.linalg.svd(np.where(part, self.states[:, self.free], 0.0).T, full_matrices=False)[0]
            blocks.append(u[:, :count])
        return np.hstack(blocks)

    def cells(self, V: Array) -> Array:
        """Return the weights of cells (cells,) by ECSW: as few as make the forces on the vectors and on the sleeve."""
        points = self.model.body.rubber.points
        count, each = points.shape[:2]
        rate = self.model.rate(self.program.displacement[-1])
        G = []
        for P in self.stresses:
            forces = np.zeros((count, len(rate)))
            for cell, force in enumerate(forces):
                own = np.zeros_like(P)
                own[cell * each : (cell + 1) * each] = P[cell * each : (cell + 1) * each]
                points.add_forces(own, force)
            G.append(np.vstack([V.T @ forces[:, self.free].T, rate @ forces.T]))
        rows = np.vstack(G)
        rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-9 * np.linalg.norm(rows))
        return _sparse(rows, rows.sum(axis=1))

    def error(self, V: Array, weights: Array | None = None) -> float:
        """Return the largest error of the force over its range for laws outside the training; nan where it fails."""
        worst, points = 0.0, self.model.body.rubber.points
        for factors in OTHERS:
            self._set(factors)
            exact = march(self.model, self.program).force
            points.weight[:] = self.weight * (1.0 if weights is None else weights[:, None])
            reactions = []
            for q, state in zip(self.program.displacement, self.states, strict=False):
                if not self._balance(V, V.T @ state[self.free], float(q)):
                    return float("nan")
                self.model.system.residual(self.b)
                reactions.append(reaction(self.model, self.b, self.model.rate(float(q))))
            points.weight[:] = self.weight
            worst = max(worst, float(np.abs(np.array(reactions) - exact).max() / np.ptp(exact)))
        return worst

    def _balance(self, V: Array, a: Array, q: float) -> bool:
        """Bring the reduced model into equilibrium by Newton's method; return whether it is."""
        from scipy.sparse import csr_matrix

        x = np.zeros_like(self.model.state.x.array)
        for _ in range(30):
            x[self.free] = V @ a
            self.model.put(x)
            self.model.impose(q)
            self.model.system.residual(self.b)
            left = V.T @ self.b.array_r[self.free]
            self.model.system.tangent(self.matrix)
            start, column, value = self.matrix.getValuesCSR()
            K = csr_matrix((value, column, start))[self.free][:, self.free]
            if not np.isfinite(left).all():
                return False
            step = np.linalg.solve(V.T @ (K @ V), -left)
            a = a + step
            if np.linalg.norm(step) <= 1e-9 * np.linalg.norm(a):
                return True
        return False


def _sparse(G: Array, b: Array) -> Array:
    """Return non-negative weights with G w near b, as few as greedy least squares finds (Lawson and Hanson)."""
    w, active = np.zeros(G.shape[1]), np.zeros(G.shape[1], dtype=bool)
    while np.linalg.norm(G @ w - b) > CUBATURE * np.linalg.norm(b) and not active.all():
        gain = np.where(active, -np.inf, G.T @ (b - G @ w))
        active[int(np.argmax(gain))] = True
        while True:
            trial = np.zeros_like(w)
            trial[active] = np.linalg.lstsq(G[:, active], b, rcond=None)[0]
            if np.all(trial[active] > 0.0):
                break
            falling = active & (trial <= 0.0)
            step = float(np.min(w[falling] / np.maximum(w[falling] - trial[falling], 1e-300)))
            w = w + step * (trial - w)
            active &= w > 1e-12
        w = trial
    return w


def _table(head: list[str], rows: list[list[str]]) -> Iterator[str]:
    yield "| " + " | ".join(head) + " |"
    yield "| " + " | ".join("---" for _ in head) + " |"
    for row in rows:
        yield "| " + " | ".join(row) + " |"


def main(what: str) -> None:
    """Print the shares of a march, or what a reduced model needs."""
    if what == "shares":
        head = ["march", "unknowns", "steps", "CPU, s", "points", "factors", "solves", "rest, %", "bound"]
        rows = [shares(mode, memory) for mode in REACH for memory in (False, True)]
        print("\n".join(_table(head, rows)))
        return
    rows = []
    for mode in REACH:
        reduced = Reduced(mode)
        for count in (2, 4, 6, 8):
            V = reduced.vectors(count)
            weights = reduced.cells(V)
            some = f"{np.count_nonzero(weights)} of {len(weights)}"
            errors = (f"{100.0 * reduced.error(V, w):.3f}" for w in (None, weights))
            rows.append([mode, str(V.shape[1]), some, *errors])
            print(rows[-1], file=sys.stderr, flush=True)
    head = ["march", "vectors", "cells", "error with all cells, %", "with these cells, %"]
    print("\n".join(_table(head, rows)))


if __name__ == "__main__":
    main(sys.argv[1])
