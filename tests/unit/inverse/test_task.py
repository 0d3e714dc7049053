"""The task of an identification: names, bounds, and errors that say what would be valid."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.errors import InputError
from bushcli.inverse import Task

EXAMPLE = Path(__file__).parents[3] / "examples" / "batch" / "case.toml"


@pytest.fixture(scope="module")
def case():
    return load_case(EXAMPLE)


def test_unknown_law_names_the_nearest(case):
    with pytest.raises(InputError, match='"yeho" is not a law; did you mean "yeoh"'):
        _ = Task(case, "yeho").law


def test_unknown_start_value_names_the_parameters(case):
    with pytest.raises(InputError, match=r"C11 is not a parameter of yeoh; .*C10, C20, C30"):
        Task(case, "yeoh", start={"C11": 1.0}).vectors()


def test_unknown_channel_names_the_channels(case):
    with pytest.raises(InputError, match=r'"radiel" is not a channel of this case; did you mean "radial"'):
        Task(case, "yeoh", hold_out=("radiel",)).channels()


def test_holding_out_everything_leaves_nothing(case):
    with pytest.raises(InputError, match="leaves no channel to fit"):
        Task(case, "yeoh", hold_out=("axial", "radial")).channels()


def test_a_case_without_recordings(case):
    with pytest.raises(InputError, match=r"no \[\[recordings\]\]"):
        Task(replace(case, recordings=()), "yeoh").channels()


def test_a_case_without_coupons(case):
    with pytest.raises(InputError, match=r"no \[\[coupons\]\]"):
        Task(replace(case, coupons=()), "yeoh", "coupons").channels()


def test_names_and_vectors_leave_out_what_is_fixed(case):
    task = Task(case, "yeoh", start={"C10": 0.3}, fixed=("C20",), bulk_modulus=True)
    assert task.names == ("C10", "C30", "compliance")
    start, bounds = task.vectors()
    assert start == pytest.approx([0.3, task.law.parameter("C30").start, 1 / 2000.0])
    assert (bounds.lower <= start).all()
    assert (start <= bounds.upper).all()


def test_channels_that_are_held_out_are_apart(case):
    fitted, held_out = Task(case, "yeoh", hold_out=("radial",)).channels(coarse=True)
    assert [channel.name for channel in fitted] == ["axial"]
    assert [channel.name for channel in held_out] == ["radial"]


def test_identity_tells_runs_apart_that_differ_in_what_they_find(case):
    base = Task(case, "yeoh").identity()
    assert base == Task(case, "yeoh", workers=2).identity()
    for other in ({"fixed": ("C30",)}, {"hold_out": ("radial",)}, {"seed": 1}, {"start": {"C10": 1.0}}):
        assert Task(case, "yeoh", **other).identity() != base


def test_a_recording_of_a_coupon_is_weighted_by_its_noise_and_a_material_test_by_its_stress(case, tmp_path):
    """A loop passes zero stress: with weights relative to it, three branches left more misfit than two."""
    strain = np.concatenate([np.linspace(0.0, 0.5, 30), np.linspace(0.5, 0.0, 30)[1:]])
    rows = np.column_stack([10.0 * np.arange(len(strain)), strain, 0.8 * strain])
    np.savetxt(
        tmp_path / "u.csv", rows, delimiter=",", header="time_s,strain,nominal_stress_MPa", comments=""
    )
    file = tmp_path / "case.toml"
    text = '[geometry]\nshape = "coupon"\n[material]\nlaw = "yeoh"\n'
    file.write_text(text + '[[recordings]]\nmode = "uniaxial"\nfile = "u.csv"\n')
    (channel,), _ = Task(load_case(file), "yeoh").channels()
    assert np.ptp(channel.scale) == 0.0
    assert channel.scale[0] < 0.01 * channel.measured.max()
    (test, *_), _ = Task(case, "yeoh", "coupons").channels()
    used = np.isfinite(test.scale) & (np.abs(test.measured) > 0.05 * np.abs(test.measured).max())
    assert test.scale[used] == pytest.approx(np.abs(test.measured[used]))
