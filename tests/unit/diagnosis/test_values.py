"""How the effects of the most probable model are named."""

from types import SimpleNamespace

import pytest

from bushcli.diagnosis.result import Quantity
from bushcli.diagnosis.values import _title_and_summary
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects


@pytest.mark.parametrize(
    ("error", "mode", "said"),
    [
        (
            0.009,
            "axial",
            "A constant factor of +0.9 % between simulation and recording, within the error of the mesh",
        ),
        (
            -0.004,
            "uniaxial",
            "A constant factor of -0.4 % between simulation and recording, within the error of a load",
        ),
        (0.04, "axial", "The force of one channel reads high or low by a factor."),
    ],
)
def test_a_gain_that_the_mesh_may_have_made_blames_no_load_cell(error, mode, said):
    recordings = [SimpleNamespace(name="other", mode="radial"), SimpleNamespace(name="own", mode=mode)]
    search = SimpleNamespace(problem=SimpleNamespace(recordings=recordings))
    gain = ActiveEffect(effects()["gain"], {"error": error}, ("own",))
    value = Quantity(error, 0.001, "1", "relative error of the force", error - 0.002, error + 0.002)
    title, summary = _title_and_summary(gain, {"error": value}, search)
    assert summary.startswith(said)
    assert ("Gain error" in title) == (abs(error) > 0.01)
