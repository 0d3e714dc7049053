"""A bushing of revolution under axial load or torsion, in NumPy: for rubbers that are not in the catalogue.

Eight-node serendipity elements with 2 x 2 points (CalculiX's CAX8R) and a penalty on the volume: reduced integration
keeps them from locking. The unknowns at a node are the displacements along r and z, and the turn about the axis where
there is torsion. In cylindrical frames of the reference and the present position

    F = [[1 + u_R, 0, u_Z], [r f_R, r / R, r f_Z], [w_R, 0, 1 + w_Z]],   r = R + u.

A rubber gives its isochoric first Piola-Kirchhoff stress at all points at once, from F, its memory and the time step;
the tangent is its difference quotient. The pressure is a separate unknown at each point and is condensed: the tangent
uses the pressure predicted by the last step of Newton's method, not that of the resulting volumes, which for nearly
incompressible rubber is far off until the end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import SuperLU, splu

from benchmarks.decks.foreign.rubbers import det, inverse

Array = NDArray[np.float64]
Memory = Mapping[str, Array]

# Elements across the rubber; elements along it per thickness of length; ratio of the longest to the shortest.
ACROSS, ALONG, GRADING = 6, 4.0, 3.0
# Further lines beside one where a bond ends, over the distance to its neighbours.
CLOSING_IN = (0.5, 0.2, 0.07)
# Tolerance of the residual relative to the reaction; largest number of iterations.
TOLERANCE, MOST = 1e-7, 12
# Least reference for the residual, as a share of the largest reaction so far, because the reaction vanishes at rest.
FAINT = 0.02
# Step of F for the difference quotient.
DIFFERENCE = 1e-7
# Largest number of times that a failed step is halved.
HALVINGS = 5


class NotSolved(Exception):
    """Newton's method found no equilibrium."""


class Rubber(Protocol):
    """Stress at all points."""

    def start(self, n: int) -> Memory:
        """Memory of virgin rubber at n points."""

    def stress(self, F: Array, memory: Memory, dt: float) -> tuple[Array, Memory]:
        """Isochoric first Piola-Kirchhoff stress (n, 3, 3), MPa, and the memory at the end of the step (s)."""

    def volume(self, J: Array) -> tuple[Array, Array]:
        """First and second derivative of the volumetric energy by J, MPa."""


@dataclass(frozen=True)
class State:
    """State at the points for a displacement: F, its derivative, stress, J and the cofactor of F."""

    F: Array
    B: Array
    P: Array
    J: Array
    cofactor: Array


@dataclass(frozen=True)
class Bond:
    """Nodes that a sleeve holds: all but those within `free` mm of an end ("top", "bottom").

    With `on_line` the mesh has a line where the bond ends; else it ends at the last node outside `free`.
    """

    free: float = 0.0
    end: str = "top"
    on_line: bool = False


