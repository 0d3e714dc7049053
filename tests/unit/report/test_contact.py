"""What reports say of contact."""

from dataclasses import replace

import numpy as np
import pytest

from bushcli.report.conditions import conditions
from bushcli.report.json.direct import direct_json
from bushcli.report.results import DirectResult
from bushcli.report.views.direct import contact_table
from bushcli.simulate.contact import SurfaceContact

WALLS = SurfaceContact(("end_top", "free"), 0.1, 66.3, 0.2, 17.1, -5.4)


def test_what_met_is_in_the_units_of_the_mode(answer, channel):
    met = answer(replace(channel("torsional", 100.0), touched=(WALLS,)))
    (found,) = direct_json(DirectResult(met.response, {}))["load_cases"][0]["contact"]
    assert found["surfaces"] == ["end_top", "free"]
    assert (found["first"], found["at"]) == pytest.approx(np.degrees([0.1, 0.2]))
    assert (found["largest_force"], found["radius"], found["height"]) == (66.3, 17.1, -5.4)


def test_a_table_has_a_row_for_each_pair_and_none_without(answer, channel):
    alone = replace(WALLS, surfaces=("free", "free"))
    met = replace(channel("axial", 100.0), touched=(WALLS, alone))
    table = contact_table(answer(met, channel("radial", 100.0)).response)
    assert [row[:2] for row in table.rows] == [("axial", "end top and free"), ("axial", "free with itself")]
    assert "66.3 N" in table.rows[0]
    assert not contact_table(answer(channel("axial", 100.0)).response).rows


@pytest.mark.parametrize(
    ("contact", "words"),
    [(True, "active from the step in which"), ("sleeves", "beyond their bonds"), (False, "not modelled")],
)
def test_a_case_says_what_can_meet(answer, channel, contact, words):
    case = answer(channel("axial", 100.0)).response.case
    known = dict(conditions(replace(case, geometry=case.geometry.model_copy(update={"contact": contact}))))
    assert words in known["contact"]
