"""Rubbers for `halfplane`: hyperelastic laws, and memory by formulas that the catalogue does not have.

All take F (n, 3, 3). `Law` has the isochoric energy's derivatives by the invariants; the others add to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Memory = Mapping[str, Array]
UNIT = np.eye(3)


def transpose(A: Array) -> Array:
    return np.swapaxes(A, -1, -2)


def trace(A: Array) -> Array:
    return np.einsum("pii->p", A)


def dev(A: Array) -> Array:
    return A - (trace(A) / 3)[:, None, None] * UNIT


def det(A: Array) -> Array:
    """Determinant of (n, 3, 3); faster than LAPACK for small matrices."""
    return (
        A[:, 0, 0] * (A[:, 1, 1] * A[:, 2, 2] - A[:, 1, 2] * A[:, 2, 1])
        - A[:, 0, 1] * (A[:, 1, 0] * A[:, 2, 2] - A[:, 1, 2] * A[:, 2, 0])
        + A[:, 0, 2] * (A[:, 1, 0] * A[:, 2, 1] - A[:, 1, 1] * A[:, 2, 0])
    )


def inverse(A: Array) -> Array:
    """Inverse of (n, 3, 3)."""
    out = np.empty_like(A)
    for i in range(3):
        for j in range(3):
            a, b = [k for k in range(3) if k != j], [k for k in range(3) if k != i]
            minor = A[:, a[0], b[0]] * A[:, a[1], b[1]] - A[:, a[0], b[1]] * A[:, a[1], b[0]]
            out[:, i, j] = (-1) ** (i + j) * minor
    return out / det(A)[:, None, None]


@dataclass(frozen=True)
class Law:
    """A hyperelastic law with a penalty on the volume.

    Attributes
    ----------
    name : {"yeoh", "mooney_rivlin", "gent", "neo_hookean"}
    values : mapping
        MPa.
    bulk : float
        MPa.
    volumetric : {"simple", "log"}
        bulk/2 (J - 1)^2, or bulk/4 (J^2 - 1 - 2 ln J).
    """

    name: str
    values: Mapping[str, float]
    bulk: float = 2000.0
    volumetric: Literal["simple", "log"] = "simple"

    @property
    def shear(self) -> float:
        """Initial shear modulus."""
        v = self.values
        if self.name == "gent":
            return v["mu"]
        return 2 * (v["C10"] + v.get("C01", 0.0))

    def energy(self, I1: Array, I2: Array) -> tuple[Array, Array, Array]:
        """Isochoric energy, and its derivatives by I1 and I2."""
        v, e = self.values, I1 - 3
        if self.name == "gent":
            x = np.minimum(e / v["Jm"], 0.98)
            return -0.5 * v["mu"] * v["Jm"] * np.log(1 - x), 0.5 * v["mu"] / (1 - x), np.zeros_like(e)
        if self.name == "mooney_rivlin":
            W = v["C10"] * e + v["C01"] * (I2 - 3)
            return W, np.full_like(e, v["C10"]), np.full_like(e, v["C01"])
        c2, c3 = v.get("C20", 0.0), v.get("C30", 0.0)
        W = v["C10"] * e + c2 * e**2 + c3 * e**3
        return W, v["C10"] + 2 * c2 * e + 3 * c3 * e**2, np.zeros_like(e)

    def volume(self, J: Array) -> tuple[Array, Array]:
        """First and second derivative of the volumetric energy by J."""
        if self.volumetric == "log":
            return 0.5 * self.bulk * (J - 1 / J), 0.5 * self.bulk * (1 + J**-2)
        return self.bulk * (J - 1), np.full_like(J, self.bulk)

    def start(self, n: int) -> Memory:
        """No memory."""
        return {}

    def parts(self, F: Array) -> tuple[Array, Array, Array, Array]:
        """J, isochoric b, isochoric Kirchhoff stress, isochoric energy."""
        J = det(F)
        b = np.einsum("pij,pkj->pik", F, F) * (J ** (-2 / 3))[:, None, None]
        I1 = trace(b)
        bb = b @ b
        I2 = 0.5 * (I1**2 - trace(bb))
        W, W1, W2 = self.energy(I1, I2)
        tau = dev(2 * (W1 + W2 * I1)[:, None, None] * b - 2 * W2[:, None, None] * bb)
        return J, b, tau, W

    def stress(self, F: Array, memory: Memory, dt: float) -> tuple[Array, Memory]:
        """Stress without memory."""
        return first(F, self.parts(F)[2]), memory


@dataclass(frozen=True)
class Simo:
    """Simo's form: the history is that of dW/dC before its deviator is taken.

    S = J^(-2/3) DEV[2 dW/dC' + sum h], h' + h / tau = g d/dt DEV'[2 dW/dC'], all of the isochoric C'.

    References
    ----------
    Simo (1987), doi:10.1016/0045-7825(87)90107-1.
    """

    law: Law
    g: tuple[float, ...]
    tau: tuple[float, ...]

    def volume(self, J: Array) -> tuple[Array, Array]:
        """The law's."""
        return self.law.volume(J)

    def start(self, n: int) -> Memory:
        """Virgin rubber."""
        zero = np.zeros((n, 3, 3))
        return {f"h{i}": zero for i in range(len(self.g))} | {"S": zero}

    def stress(self, F: Array, memory: Memory, dt: float) -> tuple[Array, Memory]:
        """Stress, and memory at the end of the step."""
        J, _, tau, _ = self.law.parts(F)
        G = F * (J ** (-1 / 3))[:, None, None]
        back = inverse(G)
        # Pulled back with the isochoric part of F.
        S = back @ tau @ transpose(back)
        new: dict[str, Array] = {"S": S}
        total = tau
        for i, (g, t) in enumerate(zip(self.g, self.tau, strict=True)):
            x = dt / t
            h = np.exp(-x) * memory[f"h{i}"] + g * (_mean(x)) * (S - memory["S"])
            new[f"h{i}"] = h
            total = total + dev(G @ h @ transpose(G))
        return first(F, total), new


