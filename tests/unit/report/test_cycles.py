"""Cycles and holds in JSON, tables, pictures and pages; loops that no simulation explains."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from bushcli import report
from bushcli.curve.curve import Curve
from bushcli.recording import Recording, read_recording
from bushcli.recording.source import Source
from bushcli.report.cycles import unexplained_hysteresis
from bushcli.report.drawing.preparation import prepare
from bushcli.report.plots.cycles import cycle_panels, history_panels
from bushcli.report.views.cycles import cycle_table, history_section, hold_table
from bushcli.report.writers.files import write
from bushcli.report.writers.terminal import terminal_text

DATA = Path(__file__).parents[1] / "data"


def elastic(q):
    """Force (N) at a displacement (mm): nearly the axial law of the viscoelastic recording, without memory."""
    return 260.0 * q


@pytest.fixture(scope="module")
def measured():
    return replace(read_recording(Source("axial", DATA / "viscoelastic.csv")), name="axial")


@pytest.fixture
def simulated(channel, answer):
    """Make a response with one channel, a straight line beside a recording."""

    def make(recording, reach=(-6.5, 6.5), mode="axial", **changes):
        q = np.linspace(*reach, 41)
        found = channel(mode, curve=Curve(mode, q, elastic(q)), recording=recording, surface=None, **changes)
        return answer(found)

    return make


def cyclic(loss, sigma=2.0, mode="axial", factor=1.0):
    """Two cycles of 4 mm to both sides with a loop of `loss` (N) around a line, and noise."""
    phase = np.linspace(0.0, 4 * np.pi, 401)
    noise = sigma * np.random.default_rng(0).standard_normal(401)
    q = 4.0 * np.sin(phase)
    return Recording(mode, factor * q, elastic(q) + loss * np.cos(phase) + noise, phase, name=mode)


def test_json_has_recorded_and_simulated_values_side_by_side(simulated, measured):
    found = simulated(measured)
    result = json.loads(json.dumps(report.as_json(found), allow_nan=False))
    (entry,) = result["load_cases"]
    assert entry["units"]["energy"] == "N mm"
    assert [cycle["number"] for cycle in entry["cycles"]] == list(range(1, 9))
    seventh = entry["cycles"][6]
    assert seventh["closed"]
    assert seventh["displacement"] == pytest.approx([-5.0, 6.0], abs=0.02)
    assert seventh["rate"] == pytest.approx(0.15, rel=0.01)
    assert seventh["recorded"]["energy"] > 50 * seventh["recorded"]["energy_std"] > 0
    assert seventh["simulated"]["energy"] == pytest.approx(0.0, abs=1e-6)
    assert seventh["simulated"]["secant_stiffness"] == pytest.approx(260.0)
    held, released = entry["holds"]
    assert held["recorded"].keys() >= {"force_start", "force_end", "relaxation_percent"}
    assert held["recorded"]["relaxation_percent_after"].keys() == {"1", "10"}
    assert held["simulated"]["relaxation_percent"] == pytest.approx(0.0, abs=0.1)
    # At zero displacement the simulated force is zero, so that its relaxation is undefined.
    assert released["simulated"]["relaxation_percent"] is None


def test_one_way_has_neither_cycles_nor_holds(answer, channel):
    found = answer(channel("axial", 130.0, 100.0))
    (entry,) = report.as_json(found)["load_cases"]
    assert "cycles" not in entry


def test_cycles_that_the_simulation_did_not_reach_are_null(simulated, measured):
    found = simulated(measured, reach=(-2.5, 2.5), stopped="DIVERGED_MAX_IT")
    (history,) = found.histories
    assert [s is not None for _, _, s in history.cycles] == [True] * 3 + [False] * 5
    assert [s is not None for _, _, s in history.holds] == [False, True]
    assert all(recorded is not None for _, recorded, _ in history.cycles)


def test_a_program_alone_has_simulated_cycles(answer, channel):
    q = np.concatenate([np.linspace(0, 4, 9), np.linspace(3.5, 0, 8)])
    found = answer(channel("axial", curve=Curve("axial", q, elastic(q)), surface=None))
    (history,) = found.histories
    assert not history.has_recording
    assert cycle_table(history).heads == ("cycle", "mm", "energy, N mm", "loss, %", "secant, N/mm", "peak, N")
    assert cycle_table(history).rows[0][:2] == ("1", "0 to 4")


def test_the_rounding_of_a_solver_is_no_loop(answer, channel):
    """A law without memory, solved to some 1e-8: no energy, one secant stiffness, and no factor of 1e-6 on an axis."""
    q = np.concatenate([np.linspace(0, 4, 9), np.linspace(3.5, 0, 8), np.linspace(0.5, 4, 8)])
    q = np.concatenate([q, np.linspace(3.5, 0, 8)])
    for size, lossless in ((1e-8, True), (1e-3, False)):
        force = elastic(q) * (1.0 + size * np.sin(7.0 * np.arange(len(q))))
        found = answer(channel("axial", curve=Curve("axial", q, force), surface=None))
        (history,) = found.histories
        assert [one.energy.value == 0.0 for _, _, one in history.cycles] == [lossless, lossless]
        energy, secant = (prepare(plot) for plot in cycle_panels(history, "axial").rows[1])
        assert (np.ptp(energy.y) == 2.0) == lossless
        assert (np.ptp(secant.y) > 20.0) == lossless


def test_rotations_are_in_degrees(answer, channel):
    """A loop of b N mm at an amplitude of a rad takes pi a b N mm per cycle, in whatever unit the angle is shown."""
    recording = cyclic(30.0, 0.0, "torsional", factor=0.1)
    q = np.linspace(-0.5, 0.5, 21)
    found = answer(channel("torsional", curve=Curve("torsional", q, 2600.0 * q), recording=recording))
    (entry,) = report.as_json(found)["load_cases"]
    first, _ = entry["cycles"]
    assert first["displacement"][1] == pytest.approx(np.degrees(0.4), rel=1e-3)
    assert first["simulated"]["secant_stiffness"] == pytest.approx(np.radians(2600.0))
    assert first["recorded"]["energy"] == pytest.approx(np.pi * 0.4 * 30.0, rel=1e-3)
    assert entry["units"]["energy"] == "N mm"


@pytest.mark.parametrize("loss", [0.0, 30.0])
def test_loops_without_an_explanation_are_a_problem(simulated, loss):
    found = simulated(cyclic(loss))
    names = [problem["name"] for problem in report.as_json(found)["problems"]]
    assert names == ["unexplained_hysteresis"] * (loss > 0)


def test_loops_that_are_simulated_are_explained(simulated):
    (history,) = simulated(cyclic(30.0)).histories
    assert unexplained_hysteresis(history)
    assert not unexplained_hysteresis(replace(history, cycles=tuple((r, r, r) for r, _, _ in history.cycles)))


@pytest.mark.parametrize("name", ["mullins", "viscoelastic", "mullins-viscoelastic"])
def test_recordings_with_an_effect_are_not_explained_by_a_law(simulated, name):
    found = simulated(replace(read_recording(Source("axial", DATA / f"{name}.csv")), name="axial"))
    (condition,) = found.conditions
    assert ("relaxes" in condition.message) == (name != "mullins")


def test_tables_have_as_many_cells_as_heads_and_mark_open_cycles(simulated, measured):
    (history,) = simulated(measured).histories
    for table in (cycle_table(history), cycle_table(history).without_detail(), hold_table(history)):
        assert {len(row) for row in table.rows} == {len(table.heads)}
    cut = replace(
        measured, displacement=measured.displacement[:12], force=measured.force[:12], time=measured.time[:12]
    )
    (history,) = simulated(cut).histories
    assert [row[0] for row in cycle_table(history).rows] == ["1 open"]


def test_a_long_recording_keeps_its_ends_at_the_terminal(simulated):
    phase = np.linspace(0.0, 40 * np.pi, 2001)
    recording = Recording("axial", 4 * np.sin(phase), elastic(4 * np.sin(phase)), phase, name="axial")
    (history,) = simulated(recording).histories
    whole = history_section([history]).blocks[0]
    brief = whole.without_middle(whole.most)
    assert len(whole.rows) == 20
    assert "20 in all" in brief.title
    numbers = [row[0] for row in brief.rows]
    assert numbers == ["1", "2", "3", "4", "5", "6", "7", "8", "...", "18", "19", "20"]


def test_the_terminal_shows_cycles_and_holds(simulated, measured):
    found, stream = simulated(measured), io.StringIO()
    Console(width=120, no_color=True, file=stream).print(terminal_text(report.as_document(found)))
    text = stream.getvalue()
    assert "axial: cycles, recorded" in text
    assert "axial: force lost in holds" in text
    assert "problem unexplained_hysteresis" in text


def test_pictures_say_in_their_title_what_is_seen(simulated, measured):
    loops, held = history_panels(simulated(measured).histories, {"axial": "axial"})
    assert (loops.name, held.name) == ("axial-cycles", "axial-holds")
    assert loops.title.startswith("Axial: loops dissipate 24")
    assert loops.title.endswith(", 0 N mm simulated")
    assert held.title == "Axial: the held force relaxes by 16 % recorded, 0 % simulated"


def test_files_and_page_hold_the_section(simulated, measured, tmp_path):
    found = simulated(measured)
    result = report.as_json(found)
    files = report.as_files(found)
    written = write(tmp_path / "out", result, files, lambda: report.as_document(found))
    assert {"axial-cycles.png", "axial-cycles.svg", "axial-holds.png"} <= {path.name for path in written}
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<h2>Cycles and holds</h2>" in page
    assert "unexplained_hysteresis" in page