class HalfPlane:
    """A bushing: dimensions as in the case file (plain or tapered).

    Parameters
    ----------
    dimensions
        mm.
    twist : bool
        Whether the bushing is turned; otherwise it is moved along the axis.
    rubber
    inner, outer
        Bonds.
    reduction : callable, optional
        Inward motion (mm) of the outer sleeve before the test, a function of z.
    shrinkage : callable, optional
        Linear strain by which the rubber shrank between its sleeves, a function of the radius.
    """

    def __init__(
        self,
        dimensions: Mapping[str, float],
        twist: bool,
        rubber: Rubber,
        inner: Bond = Bond(),
        outer: Bond = Bond(),
        reduction: Callable[[Array], Array] | None = None,
        shrinkage: Callable[[Array], Array] | None = None,
    ) -> None:
        self.rubber, self.twist, self.reduction = rubber, twist, reduction
        a, b = dimensions["inner_radius"], dimensions["outer_radius"]
        lengths = [
            dimensions.get(key, dimensions.get("length", 0.0)) for key in ("inner_length", "outer_length")
        ]
        along = max(8, round(ALONG * max(lengths) / (b - a)))
        lines = _graded_points(along)
        assert not (inner.on_line and outer.on_line), "the second line would move the first"
        for bond, length in zip((inner, outer), lengths, strict=True):
            if bond.on_line:
                lines = _with_line(lines, (1 if bond.end == "top" else -1) * (1 - 2 * bond.free / length))
        self.points, self.elements = _mesh(a, b, lengths[0], lengths[1], ACROSS, lines)
        self.width = 3 if twist else 2
        n = len(self.points)
        R, Z = self.points.T
        tiny = 1e-6 * (b - a)
        self._inner = _is_bonded(np.abs(R - a) < tiny, Z, inner)
        self._outer = _is_bonded(np.abs(R - b) < tiny, Z, outer)
        fixed = np.zeros((n, self.width), dtype=bool)
        fixed[self._inner | self._outer] = True
        self.fixed = fixed.ravel()
        driven = np.zeros((n, self.width))
        driven[self._inner, 2 if twist else 1] = 1.0
        self.driven = driven.ravel()
        self._prepare()
        # F_e = F / (1 - e): the stress-free rubber is smaller.
        self._strain = shrinkage(self._R) if shrinkage is not None else np.zeros(self.count)
        self._rest = np.ones(self.count)

    def _prepare(self) -> None:
        """Compute shape functions at the points, and the sparsity."""
        xi = np.array([-1.0, 1.0]) / np.sqrt(3.0)
        grid = np.array([(x, y) for x in xi for y in xi])
        values, slopes = _shapes(grid)
        nodes = self.points[self.elements]  # (e, 8, 2)
        J = np.einsum("eai,paj->epij", nodes, slopes)
        self._N = np.broadcast_to(values, (len(nodes), *values.shape)).reshape(-1, 8)
        self._dN = np.einsum("paj,epji->epai", slopes, np.linalg.inv(J)).reshape(-1, 8, 2)
        self._R = np.einsum("pa,ea->ep", values, nodes[:, :, 0]).ravel()
        self._weight = 2 * np.pi * (np.linalg.det(J)).ravel() * self._R
        self._element = np.repeat(np.arange(len(nodes)), len(grid))
        dofs = self.elements[:, :, None] * self.width + np.arange(self.width)
        self._dofs = dofs.reshape(len(nodes), -1)
        m = self._dofs.shape[1]
        self._rows = np.repeat(self._dofs, m, axis=1).ravel()
        self._columns = np.tile(self._dofs, (1, m)).ravel()
        self.count = len(self._R)

    # -- assembly ------------------------------------------------------------------------------------------------

    def _gradient(self, x: Array) -> tuple[Array, Array]:
        """F (p, 3, 3) and its derivative B (p, 3, 3, dofs of the element)."""
        u = x.reshape(-1, self.width)[self.elements[self._element]]  # (p, 8, width)
        N, dN, R = self._N, self._dN, self._R
        p, w = len(R), self.width
        F, B = np.zeros((p, 3, 3)), np.zeros((p, 3, 3, 8, w))
        r = R + np.einsum("pa,pa->p", N, u[:, :, 0])
        du = np.einsum("pai,pac->pci", dN, u)
        F[:, 0, 0], F[:, 0, 2] = 1 + du[:, 0, 0], du[:, 0, 1]
        F[:, 2, 0], F[:, 2, 2] = du[:, 1, 0], 1 + du[:, 1, 1]
        F[:, 1, 1] = r / R
        B[:, 0, 0, :, 0], B[:, 0, 2, :, 0] = dN[:, :, 0], dN[:, :, 1]
        B[:, 2, 0, :, 1], B[:, 2, 2, :, 1] = dN[:, :, 0], dN[:, :, 1]
        B[:, 1, 1, :, 0] = N / R[:, None]
        if self.twist:
            for i, j in ((0, 0), (1, 2)):
                F[:, 1, j] = r * du[:, 2, i]
                B[:, 1, j, :, 2] = r[:, None] * dN[:, :, i]
                B[:, 1, j, :, 0] = N * du[:, 2, i, None]
        return F, B.reshape(p, 3, 3, 8 * w)

    def _residual(self, x: Array, memory: Memory, dt: float) -> tuple[Array, State, Memory]:
        F, B = self._gradient(x)
        rest = self._rest[:, None, None]
        Fe = F / rest
        J = det(Fe)
        if not np.all(J > 0.2):
            raise NotSolved
        cofactor = J[:, None, None] * np.swapaxes(inverse(Fe), 1, 2)
        P, new = self.rubber.stress(Fe, memory, dt)
        first, _ = self.rubber.volume(J)
        # The energy per volume before shrinkage is rest^3 times that of the shrunk rubber, and F is rest times F_e.
        whole = (P + first[:, None, None] * cofactor) * rest**2
        local = np.einsum("pij,pijm->pm", self._weight[:, None, None] * whole, B)
        r = np.bincount(self._dofs[self._element].ravel(), weights=local.ravel(), minlength=len(x))
        return r, State(Fe, B, P, J, cofactor), new

    def _tangent(self, state: State, memory: Memory, dt: float) -> SuperLU:
        F, B, P, J, H = state.F, state.B, state.P, state.J, state.cofactor
        _, second = self.rubber.volume(J)
        p = self._pressure
        A = np.zeros((len(F), 3, 3, 3, 3))
        pairs = [(0, 0), (0, 2), (1, 1), (2, 0), (2, 2)] + ([(1, 0), (1, 2)] if self.twist else [])
        for k, m in pairs:
            moved = F.copy()
            moved[:, k, m] += DIFFERENCE
            A[:, :, :, k, m] = (self.rubber.stress(moved, memory, dt)[0] - P) / DIFFERENCE
        # d cofactor / dF = (H x H - H x H with the second indices exchanged) / J
        HH = H[:, :, :, None, None] * H[:, None, None, :, :]
        A += second[:, None, None, None, None] * HH
        A += (p / J)[:, None, None, None, None] * (HH - HH.transpose(0, 1, 4, 3, 2))
        weight = self._weight * self._rest
        AB = A.reshape(-1, 9, 9) @ B.reshape(len(F), 9, -1)
        K = np.swapaxes(B.reshape(len(F), 9, -1), 1, 2) @ (weight[:, None, None] * AB)
        if self.twist:
            # r f_R depends on both u and f.
            whole = (P + p[:, None, None] * H) * (self._weight * self._rest**2)[:, None, None]
            for i, j in ((0, 0), (1, 2)):
                s = whole[:, 1, j][:, None, None] * (self._N[:, :, None] * self._dN[:, None, :, i])
                K[:, 0::3, 2::3] += s
                K[:, 2::3, 0::3] += s.transpose(0, 2, 1)
        per = 4
        K = K.reshape(-1, per, *K.shape[1:]).sum(axis=1)
        n = len(self.fixed)
        whole = coo_matrix((K.ravel(), (self._rows, self._columns)), shape=(n, n)).tocsr()
        free = ~self.fixed
        self._coupling = whole[free][:, self.fixed]
        return splu(whole[free][:, free].tocsc())

    # -- marching ------------------------------------------------------------------------------------------------

    def march(self, time: Array, q: Array, before: int = 6) -> Array:
        """Force (n,) at samples, marched in order from rest."""
        x = np.zeros(len(self.fixed))
        memory = self.rubber.start(self.count)
        self._largest, self._pressure = 0.0, np.zeros(self.count)
        whole = np.zeros((len(self.points), self.width))
        if self.reduction is not None:
            whole[self._outer, 0] = -self.reduction(self.points[self._outer, 1])
        base = whole.ravel()
        if np.any(base) or np.any(self._strain):
            # The assembly is slow compared with the test, so that it leaves no memory.
            for k in range(1, before + 1):
                self._rest = 1 - self._strain * k / before
                x, _, _ = self._step(x, memory, 0.0, base * k / before)
        forces = np.zeros(len(q))
        last, t_last = 0.0, float(time[0])
        for i, (t, at) in enumerate(zip(time, q, strict=True)):
            x, memory, forces[i] = self._go(x, memory, base, (t_last, last), (float(t), float(at)), HALVINGS)
            last, t_last = float(at), float(t)
        return forces

    def _go(
        self,
        x: Array,
        memory: Memory,
        base: Array,
        begin: tuple[float, float],
        end: tuple[float, float],
        halvings: int,
    ) -> tuple[Array, Memory, float]:
        """The step to one sample, halved where it fails."""
        pressure = self._pressure
        try:
            return self._step(x, memory, end[0] - begin[0], base + end[1] * self.driven)
        except NotSolved:
            if halvings == 0:
                raise
            self._pressure = pressure
            middle = (0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]))
            x, memory, _ = self._go(x, memory, base, begin, middle, halvings - 1)
            return self._go(x, memory, base, middle, end, halvings - 1)

    def _step(self, x: Array, memory: Memory, dt: float, held: Array) -> tuple[Array, Memory, float]:
        """Newton's method, from the last state: its first step moves the sleeve and the rubber together."""
        free = ~self.fixed
        x = x.copy()
        for k in range(MOST):
            r, state, new = self._residual(x, memory, dt)
            rest = float(np.linalg.norm(r[free]))
            if not np.isfinite(rest):
                raise NotSolved
            jump = (held - x)[self.fixed]
            arrived = not np.any(jump)
            reaction = float(np.linalg.norm(r[self.fixed]))
            if arrived and rest <= TOLERANCE * max(reaction, FAINT * self._largest, 1e-6):
                self._largest = max(self._largest, reaction)
                return x, new, float(r @ self.driven)
            if arrived and k > 1 and rest > 1e7:
                raise NotSolved
            lu = self._tangent(state, memory, dt)
            step = np.zeros(len(x))
            step[self.fixed] = jump
            step[free] = -lu.solve(r[free] + self._coupling @ jump)
            if not np.all(np.isfinite(step)):
                raise NotSolved
            x = x + step
            # The pressure that this step predicts.
            first, second = self.rubber.volume(state.J)
            moved = (
                np.einsum("pijm,pm->pij", state.B, step[self._dofs[self._element]])
                / self._rest[:, None, None]
            )
            self._pressure = first + second * np.einsum("pij,pij->p", state.cofactor, moved)
        raise NotSolved