@dataclass(frozen=True)
class Holzapfel:
    """Holzapfel's form: the history is that of the second Piola-Kirchhoff stress itself.

    Q' + Q / tau = g d/dt S_iso. With `arc` time is replaced by the arc length of the path of C (endochronic: the same
    at every rate), and tau is a strain.

    References
    ----------
    Holzapfel (1996), doi:10.1002/(SICI)1097-0207(19961130)39:22<3903::AID-NME34>3.0.CO;2-C. Valanis (1971), A theory
    of viscoplasticity without a yield surface, Arch. Mech. 23:517-551.
    """

    law: Law
    g: tuple[float, ...]
    tau: tuple[float, ...]
    arc: bool = False

    def volume(self, J: Array) -> tuple[Array, Array]:
        """The law's."""
        return self.law.volume(J)

    def start(self, n: int) -> Memory:
        """Virgin rubber."""
        zero = np.zeros((n, 3, 3))
        memory = {f"Q{i}": zero for i in range(len(self.g))} | {"S": zero}
        return memory | {"C": np.broadcast_to(UNIT, (n, 3, 3))} if self.arc else memory

    def stress(self, F: Array, memory: Memory, dt: float) -> tuple[Array, Memory]:
        """Stress, and memory at the end of the step."""
        _, _, tau, _ = self.law.parts(F)
        back = inverse(F)
        S = back @ tau @ transpose(back)
        new: dict[str, Array] = {"S": S}
        C = transpose(F) @ F
        if self.arc:
            new["C"] = C
            way = 0.5 * np.sqrt(np.einsum("pij,pij->p", C - memory["C"], C - memory["C"]) + 1e-24)
        total = tau
        for i, (g, t) in enumerate(zip(self.g, self.tau, strict=True)):
            x = (way / t)[:, None, None] if self.arc else dt / t
            Q = np.exp(-x) * memory[f"Q{i}"] + g * _mean(x) * (S - memory["S"])
            new[f"Q{i}"] = Q
            total = total + dev(F @ Q @ transpose(F))
        return first(F, total), new


@dataclass(frozen=True)
class BergstroemBoyce:
    """A second network whose chains slip at a rate that grows with a power of the stress.

    Neo-Hookean of modulus g mu; its unimodular dashpot tensor follows Ci' = k (C' - tr(C' Ci^-1) Ci / 3),
    k = rate (lambda - 1 + 0.01)^-1 (s / (g mu))^(m - 1), lambda the chains' creep stretch, s the shear stress.

    References
    ----------
    Bergstroem and Boyce (1998), doi:10.1016/S0022-5096(97)00075-6.
    """

    law: Law
    g: float
    rate: float
    m: float

    def volume(self, J: Array) -> tuple[Array, Array]:
        """The law's."""
        return self.law.volume(J)

    def start(self, n: int) -> Memory:
        """Virgin rubber."""
        return {"Ci": np.broadcast_to(UNIT, (n, 3, 3))}

    def stress(self, F: Array, memory: Memory, dt: float) -> tuple[Array, Memory]:
        """Stress, and memory at the end of the step."""
        J, _, tau, _ = self.law.parts(F)
        G = F * (J ** (-1 / 3))[:, None, None]
        C = transpose(G) @ G
        Ci, mu = memory["Ci"], self.g * self.law.shear
        stretch = np.sqrt(np.maximum(trace(Ci) / 3, 1.0)) - 1 + 0.01
        a = np.zeros(len(F))
        # Alternate between multiplier and stress; as the stress falls when the multiplier grows, use the geometric
        # mean.
        for _ in range(12):
            M = Ci + a[:, None, None] * C
            new = M / np.cbrt(det(M))[:, None, None]
            extra = mu * dev(G @ inverse(new) @ transpose(G))
            s = np.sqrt(0.5 * np.einsum("pij,pij->p", extra, extra))
            wanted = dt * self.rate / stretch * (s / mu + 1e-9) ** (self.m - 1)
            a = np.sqrt((a + 1e-12) * (wanted + 1e-12)) if self.m > 1.5 else wanted
        return first(F, tau + extra), {"Ci": new}


