"""Where a refit begins: as derivatives promise, with less of the effect, or at the law's own start."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.diagnosis.start import begin
from forms.law import law

LOWER, UPPER = np.array([1e-6, -100.0, -100.0, 0.0]), np.array([1e3, 100.0, 100.0, 10.0])
TRUTH = np.array([0.8, -0.04, 0.007, 0.3])
# What a fit without the effect has made of the law, and the effect's first-order estimate.
BENT = np.array([0.2, 0.4, -0.1, 0.4])
NAMES = ("C10", "C20", "C30", "effect.amplitude")


class Problem:
    """Yeoh's law in simple shear and an effect that adds a constant; `unsolvable(x)` fails."""

    names, fixed = NAMES, {}

    def __init__(self, unsolvable=lambda x: False):
        q = np.linspace(0.05, 1.0, 20)
        self.law, self.unsolvable, self.asked = law("yeoh"), unsolvable, set()
        self.slope = np.column_stack([2 * q, 4 * q**3, 6 * q**5, np.ones(20)])
        recording = SimpleNamespace(force=self.slope @ TRUTH)
        self.channels = [SimpleNamespace(recording=recording, scale=np.full(20, 0.01), coupon=False)]

    def forces(self, x):
        self.asked.add(tuple(x))
        return None if self.unsolvable(x) else [(self.slope @ x, self.slope)]

    def residual(self, x):
        found = self.forces(x)
        return np.full(20, np.nan) if found is None else found[0][0] - self.channels[0].recording.force

    def cost(self, x):
        return float(self.residual(x) @ self.residual(x))


def begun(problem, retreats=(), hoped=0.0):
    return begin(problem, BENT, LOWER, UPPER, retreats, lambda x: problem.cost(x) <= hoped)


def test_a_start_as_good_as_hoped_for_is_taken_and_nothing_else_is_solved():
    problem = Problem()
    assert begun(problem, hoped=np.inf) == pytest.approx(BENT)
    assert len(problem.asked) == 1


def test_a_worse_one_gives_way_to_the_laws_own_start_at_scale():
    problem = Problem()
    found = begun(problem)
    assert problem.cost(found) < problem.cost(BENT)
    own = [p.start for p in law("yeoh").parameters]
    assert found[1:3] / found[0] == pytest.approx(np.array(own[1:]) / own[0])
    assert found[3] == BENT[3]


def test_it_stays_where_the_laws_own_start_is_worse():
    # The own start fits worse wherever it stands: the truth is what was begun with.
    problem = Problem()
    assert begin(problem, TRUTH, LOWER, UPPER, (), lambda x: False) == pytest.approx(TRUTH)


def test_where_the_effect_cannot_be_solved_there_is_less_of_it():
    problem = Problem(lambda x: x[3] > 0.35)
    retreats = ({NAMES[3]: 0.3}, {NAMES[3]: 0.1})
    assert begun(problem, retreats, hoped=np.inf) == pytest.approx([*BENT[:3], 0.3])


def test_where_the_bent_law_cannot_be_solved_the_own_start_keeps_the_whole_effect():
    problem = Problem(lambda x: x[2] < 0)
    found = begun(problem, ({NAMES[3]: 0.1},))
    assert found[2] > 0
    assert found[3] == BENT[3]


def test_where_nothing_can_be_solved_there_is_none():
    assert begun(Problem(lambda x: True), ({NAMES[3]: 0.1},)) is None