def force_at_samples(body: HalfPlane, time: Array, q: Array) -> Array:
    """Force (n,) at samples: every second one is marched, the others by a spline between turning points."""
    sign = np.sign(np.diff(q))
    turns = [0, *(np.flatnonzero(np.diff(sign)) + 1), len(q) - 1]
    nodes = sorted({i for a, b in pairwise(turns) for i in (*range(a, b, 2), b)} | {0})
    force = body.march(time[nodes], q[nodes])
    forces = np.zeros(len(q))
    place = {i: k for k, i in enumerate(nodes)}
    for a, b in pairwise(turns):
        own = [i for i in nodes if a <= i <= b]
        values = force[[place[i] for i in own]]
        inside = np.arange(a, b + 1)
        forces[inside] = CubicSpline(own, values)(inside) if len(own) > 3 else np.interp(inside, own, values)
    return forces


def _is_bonded(at: NDArray[np.bool_], Z: Array, bond: Bond) -> NDArray[np.bool_]:
    if bond.free <= 0:
        return at
    end = Z[at].max() if bond.end == "top" else -Z[at].min()
    height = Z if bond.end == "top" else -Z
    return at & (height <= end - bond.free + 1e-9)


def _with_line(lines: Array, at: float) -> Array:
    """Stretch lines from -1 to 1 so that the nearest inner one is at this place, and add some that close in on it."""
    i = 1 + int(np.argmin(np.abs(lines[1:-1] - at)))
    lines = np.interp(lines, [-1.0, lines[i], 1.0], [-1.0, at, 1.0])
    below, above = lines[i] - lines[i - 1], lines[i + 1] - lines[i]
    return np.unique(
        np.concatenate([lines, *(at + share * np.array([-below, above]) for share in CLOSING_IN)])
    )