@dataclass(frozen=True)
class DorfmannOgden:
    """Softening with residual strain.

    tau = e1 tau_0 + (1 - e2) N with e1 = 1 - (1/r) tanh((Wm - W) / m), e2 = tanh((W / Wm)^a) / tanh 1 and
    a = 0.3 + 0.16 Wm / mu, as in the paper. The paper's residual energy has moduli along fixed principal axes, which do
    not exist in shear to both sides; here N is the stress of a network (neo-Hookean, modulus `residual` mu) that is
    stress-free where the point had its largest energy and draws the unloaded rubber towards that state.

    References
    ----------
    Dorfmann and Ogden (2004), doi:10.1016/j.ijsolstr.2003.11.014. Tobolsky (1960), Properties and Structure of
    Polymers (networks formed in the deformed state).
    """

    law: Law
    inverse_r: float
    m: float
    residual: float

    def volume(self, J: Array) -> tuple[Array, Array]:
        """The law's."""
        return self.law.volume(J)

    def start(self, n: int) -> Memory:
        """Virgin rubber."""
        return {"peak": np.full(n, 1e-9), "Cp": np.broadcast_to(UNIT, (n, 3, 3))}

    def stress(self, F: Array, memory: Memory, dt: float) -> tuple[Array, Memory]:
        """Stress, and memory at the end of the step."""
        J, _, tau, W = self.law.parts(F)
        G = F * (J ** (-1 / 3))[:, None, None]
        news = memory["peak"] < W
        peak = np.where(news, W, memory["peak"])
        Cp = np.where(news[:, None, None], transpose(G) @ G, memory["Cp"])
        e1 = 1 - self.inverse_r * np.tanh((peak - W) / self.m)
        a = 0.3 + 0.16 * peak / self.law.shear
        e2 = np.tanh(np.maximum(W / peak, 1e-12) ** a) / np.tanh(1.0)
        N = self.residual * self.law.shear * dev(G @ inverse(Cp) @ transpose(G))
        total = e1[:, None, None] * tau + (1 - e2)[:, None, None] * N
        return first(F, total), {"peak": peak, "Cp": Cp}


@dataclass(frozen=True)
class Damage:
    """Stress times 1 - d, d = most (1 - exp(-Wm / scale)), Wm the largest energy so far; it does not recover.

    References
    ----------
    Simo (1987), doi:10.1016/0045-7825(87)90107-1 (discontinuous damage). Miehe (1995),
    Eur. J. Mech. A 14:697-720.
    """

    law: Law
    most: float
    scale: float

    def volume(self, J: Array) -> tuple[Array, Array]:
        """The law's."""
        return self.law.volume(J)

    def start(self, n: int) -> Memory:
        """Virgin rubber."""
        return {"peak": np.zeros(n)}

    def stress(self, F: Array, memory: Memory, dt: float) -> tuple[Array, Memory]:
        """Stress, and memory at the end of the step."""
        _, _, tau, W = self.law.parts(F)
        peak = np.maximum(memory["peak"], W)
        left = 1 - self.most * (1 - np.exp(-peak / self.scale))
        return first(F, left[:, None, None] * tau), {"peak": peak}


@dataclass(frozen=True)
class DamagedSimo:
    """Damage of Simo's viscous rubber: both at once, as in the paper."""

    simo: Simo
    most: float
    scale: float

    @property
    def law(self) -> Law:
        """Law of the undamaged rubber after a long rest."""
        return self.simo.law

    def volume(self, J: Array) -> tuple[Array, Array]:
        """The law's."""
        return self.law.volume(J)

    def start(self, n: int) -> Memory:
        """Virgin rubber."""
        return {**self.simo.start(n), "peak": np.zeros(n)}

    def stress(self, F: Array, memory: Memory, dt: float) -> tuple[Array, Memory]:
        """Stress, and memory at the end of the step."""
        W = self.law.parts(F)[3]
        peak = np.maximum(memory["peak"], W)
        left = (1 - self.most * (1 - np.exp(-peak / self.scale)))[:, None, None]
        P, new = self.simo.stress(F, memory, dt)
        return left * P, {**new, "peak": peak}


def first(F: Array, tau: Array) -> Array:
    """First Piola-Kirchhoff stress of a Kirchhoff stress."""
    return tau @ transpose(inverse(F))


def _mean(x: float | Array) -> Array:
    """(1 - exp(-x)) / x: the mean remaining share of a stress that was applied evenly over the step."""
    x = np.maximum(np.asarray(x, dtype=float), 1e-12)
    return -np.expm1(-x) / x
