"""More than one start: differential evolution, starts shared among processes, starts given up, and resuming."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.inverse import Task, identify, starts
from bushcli.inverse.channel import SweptChannel
from bushcli.runtime.executor import processes

MESH = "[mesh]\nelements_across = 2\nelements_along = 4\nelements_around = 8\n"


def values(fit):
    return {name: estimate.value for name, estimate in fit.parameters.items()}


@pytest.fixture
def case(experiment):
    return experiment("axial", extra=MESH)


@pytest.mark.slow
def test_differential_evolution_ends_at_the_same_minimum(case, monkeypatch):
    # Four generations of 18 points are enough to find the valley, and take a second.
    monkeypatch.setattr(starts, "GENERATIONS", 3)
    best = identify(Task(case, "yeoh"))
    fit = identify(Task(case, "yeoh", globally=True, seed=2))
    assert values(fit) == pytest.approx(values(best), rel=1e-4)
    assert len(fit.end_points) == 2
    # The second search began elsewhere.
    begun = [end.start["C20"] / end.start["C10"] for end in fit.end_points]
    assert abs(begun[0] / begun[1] - 1) > 0.01
    assert {e.start for e in fit.evaluations} == {0, 1}
    assert [e.number for e in fit.evaluations] == list(range(1, len(fit.evaluations) + 1))


@pytest.mark.slow
def test_the_number_of_workers_makes_no_difference(case, monkeypatch):
    """End points, evaluations and their order are equal to the bit."""
    alone = identify(Task(case, "yeoh", starts=3, seed=4))
    told = []
    shared = identify(Task(case, "yeoh", starts=3, seed=4, workers=2), progress=told.append)
    assert values(shared) == values(alone)
    assert [dict(e.parameters) for e in shared.end_points] == [dict(e.parameters) for e in alone.end_points]
    np.testing.assert_array_equal([e.cost for e in shared.evaluations], [e.cost for e in alone.evaluations])
    assert (shared.sweeps, shared.forward_solves) == (alone.sweeps, alone.forward_solves)
    assert [e.number for e in told] == [e.number for e in shared.evaluations]


@pytest.mark.slow
def test_a_pool_of_processes_makes_no_difference(case):
    alone = identify(Task(case, "yeoh", starts=3, seed=4))
    with processes(2) as pool:
        shared = identify(Task(case, "yeoh", starts=3, seed=4), pool=pool)
    assert values(shared) == values(alone)
    np.testing.assert_array_equal([e.cost for e in shared.evaluations], [e.cost for e in alone.evaluations])


def test_a_hopeless_start_is_given_up_and_listed(case, monkeypatch):
    """A valley with no way out: the second start cannot improve."""
    solve = SweptChannel.solve

    def stuck(self, parameters, names, limit):
        found = solve(self, parameters, names, limit)
        # Where C20 is positive the force has no part that the parameters change.
        return (
            found
            if parameters["C20"] < 0
            else type(found)(found.displacement, 0 * found.force, 0 * found.slope)
        )

    monkeypatch.setattr(SweptChannel, "solve", stuck)
    monkeypatch.setattr(starts, "is_outperformed", lambda costs, reference: costs[0] > 9 * reference)
    monkeypatch.setattr(starts, "screen_starts", lambda *_: [np.array([0.5, 0.02, 0.001])])
    fit = identify(Task(case, "yeoh", starts=2))
    assert "given up" in fit.end_points[-1].message
    assert fit.converged
    assert values(fit) == pytest.approx(values(identify(Task(case, "yeoh"))), rel=1e-9)


def test_a_run_with_several_starts_is_resumed_without_solving_them_again(case, tmp_path, monkeypatch):
    journal = tmp_path / "history"
    whole = identify(Task(case, "yeoh", starts=2, seed=4), journal=journal)
    assert sorted(path.name for path in tmp_path.glob("history*")) == ["history", "history-start-1"]
    files = sorted(tmp_path.glob("history*/*.npz"), key=lambda file: file.stat().st_mtime_ns)
    assert len(files) == whole.sweeps + whole.profile_sweeps
    # As if killed in the second start: its last two evaluations are lost.
    for file in [file for file in files if file.parent.name == "history-start-1"][-2:]:
        file.unlink()
    resumed = identify(Task(case, "yeoh", starts=2, seed=4), journal=journal, resume=True)
    assert values(resumed) == values(whole)
    np.testing.assert_array_equal([e.cost for e in resumed.evaluations], [e.cost for e in whole.evaluations])
    assert all(file.exists() for file in files)


def test_an_interrupted_start_leaves_the_best_so_far(case):
    def interrupt(found):
        if found.start == 1:
            raise KeyboardInterrupt

    fit = identify(Task(case, "yeoh", starts=2, seed=4), progress=interrupt)
    assert not fit.converged
    assert fit.conditions[0].name == "interrupted"
    assert values(fit) == pytest.approx(values(identify(Task(case, "yeoh"))), rel=1e-6)
