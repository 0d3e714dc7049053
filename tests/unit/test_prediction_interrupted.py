"""An interrupted prediction is the channels so far, of the last one the part simulated."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from bushcli.case import load_case
from bushcli.cli import main
from bushcli.simulate.predict import predict
from bushcli.simulate.response import PredictionInterrupted

CASE = """[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "neo_hookean"
parameters = { C10 = 0.5 }
[[load_cases]]
mode = "axial"
amplitude = 3.0
[[load_cases]]
mode = "torsional"
amplitude = 10.0
"""


@pytest.fixture
def case(tmp_path: Path) -> Path:
    (tmp_path / "case.toml").write_text(CASE)
    return tmp_path / "case.toml"


def stop_at(name: str, number: int):
    def stop(channel: str, step: int, *_: object) -> None:
        if (channel, step) == (name, number):
            raise KeyboardInterrupt

    return stop


def test_the_channel_that_was_running_ends_where_it_was(case):
    with pytest.raises(PredictionInterrupted) as raised:
        predict(load_case(case), progress=stop_at("torsional", 4))
    axial, torsional = raised.value.response.channels
    whole = predict(load_case(case))
    assert axial.stopped == ""
    assert torsional.stopped == "INTERRUPTED"
    assert list(torsional.curve.force) == pytest.approx(list(whole.channels[1].curve.force[:4]), rel=1e-6)
    assert [one.name for one in raised.value.response.conditions] == ["interrupted"]


def test_before_the_first_step_there_is_no_result(case):
    with pytest.raises(KeyboardInterrupt) as raised:
        predict(load_case(case), progress=stop_at("axial", 1))
    assert not isinstance(raised.value, PredictionInterrupted)


@pytest.mark.slow
def test_direct_writes_what_there_is_and_exits_with_130(case, monkeypatch):
    def interrupted(given, material, **keys):
        keys["progress"] = stop_at("torsional", 4)
        return predict(given, material, **keys)

    monkeypatch.setattr("bushcli.simulate.predict.predict", interrupted)
    done = CliRunner().invoke(main, ["direct", str(case), "-o", str(case.parent / "out")])
    assert done.exit_code == 130
    assert "torsional: interrupted at" in done.output
    result = json.loads((case.parent / "out" / "result.json").read_text())
    assert [one["complete"] for one in result["load_cases"]] == [True, False]
