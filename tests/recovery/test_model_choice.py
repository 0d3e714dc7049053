"""All laws on the same recordings, one channel held out: the true law comes first."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from bushcli.cli import main
from forms.law import laws

MESH = "[mesh]\nelements_across = 2\nelements_along = 4\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    "models",
    # Ogden's six parameters on one curve would take longer than all other laws together.
    ["neo_hookean,gent,yeoh", "all"],
)
def test_laws_are_ranked_by_the_channel_held_out(experiment, models):
    case = experiment("axial", "torsional", noise=0.3, extra=MESH)
    arguments = ["inverse", str(case.path), "--model", models, "--hold-out", "torsional", "--json", "-q"]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    result = json.loads(done.output)
    ranked = result["models"]
    assert {model["law"] for model in ranked} == set(laws() if models == "all" else models.split(","))
    assert result["law"] == ranked[0]["law"]
    # Ranked by the prediction of the channel that no fit has used.
    held_out = [
        model["held_out"]["torsional"] for model in ranked if model["converged"] and model["held_out"]
    ]
    assert held_out == sorted(held_out)
    rms = {model["law"]: (model["misfit"]["axial"], model["held_out"]["torsional"]) for model in ranked}
    # The recordings are of a Yeoh law, which softens by 8 % before it stiffens: a law that cannot soften misses both.
    assert rms["yeoh"][0] < 0.5
    assert rms["yeoh"][1] < 0.8
    assert rms["neo_hookean"][0] > 2 * rms["yeoh"][0]
    assert rms["neo_hookean"][1] > 2 * rms["yeoh"][1]
    assert rms["gent"][0] > 2 * rms["yeoh"][0]