def _graded_points(n: int) -> Array:
    """Points in [-1, 1], closer together at both ends."""
    k = np.arange(n)
    length = GRADING ** (-np.abs(2 * k - (n - 1)) / max(n - 1, 1))
    return -1 + 2 * np.concatenate([[0.0], np.cumsum(length) / length.sum()])


def _mesh(
    a: float, b: float, inner: float, outer: float, across: int, lines: Array
) -> tuple[Array, NDArray[np.int_]]:
    """Nodes (n, 2) in r, z and elements (e, 8): corners, then the middles of the sides."""

    def with_middles(x: Array) -> Array:
        return np.sort(np.concatenate([x, 0.5 * (x[1:] + x[:-1])]))

    s, t = 0.5 * (1 + with_middles(_graded_points(across))), with_middles(lines)
    number = np.full((len(s), len(t)), -1)
    points = []
    for i, si in enumerate(s):
        for j, tj in enumerate(t):
            if i % 2 and j % 2:
                continue
            number[i, j] = len(points)
            half = 0.5 * (inner + si * (outer - inner))
            points.append((a + si * (b - a), tj * half))
    ring = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    elements = [
        [number[2 * i + di, 2 * j + dj] for di, dj in ring]
        for i in range(across)
        for j in range(len(lines) - 1)
    ]
    return np.array(points), np.array(elements)


