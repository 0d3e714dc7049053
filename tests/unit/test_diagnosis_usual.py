"""Typical values of what belongs to a channel go by what is recorded there."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.active import ActiveEffect
from bushcli.diagnosis.model import Model, _within
from bushcli.diagnosis.plausible import plausibility
from bushcli.diagnosis.usual import admitted, usual_size, usual_value
from bushcli.effect import effects
from bushcli.recording import Recording


def recording(mode, displacement, force):
    share = np.linspace(-0.5, 1.0, 30)
    return Recording(mode=mode, displacement=displacement * share, force=force * share)


AXIAL, RADIAL = recording("axial", 5.0, 1500.0), recording("radial", 0.8, 24000.0)


def usual(name, parameter, *recordings):
    effect = effects()[name]
    return usual_value(effect, effect.parameter(parameter), recordings)


def test_a_stop_is_as_stiff_as_the_channel_is():
    assert usual("bump_stop", "stiffness", AXIAL) == pytest.approx(0.3 * 1500.0 / 5.0)
    assert usual("bump_stop", "stiffness", RADIAL) == pytest.approx(0.3 * 24000.0 / 0.8)
    assert usual("bump_stop", "gap", RADIAL) == pytest.approx(0.7 * 0.8)


def test_of_several_channels_the_largest_counts():
    assert usual("offset", "force", AXIAL, RADIAL) == usual("offset", "force", RADIAL)
    assert usual("offset", "displacement", AXIAL, RADIAL) == usual("offset", "displacement", AXIAL)


def test_what_is_of_the_rubber_or_the_bushing_does_not_go_by_the_recording():
    for name in ("mullins", "rig_compliance", "cure_shrinkage", "misalignment"):
        for parameter in effects()[name].parameters:
            assert usual(name, parameter.name, RADIAL) == parameter.start
    effect = effects()["batch_stiffness"]
    assert usual_size(effect, effect.amplitudes[0], [AXIAL]) == abs(effect.amplitudes[0].start)


def test_every_parameter_of_a_channel_that_tells_its_unit_has_a_share():
    """Else its typical value would be one for all channels, in N or N mm alike."""
    for effect in effects().values():
        for parameter in effect.parameters:
            # What has no unit in common with displacement, force or stiffness has one typical value everywhere.
            if parameter.of_channel and parameter.unit in ("mm", "N", "N/mm"):
                assert parameter.share > 0.0, f"{effect.name}.{parameter.name}"
                assert usual_value(effect, parameter, [AXIAL]) > 0.0
            else:
                assert parameter.share == 0.0


def test_a_stop_as_stiff_as_a_bushing_across_is_plausible_there_only():
    stop = ActiveEffect(effects()["bump_stop"], {"stiffness": 30000.0, "gap": 0.5})
    assert plausibility(stop, [RADIAL])[0]
    fine, remark = plausibility(stop, [AXIAL])
    assert not fine
    assert "more than 20 times what is usual (90 N/mm)" in remark
    # What is hardly known may be usual.
    uncertain, why = plausibility(stop, [AXIAL], {"stiffness": stop.values["stiffness"]})
    assert uncertain
    assert why == f"{remark}, but so uncertain that it may be usual"
    assert not plausibility(stop, [AXIAL], {"stiffness": 0.1 * stop.values["stiffness"]})[0]


def test_a_lag_goes_by_the_time_between_samples():
    effect = effects()["time_lag"]
    (lag,) = effect.parameters

    def sampled(interval):
        q = np.linspace(0.0, 1.0, 9)
        return Recording("axial", q, q, np.arange(9) * interval, name="axial")

    assert usual_value(effect, lag, [sampled(0.01)]) == 0.05
    assert usual_value(effect, lag, [sampled(0.01), sampled(2.0)]) == 2.0
    untimed = Recording("axial", np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 9), name="axial")
    assert usual_value(effect, lag, [untimed]) == 0.05
    slow = ActiveEffect(effect, {"lag": 6.0})
    assert plausibility(slow, [sampled(0.5)])[0]
    assert not plausibility(slow, [sampled(0.01)])[0]


def test_a_remark_is_in_the_units_of_the_case_file():
    # 1 degree where a hundredth of the largest rotation is usual.
    turned = Recording("torsional", np.linspace(0.0, 0.02, 9), np.linspace(0.0, 90.0, 9), name="torsional")
    loose = ActiveEffect(effects()["offset"], {"displacement": np.pi / 180, "force": 0.0})
    plausible, remark = plausibility(loose, [turned])
    assert not plausible
    assert remark.startswith("displacement = 1 degrees is more than 20 times what is usual (0.0")
    softening = ActiveEffect(effects()["mullins"], {"inverse_r": 0.3, "m": 0.1, "beta": 1.0})
    assert plausibility(softening, [turned]) == (False, "beta = 1 lies at its bound")


def test_an_offset_of_half_the_range_is_none():
    loose = effects()["offset"]
    force, displacement = loose.parameters
    assert admitted(loose, displacement, [AXIAL]) == (-1.0, 1.0)
    assert admitted(loose, force, [AXIAL]) == (-300.0, 300.0)
    # What has no such limit keeps its bounds.
    stop = effects()["bump_stop"].parameter("stiffness")
    assert admitted(effects()["bump_stop"], stop, [AXIAL]) == (stop.lower, stop.upper)
    assert admitted(loose, force, []) == (force.lower, force.upper)


def test_a_fit_keeps_an_offset_within_its_limits():
    channels = [SimpleNamespace(recording=replace(one, name=one.mode)) for one in (AXIAL, RADIAL)]
    loose = ActiveEffect(effects()["offset"], {"force": 900.0, "displacement": -0.5}, ("axial",))
    problem = SimpleNamespace(channels=channels, names=("C10", "offset.force", "offset.displacement"))
    start, lower, upper = _within(
        Model("yeoh", {"C10": 0.5}, effects=(loose,)),
        problem,
        np.array([0.5, 900.0, -0.5]),
        np.array([0.0, -1e7, -100.0]),
        np.array([9.0, 1e7, 100.0]),
    )
    # Those of the axial rig, which has it: 1500 N and 5 mm are recorded there.
    assert start.tolist() == [0.5, 300.0, -0.5]
    assert lower.tolist() == [0.0, -300.0, -1.0]
    assert upper.tolist() == [9.0, 300.0, 1.0]
