"""A least-squares problem with closed-form answers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.problem import Stopping


class Linear:
    """One channel whose force is linear in two parameters, with noise.

    `wall(x)` is true where no solution exists; `edge(x)` is what instability adds to the misfit, `margin(x)` the
    distance from instability.
    """

    names = ("a", "b")
    noise = 0.05

    def __init__(self, wall=lambda x: False, edge=lambda x: 0.0, bend=0.0):
        rng = np.random.default_rng(5)
        q = np.linspace(0.1, 1.0, 200)
        self.rows, self.bend, self.wall, self.edge = np.column_stack([q, q**2]), bend, wall, edge
        self.margin = lambda x: -self.edge(x)
        force = self.curve(np.array([2.0, -0.5])) + self.noise * rng.standard_normal(len(q))
        self.channels = [SimpleNamespace(coupon=True, scale=np.full(len(q), self.noise), measured=force)]
        self.bounds = Bounds(np.full(2, -1e3), np.full(2, 1e3))
        self.states, self.samples = np.zeros((1, 3)), len(q)
        self.asked, self.evaluations, self.best = [], [], None
        self.stopping = Stopping(1e-7, (25, 1e-4), 5, 200, 200)

    def curve(self, x):
        return self.rows @ x + self.bend * self.rows[:, 1] * x[1] ** 2

    def forces(self, x):
        slope = self.rows + 2 * self.bend * x[1] * np.outer(self.rows[:, 1], [0, 1])
        return [(self.curve(x), slope)]

    def law_parameters(self, x):
        return dict(zip(self.names, x, strict=True))

    parameters = law_parameters

    def stiffness_shares(self, x):
        return np.zeros(2), np.zeros((2, 2))

    def reached_stretches(self, x):
        return np.zeros((0, 3))

    def watch(self, states, best=None):
        pass

    def answers(self, x, trial):
        pass

    def instability(self, x, states=None):
        return np.array([self.edge(x)])

    def penalty_and_margins(self, x):
        return self.instability(x), np.array([self.margin(x)])

    def stability(self, x):
        step = 1e-7
        slope = [(self.edge(x + step * unit) - self.edge(x)) / step for unit in np.eye(2)]
        return self.instability(x), np.array([slope])

    def residual(self, x):
        self.asked.append(x.copy())
        cost = float("nan") if self.wall(x) else 1.0
        self.evaluations.append(SimpleNamespace(parameters=self.parameters(x), cost=cost))
        (force, _), weight = self.forces(x)[0], 1 / (self.noise * np.sqrt(self.samples))
        value = np.append((force - self.channels[0].measured) * weight, self.edge(x))
        return value * np.nan if self.wall(x) else value

    def jacobian(self, x):
        slope = self.forces(x)[0][1] / (self.noise * np.sqrt(self.samples))
        return np.vstack([slope, self.stability(x)[1]])

    def cost(self, x):
        return float(np.sum(self.residual(x) ** 2))

    def minimum(self):
        """Least-squares solution in closed form (without bend), and its covariance from the remaining white noise."""
        force = self.channels[0].measured
        x = np.linalg.lstsq(self.rows, force, rcond=None)[0]
        left = force - self.rows @ x
        return x, left @ left / (self.samples - 2) * np.linalg.inv(self.rows.T @ self.rows)


@pytest.fixture
def linear():
    """Return the class of linear problems."""
    return Linear