def _shapes(at: Array) -> tuple[Array, Array]:
    """Values (p, 8) and derivatives (p, 8, 2) of the serendipity functions."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
    middles = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)], dtype=float)
    x, y = at[:, :1], at[:, 1:]
    cx, cy = corners.T
    values = np.zeros((len(at), 8))
    slopes = np.zeros((len(at), 8, 2))
    values[:, :4] = 0.25 * (1 + cx * x) * (1 + cy * y) * (cx * x + cy * y - 1)
    slopes[:, :4, 0] = 0.25 * cx * (1 + cy * y) * (2 * cx * x + cy * y)
    slopes[:, :4, 1] = 0.25 * cy * (1 + cx * x) * (2 * cy * y + cx * x)
    for k, (mx, my) in enumerate(middles):
        x1, y1 = x[:, 0], y[:, 0]
        if mx == 0:
            values[:, 4 + k] = 0.5 * (1 - x1**2) * (1 + my * y1)
            slopes[:, 4 + k, 0], slopes[:, 4 + k, 1] = -x1 * (1 + my * y1), 0.5 * my * (1 - x1**2)
        else:
            values[:, 4 + k] = 0.5 * (1 + mx * x1) * (1 - y1**2)
            slopes[:, 4 + k, 0], slopes[:, 4 + k, 1] = 0.5 * mx * (1 - y1**2), -y1 * (1 + mx * x1)
    return values, slopes


def curve(body: HalfPlane, targets: Sequence[float]) -> Array:
    """Force of a body without memory at ordered displacements, each side marched from rest."""
    q = np.asarray(targets, dtype=float)
    forces = np.zeros(len(q))
    for side in (np.flatnonzero(q >= 0), np.flatnonzero(q < 0)[::-1]):
        if len(side):
            way = np.concatenate([[0.0], q[side]])
            forces[side] = body.march(np.arange(len(way), dtype=float), way)[1:]
    return forces
