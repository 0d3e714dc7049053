"""Faults of the data: each kind is found where it was introduced, and sound data have none."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from bushcli.case import Case, Material, MeshOptions, load_case
from bushcli.curve.recording import ReadColumn
from bushcli.errors import InputError, RecordingError
from bushcli.faults import bad_samples, condition, find_faults, masks
from bushcli.faults.fault import chance_in_words
from bushcli.faults.scale import unit_stiffness
from bushcli.recording import Recording, read_recording
from bushcli.recording.source import Quantity, Source
from bushcli.simulate.admissible import check_travel
from geometry.shape import shapes

ROOT = Path(__file__).parents[2]
PRACTICE = ROOT.parent / "shared" / "recordings" / "practice"
if not PRACTICE.is_dir():  # a git worktree is one folder deeper
    PRACTICE = ROOT.parents[1] / "shared" / "recordings" / "practice"
FILES = {"axial": "axial", "radial": "radial", "torsional": "torsion", "conical": "conical"}
# Stiffness at rest of the bushing below, mu = 1 MPa: N/mm and N mm/rad. Axial and torsional from the closed forms,
# radial and conical from the finite elements of the practice recordings p07.
STIFFNESS = {"axial": 290.0, "radial": 1980.0, "torsional": 46e3, "conical": 133e3}
UNITS = {"axial": ("mm", "N"), "radial": ("mm", "N"), "torsional": ("deg", "Nmm"), "conical": ("deg", "Nmm")}
AMPLITUDE = {"axial": 6.0, "radial": 2.0, "torsional": math.radians(15.0), "conical": math.radians(4.0)}


def bushing(**changes) -> Case:
    dimensions = {"inner_radius": 9.0, "outer_radius": 18.0, "length": 34.0} | changes
    shape = shapes()["plain"](**dimensions)
    return Case("bushing", Path("case.toml"), shape, MeshOptions(), Material("yeoh", 2000.0, {}))


def autoregressive(rng, n: int, correlation: float):
    noise = rng.normal(size=n)
    for i in range(1, n):
        noise[i] = correlation * noise[i - 1] + math.sqrt(1 - correlation**2) * noise[i]
    return noise


def recorded(mode: str = "axial", n: int = 400, seed: int = 0, correlation: float = 0.0) -> Recording:
    """Three cycles with a noise of 0.3 % of the largest force, logged to 1e-5 of it."""
    rng = np.random.default_rng(seed)
    reach, stiffness = AMPLITUDE[mode], STIFFNESS[mode]
    time = np.linspace(0.0, 300.0, n)
    q = reach * np.interp(time, np.linspace(0, 300, 7), [0, 0.6, 0, -0.6, 0, 1, 0])
    force = stiffness * q * (1 + 0.2 * (q / reach) ** 2)
    peak = float(force.max())
    force = force + 3e-3 * peak * autoregressive(rng, n, correlation)
    q = q + 5e-4 * reach * rng.normal(size=n)
    return Recording(mode, q, np.round(force / peak, 5) * peak, time, name=mode, units=UNITS[mode])


def changed(recording: Recording, displacement=1.0, force=1.0) -> Recording:
    return replace(
        recording, displacement=displacement * recording.displacement, force=force * recording.force
    )


def kinds(faults) -> list[tuple[str, str, bool]]:
    return [(fault.channel, fault.kind, fault.fatal) for fault in faults]


# -- faults of whole channels ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", STIFFNESS)
def test_a_force_of_the_other_sign(mode):
    faults = find_faults(bushing(), [changed(recorded(mode), force=-1.0)])
    assert kinds(faults) == [(mode, "sign", True)]
    assert 'reverse = ["force"]' in faults[0].remedy
    assert not masks(faults, recorded(mode)).any()


def test_a_force_of_the_other_sign_in_another_unit_has_both_faults():
    """The user corrects both at once."""
    one = recorded()
    found = find_faults(bushing(), [replace(one, force=-1e-3 * one.force)])
    assert sorted(fault.kind for fault in found) == ["sign", "unit"]
    assert any('force = "kN"' in fault.remedy for fault in found)


@pytest.mark.parametrize("correlation", [0.0, 0.3])
def test_a_force_that_is_noise_has_no_signal(correlation):
    """A load cell that is not connected: no unit makes noise a force."""
    one = recorded()
    noise = 5.0 * autoregressive(np.random.default_rng(4), len(one.force), correlation)
    (fault,) = find_faults(bushing(), [replace(one, force=noise)])
    assert (fault.kind, fault.fatal) == ("no_signal", True)
    assert "connected" in fault.remedy


def test_a_faint_force_in_noise_has_a_signal():
    """Noise with a third of the variance of the signal does not hide it."""
    one = recorded()
    noise = np.sqrt(np.var(one.force) / 3.0) * np.random.default_rng(5).normal(size=len(one.force))
    assert "no_signal" not in [
        fault.kind for fault in find_faults(bushing(), [replace(one, force=one.force + noise)])
    ]


def test_a_force_without_its_sign_is_a_magnitude():
    one = recorded()
    found = find_faults(bushing(), [replace(one, force=np.abs(one.force))])
    # Not a wrong unit: the modulus of a magnitude is none.
    assert [(fault.kind, fault.fatal) for fault in found] == [("sign", True)]
    assert "magnitude" in found[0].where


def test_a_preload_that_keeps_the_force_positive_is_no_magnitude():
    one = recorded()
    assert find_faults(bushing(), [replace(one, force=one.force + 1.2 * abs(one.force.min()))]) == ()


def test_a_table_of_peaks_and_valleys_is_no_recording():
    cycles = np.tile([3.0, -2.5], 20)
    (fault,) = find_faults(bushing(), [Recording("axial", cycles, 290.0 * cycles, None, name="axial")])
    assert (fault.kind, fault.fatal) == ("extremes", True)
    assert "the motion reverses at each sample" in fault.where


@pytest.mark.parametrize("samples", [6, 20])
def test_few_samples_of_each_cycle_are_no_table_of_peaks(samples):
    """Six samples of a cycle are few, and they are samples; white noise of a rig that holds still reverses often."""
    time = np.arange(10 * samples) / samples
    travel = 3.0 * np.sin(2 * np.pi * time)
    held = np.r_[travel, 1e-3 * np.random.default_rng(5).standard_normal(200)]
    for one in (travel, held):
        found = find_faults(bushing(), [Recording("axial", one, 290.0 * one, None, name="axial")])
        assert not [fault for fault in found if fault.kind == "extremes"]


def test_a_position_of_the_rig_is_no_displacement():
    one = recorded()
    found = find_faults(bushing(), [replace(one, displacement=one.displacement + 87.0)])
    assert [(fault.kind, fault.fatal) for fault in found] == [("position", True)]
    # A bushing under a static load of two thirds of its thickness, 9 mm.
    assert (
        find_faults(bushing(), [replace(one, displacement=one.displacement + 6.0, force=one.force + 1740.0)])
        == ()
    )


@pytest.mark.parametrize("mode", STIFFNESS)
@pytest.mark.parametrize("change", [(1e-3, 1.0), (1e3, 1.0), (1.0, 1e-3), (1.0, 1e3)])
def test_units_a_thousand_off_beside_other_channels(mode, change):
    channels = [recorded(m) for m in STIFFNESS if m != mode]
    faults = find_faults(bushing(), [*channels, changed(recorded(mode), *change)])
    assert kinds(faults) == [(mode, "unit", True)]


@pytest.mark.parametrize("mode", STIFFNESS)
@pytest.mark.parametrize("change", [(1e-3, 1.0), (1e3, 1.0), (1.0, 1e-3), (1.0, 1e3)])
def test_units_a_thousand_off_alone(mode, change):
    """The rubber's thickness contradicts a travel, and its strength a stress; nothing contradicts a gel."""
    (fault,) = find_faults(bushing(), [changed(recorded(mode), *change)])
    assert fault.kind == "unit"
    assert fault.fatal == (fault.probability == 1.0)
    lengths = mode in ("axial", "radial")
    certain = {(1e-3, 1.0): lengths, (1e3, 1.0): True, (1.0, 1e-3): False, (1.0, 1e3): mode != "conical"}
    assert fault.fatal == certain[change]
    assert fault.fatal or f"wrongly is {chance_in_words(fault.probability)}" in fault.where


@pytest.mark.parametrize("softer", [1000.0, 1e5, 1e7, 1e12])
def test_a_specimen_however_soft_is_no_contradiction(softer):
    """The softest gels have a modulus of pascals; a coupon of the same rubber contradicts the bushing."""
    soft = changed(recorded(), force=1.0 / softer)
    (fault,) = find_faults(bushing(), [soft])
    assert (fault.fatal, condition(fault).name) == (False, "doubtful_data")
    (fault,) = find_faults(bushing(), [soft, held(0.8)])
    assert (fault.channel, fault.fatal, condition(fault).name) == ("axial", True, "faulty_data")


def test_channels_of_one_rubber_that_contradict_each_other_in_every_unit_are_a_fault():
    """Stiffness 60 times too low: no unit is so far off."""
    (fault,) = find_faults(bushing(), [changed(recorded(), force=1.0 / 60.0), held(0.8)])
    assert kinds([fault]) == [("axial", "unit", True)]
    assert "no single wrong unit explains it" in fault.where


@pytest.mark.parametrize(
    ("mode", "change", "remedy"),
    [
        ("axial", (1.0, 1e-3), 'units = { force = "kN" }'),
        ("axial", (1e-3, 1.0), 'units = { displacement = "m" }'),
        ("axial", (1e-3, 1e-3), 'units = { displacement = "m", force = "kN" }'),
        ("torsional", (1.0, 1e-3), 'units = { force = "Nm" }'),
        ("torsional", (math.pi / 180, 1.0), 'units = { displacement = "rad" }'),
        (
            "torsional",
            (1e3, 1.0),
            "if the rotation is a thousand times too large: divide its column by 1000",
        ),
    ],
)
def test_the_remedy_names_the_key_that_mends_the_unit(mode, change, remedy):
    (fault,) = find_faults(bushing(), [changed(recorded(mode), *change)])
    assert remedy in fault.remedy


def test_degrees_that_were_taken_for_radians():
    wrong = replace(changed(recorded("torsional"), 180 / math.pi), units=("rad", "Nmm"))
    (fault,) = find_faults(bushing(), [recorded("axial"), wrong])
    assert 'units = { displacement = "deg" }' in fault.remedy


@pytest.mark.parametrize("pair", [("axial", "radial"), ("torsional", "conical")])
def test_two_channels_that_are_exchanged(pair):
    one, other = pair
    first = replace(recorded(other), mode=one, name=one)
    second = replace(recorded(one), mode=other, name=other)
    faults = find_faults(bushing(), [first, second])
    assert set(kinds(faults)) == {(one, "swapped", True), (other, "swapped", True)}


@pytest.mark.parametrize(
    ("size", "coupon", "fatal"), [(1.0, False, True), (0.05, False, False), (0.05, True, True)]
)
def test_columns_that_are_exchanged(size, coupon, fatal):
    """A force read as a travel is one through the rubber, or at least beside a coupon that of no rubber."""
    one = changed(recorded(), size, size)
    wrong = replace(one, displacement=one.force, force=one.displacement)
    (fault,) = find_faults(bushing(), [wrong, *([held(0.8)] if coupon else [])])
    assert kinds([fault]) == [("axial", "swapped", fatal)]
    assert "columns = {" in fault.remedy


@pytest.mark.parametrize(("modulus", "unit"), [(800.0, "kPa"), (3e4, "Pa")])
def test_stress_of_a_rubber_or_a_soft_acrylic_in_another_unit(modulus, unit):
    stretch = np.linspace(1.0, 2.0, 50)
    stress = modulus * (stretch - stretch**-2)
    coupon = Recording("uniaxial", stretch - 1, stress, name="uniaxial", units=("stretch", "MPa"))
    (fault,) = find_faults(bushing(), [coupon])
    assert (fault.kind, fault.fatal) == ("unit", True)
    remedy = f'if the stress is in {unit}: units = {{ force = "{unit}" }}; or accept = ["unit"] if the values are right'
    assert fault.remedy == remedy


def held(modulus: float) -> Recording:
    """Return a ramp to a stretch of 3 in 5 s and a hold of half an hour, in which the stress falls to a third."""
    time = np.concatenate([np.linspace(0.0, 5.0, 30), np.linspace(5.0, 1800.0, 200)[1:]])
    stretch = 1.0 + 2.0 * np.minimum(time / 5.0, 1.0)
    relaxed = np.where(time < 5.0, 1.0, 0.35 + 0.65 * np.exp(-(time - 5.0) / 60.0))
    stress = modulus * (stretch - stretch**-2) * relaxed
    return Recording("uniaxial", stretch - 1, stress, time, name="hold", units=("stretch", "MPa"))


@pytest.mark.parametrize("modulus", [0.012, 0.03, 0.3, 8.0])
def test_a_relaxation_test_of_a_soft_or_hard_elastomer_is_no_fault(modulus):
    assert find_faults(bushing(), [held(modulus)]) == ()


@pytest.mark.parametrize(("sign", "found"), [(1.0, []), (-1.0, [("hold", "sign", True)])])
def test_a_hold_alone_says_nothing_of_units_and_shows_its_sign(sign, found):
    """Three hundred times too stiff a rubber, if stiffness were read from it."""
    time = np.arange(1.0, 600.0)
    stress = sign * 900.0 * (1.0 + np.exp(-time / 30.0))
    hold = Recording("uniaxial", np.full(len(time), 0.5), stress, time, name="hold", units=("stretch", "MPa"))
    assert kinds(find_faults(bushing(), [hold])) == found


def test_a_unit_that_is_probably_wrong_is_a_warning_with_its_probability():
    """Rubber of 30 MPa is rare, but it exists: nothing contradicts it."""
    (fault,) = find_faults(bushing(), [held(55.0)])
    assert (fault.kind, fault.fatal) == ("unit", False)
    assert 0.5 < fault.probability < 1.0
    assert f"{100 * fault.probability:.0f} %" in fault.where
    assert condition(fault).name == "doubtful_data"
    assert not fault.samples.any()


def unwritten(recording: Recording, *quantities: Quantity) -> Recording:
    """Return a recording whose file writes the units of other columns than these."""
    columns = [
        ReadColumn(name, i, name, unit, name in quantities)
        for i, (name, unit) in enumerate(zip(("displacement", "force"), recording.units, strict=True), 1)
    ]
    return replace(recording, columns=tuple(columns))


def test_a_unit_that_is_not_written_is_asked_for():
    """Inches, read as mm, make 25 MPa of 1 MPa: rare if mm was written, but a file without units may be in inches."""
    inches = changed(recorded(), displacement=1 / 25.4)
    assert find_faults(bushing(), [unwritten(inches)]) == ()
    (fault,) = find_faults(bushing(), [unwritten(inches, "displacement", "force")])
    assert (fault.kind, fault.fatal) == ("unit", False)
    assert 0.5 < fault.probability < 0.95
    assert "the file writes no unit of the displacement and the force" in fault.where
    # What the file says of the force counts.
    (half,) = find_faults(bushing(), [unwritten(inches, "displacement")])
    assert 0.25 < half.probability < fault.probability


@pytest.mark.parametrize("mode", ["axial", "radial", "torsional", "conical"])
@pytest.mark.parametrize("modulus", [0.03, 0.3, 1.0, 3.0, 10.0])
def test_a_unit_that_is_not_written_is_no_fault_of_rubber(mode, modulus):
    assert (
        find_faults(bushing(), [unwritten(changed(recorded(mode), force=modulus), "displacement", "force")])
        == ()
    )


def test_another_channel_of_the_rubber_makes_a_wrong_unit_certain():
    """0.015 MPa alone is a gel; beside an axial channel of 1 MPa its strain is in percent."""
    faults = find_faults(bushing(), [recorded("axial"), held(0.015)])
    assert kinds(faults) == [("hold", "unit", True)]


@pytest.mark.parametrize(
    ("spoilt", "kind"),
    [
        (changed(recorded(), force=-1.0), "sign"),
        (changed(recorded(), force=1e3), "unit"),
        (replace(recorded(), displacement=recorded().displacement + 60.0), "position"),
    ],
)
def test_a_fault_that_the_user_accepts_is_none(spoilt, kind):
    assert kinds(find_faults(bushing(), [spoilt])) == [("axial", kind, True)]
    assert find_faults(bushing(), [replace(spoilt, accepted_faults=(kind,))]) == ()


def test_accepted_spikes_are_used(tmp_path):
    rows = [f"{0.1 * i:.1f},{0.2 * i:.2f},{58.0 * i + (900 if i == 20 else 0):.1f}" for i in range(40)]
    source = written(tmp_path, rows)
    assert bad_samples(read_recording(source)).sum() == 1
    accepted = read_recording(replace(source, accepted_faults=("spikes",)))
    assert not bad_samples(accepted).any()
    assert find_faults(bushing(), [accepted]) == ()


@pytest.mark.parametrize("batch", [0.3, 0.56, 1.8, 4.0])
def test_neither_batch_nor_compliance_nor_a_stop_is_a_wrong_unit_or_an_exchange(batch):
    """Another batch changes all channels; rig compliance of half the radial stiffness, a stop ten times as stiff."""
    axial, radial = changed(recorded("axial"), force=batch), changed(recorded("radial"), force=batch)
    softer = changed(radial, 1.5)
    stopped = replace(axial, force=axial.force + 2900 * batch * np.maximum(axial.displacement - 4.0, 0.0))
    played = replace(radial, displacement=radial.displacement + 0.5 * np.sign(radial.force))
    for pair in ([axial, radial], [axial, softer], [stopped, radial], [axial, played]):
        assert find_faults(bushing(), pair) == ()


def test_closed_forms_give_the_published_numbers():
    """Adkins and Gent: 10/20 mm, 40 mm long, 0.8 MPa: 290 N/mm, 0.94 N m/degree, 674 to 4,317 N/mm."""
    shape = bushing(inner_radius=10.0, outer_radius=20.0, length=40.0).geometry
    assert 0.8 * unit_stiffness(shape, "axial")[1] == pytest.approx(290, abs=0.5)
    assert 0.8 * math.radians(unit_stiffness(shape, "torsional")[0]) == pytest.approx(940, abs=5)
    assert [0.8 * k for k in unit_stiffness(shape, "radial")] == pytest.approx([674, 4317], abs=0.5)
    assert unit_stiffness(shape, "volumetric") is None


@pytest.mark.parametrize(("unit", "size"), [("cm", 10.0), ("inches", 25.4)])
def test_a_geometry_in_another_unit(unit, size):
    """Drawn in cm the rubber would be 0.9 mm thick, and carry some 60 MPa; the strongest rubber bears 30."""
    drawn = bushing(inner_radius=9.0 / size, outer_radius=18.0 / size, length=34.0 / size)
    (fault,) = find_faults(drawn, [recorded()])
    assert (fault.kind, fault.fatal) == ("unit", True)
    assert f"if [geometry] is in {unit}: give its lengths in mm, {size:g} times as large" in fault.remedy
    # A soft rubber in a thin wall, sheared by three times its thickness, is possible.
    thin = bushing(inner_radius=16.0)
    travels = recorded()
    force = 0.3 * unit_stiffness(thin.geometry, "axial")[0] * travels.displacement
    assert find_faults(thin, [replace(travels, force=force)]) == ()


def test_a_travel_through_the_rubber_is_refused_with_the_remedy_of_its_unit():
    case, wrong = bushing(), changed(recorded("radial"), 1e3)
    with pytest.raises(InputError, match=r"mm, but the rubber .*units = \{ displacement = \"um\" \}"):
        check_travel(case, [wrong], find_faults(case, [wrong]))


# -- faults of samples -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("correlation", [0.0, 0.8])
@pytest.mark.parametrize("what", ["force", "displacement"])
def test_spikes_are_found_and_only_they(what, correlation):
    hit = wrong = there = 0
    for seed in range(5):
        clean, rng = recorded(seed=seed, correlation=correlation), np.random.default_rng(100 + seed)
        bad = rng.random(400) < 0.01
        values = getattr(clean, what)
        # 20 standard deviations of the force's noise.
        height = 0.06 * float(values.max()) * rng.choice([-1, 1], 400)
        spiked = replace(clean, **{what: values + height * bad})
        faults = find_faults(bushing(), [spiked])
        assert {(fault.kind, fault.fatal) for fault in faults} <= {("spikes", False)}
        found = masks(faults, spiked)
        hit, wrong, there = hit + (found & bad).sum(), wrong + (found & ~bad).sum(), there + bad.sum()
    assert wrong == 0
    # Some spikes may be missed: next to a reversal a peak of the force may come from the rubber.
    assert hit >= 0.75 * there


@pytest.mark.parametrize("at", [0, 1, -2, -1])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_spike_at_an_end_is_found_from_one_side(at, sign):
    clean = recorded(seed=3)
    force = clean.force.copy()
    force[at] += sign * 0.3 * np.ptp(force)
    found = masks(find_faults(bushing(), [replace(clean, force=force)]), clean)
    assert list(np.flatnonzero(found)) == [at % len(force)]


def test_a_force_that_begins_below_its_neighbours_is_no_spike():
    # Friction and play begin like that: the first sample is at rest, the next ones slip.
    clean = recorded(seed=3)
    force = clean.force + np.where(np.arange(len(clean.force)) > 0, 0.3 * np.ptp(clean.force), 0.0)
    assert not masks(find_faults(bushing(), [replace(clean, force=force)]), clean).any()


def test_three_bad_samples_in_a_row_are_a_spike():
    clean = recorded()
    force = clean.force.copy()
    force[150:153] += 0.1 * np.ptp(force)
    found = masks(find_faults(bushing(), [replace(clean, force=force)]), clean)
    assert list(np.flatnonzero(found)) == [150, 151, 152]


def test_a_jump_of_displacement_and_force_together_is_no_fault():
    clean = recorded()
    force, q = clean.force.copy(), clean.displacement.copy()
    q[150] += 0.5
    force[150] += 0.5 * STIFFNESS["axial"]
    assert find_faults(bushing(), [replace(clean, force=force, displacement=q)]) == ()


@pytest.mark.parametrize("share", [0.97, 0.9])
def test_a_clipped_load_cell(share):
    clean = recorded()
    limit = share * float(clean.force.max())
    clipped = replace(clean, force=np.minimum(clean.force, limit))
    (fault,) = find_faults(bushing(), [clipped])
    assert (fault.kind, fault.fatal) == ("clipped", False)
    np.testing.assert_array_equal(fault.samples, clean.force >= limit)


def test_a_load_cell_that_clips_most_of_the_test_is_fatal():
    clean = recorded()
    limit = 0.3 * float(clean.force.max())
    (fault,) = find_faults(bushing(), [replace(clean, force=np.clip(clean.force, -limit, limit))])
    assert (fault.kind, fault.fatal) == ("clipped", True)


@pytest.mark.parametrize("what", ["force", "displacement"])
@pytest.mark.parametrize("noise", [True, False])
def test_stuck_samples(what, noise):
    clean = recorded()
    if not noise:
        q = AMPLITUDE["axial"] * np.interp(clean.time, np.linspace(0, 300, 7), [0, 0.6, 0, -0.6, 0, 1, 0])
        clean = replace(clean, displacement=q, force=290.0 * q)
    values = getattr(clean, what).copy()
    values[100:108] = values[100]
    faults = find_faults(bushing(), [replace(clean, **{what: values})])
    assert kinds(faults) == [("axial", "stuck", False)]
    assert list(np.flatnonzero(masks(faults, clean))) == list(range(101, 108))


def test_rows_that_repeat_over_a_reversal_are_stuck():
    """Force and displacement repeat together, so that no jump of one against the other gives them away."""
    clean = recorded()
    q, force = clean.displacement.copy(), clean.force.copy()
    # The second turning point is at sample 133.
    q[128:140], force[128:140] = q[128], force[128]
    faults = find_faults(bushing(), [replace(clean, displacement=q, force=force)])
    assert kinds(faults) == [("axial", "stuck", False)]
    assert "repeat the force and the displacement before them" in faults[0].where
    assert list(np.flatnonzero(masks(faults, clean))) == list(range(129, 140))


def test_a_hold_of_a_rig_without_noise_is_not_stuck():
    clean = recorded()
    q = np.round(np.clip(clean.displacement, -1.0, 1.0), 3)
    stiff = np.round(290.0 * np.round(q, 2), 2)
    q[np.abs(q) > 0.95] = np.sign(q[np.abs(q) > 0.95])
    still = np.abs(q) == 1.0
    stiff[still] = 290.0 * q[still]
    faults = find_faults(bushing(), [replace(clean, displacement=q, force=stiff)])
    assert not [one for one in faults if "force and the displacement" in one.where]


def test_masks_take_the_faults_of_their_own_channel():
    clean, other = recorded(), recorded("radial")
    force = clean.force.copy()
    force[150] += 0.1 * np.ptp(force)
    faults = find_faults(bushing(), [replace(clean, force=force), other])
    assert masks(faults, clean).sum() == 1
    assert not masks(faults, other).any()
    told = condition(faults[0])
    assert told.name == "bad_samples"
    assert told.message.startswith("axial: in 1 of 400 samples the force lies far")


# -- time stamps -----------------------------------------------------------------------------------------------------


def written(folder: Path, rows: list[str], **options) -> Source:
    file = folder / "rig.csv"
    file.write_text("time_s,displacement_mm,force_N\n" + "\n".join(rows) + "\n")
    return Source("axial", file, **options)


ROWS = [f"{0.1 * i:.1f},{0.2 * i:.2f},{58.0 * i:.1f}" for i in range(10)]


def test_a_repeated_row_is_left_out_and_said(tmp_path):
    recording = read_recording(written(tmp_path, [*ROWS[:4], ROWS[3], ROWS[3], *ROWS[4:]]))
    assert len(recording.force) == 10
    assert recording.repeated == (6, 7)
    (fault,) = find_faults(bushing(), [recording])
    assert (fault.kind, fault.fatal) == ("time", False)
    assert "line 6, 7" in fault.where


def test_equal_times_of_different_rows_are_refused_with_a_remedy(tmp_path):
    rows = [*ROWS[:4], "0.3,0.65,180.0", *ROWS[4:]]
    with pytest.raises(RecordingError, match=r"rig.csv:6: .*does not increase, 0.3 follows.*more digits"):
        read_recording(written(tmp_path, rows))


def test_a_time_that_goes_back_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"rig.csv:12: .*does not increase.*file of its own"):
        read_recording(written(tmp_path, [*ROWS, *ROWS]))


def test_a_reversed_column_is_mended(tmp_path):
    wrong = [f"{0.1 * i:.1f},{0.2 * i:.2f},{-58.0 * i:.1f}" for i in range(10)]
    source = written(tmp_path, wrong)
    assert kinds(find_faults(bushing(), [read_recording(source)])) == [("axial", "sign", True)]
    assert find_faults(bushing(), [read_recording(replace(source, reverse=("force",)))]) == ()


# -- no fault --------------------------------------------------------------------------------------------------------

PROGRAMS = {
    "ramp": ([0, 1], [0, 5]),
    "cycles": (range(7), [0, 4, 0, -4, 0, 6, 0]),
    "short": (range(25), [0, 4, 0, -4] * 6 + [0]),
    "holds": ([0, 0.3, 3, 3.2, 5, 5.5, 7, 8, 9, 10], [0, 4, 4, 0, 0, -4, -4, 0, 6, 6]),
}
BODIES = ("plain", "viscous", "friction", "play", "stop", "mullins")
SENSORS = ("exact", "quantised", "hum", "white", "memory")


def program(name: str, n: int):
    if name == "sine":
        return 4 * np.sin(np.linspace(0, 6 * np.pi, n))
    if name == "steps":
        return np.repeat([0.0, 1, 2, 3, 2, 1, 0, -2], -(-n // 8))[:n]
    times, points = PROGRAMS[name]
    return np.interp(np.linspace(0, times[-1], n), times, points)


def answer(body: str, q, rng):
    force = 290 * q + 3 * q**3
    if body in ("viscous", "friction"):
        # A Maxwell branch that relaxes within 1 to 40 samples; a friction branch that slips at 150 N.
        kept, branch, limit = math.exp(-1 / rng.choice([1.0, 6.0, 40.0])), np.zeros(len(q)), 150.0
        for i in range(1, len(q)):
            step = 0.6 * (force[i] - force[i - 1]) if body == "viscous" else 900 * (q[i] - q[i - 1])
            branch[i] = (
                kept * branch[i - 1] + math.sqrt(kept) * step if body == "viscous" else branch[i - 1] + step
            )
            if body == "friction":
                branch[i] = np.clip(branch[i], -limit, limit)
        return force + branch
    if body == "play":
        return 290 * np.sign(q) * np.maximum(np.abs(q) - rng.uniform(0.1, 1.0), 0)
    if body == "stop":
        return force + 3000 * np.maximum(q - rng.uniform(1.0, 3.5), 0)
    if body == "mullins":
        largest = np.maximum.accumulate(np.abs(q))
        return force * (1 - 0.4 * (1 - np.abs(q) / np.maximum(largest, 1e-9)))
    return force


def sensed(sensor: str, q, force, rng):
    n, span = len(q), float(np.ptp(force))
    if sensor == "quantised":
        return q, np.round(force / (0.005 * span)) * 0.005 * span
    if sensor == "hum":
        wave = 0.005 * np.sin(2 * np.pi * rng.uniform(0.02, 0.5) * np.arange(n))
        return q, force + span * (wave + 5e-4 * rng.normal(size=n))
    if sensor in ("white", "memory"):
        noise = autoregressive(rng, n, 0.0 if sensor == "white" else 0.8)
        return q + 3e-3 * rng.normal(size=n), force + 0.003 * span * noise
    return q, force


@pytest.mark.parametrize("after", [2, 3, 4, 5])
def test_a_spike_between_a_turning_point_and_zero_is_found_and_not_its_neighbours(after):
    """Eight samples lie between the two: neither side of the spike has five samples of its own branch."""
    n = 129
    time = np.linspace(0.0, 300.0, n)
    q = np.interp(time, np.linspace(0, 300, 17), [0, *[2, 0, -2, 0] * 4])
    force = 300.0 * q * (1 + 0.05 * q**2) + 2.0 * np.random.default_rng(3).normal(size=n)
    at = 56 + after  # a turning point is 56
    force[at] += 250.0
    found = find_faults(bushing(), [Recording("axial", q, force, time, name="axial")])
    (fault,) = [fault for fault in found if fault.kind == "spikes"]
    assert list(np.flatnonzero(fault.samples)) == [at]


@pytest.mark.parametrize("path", [*PROGRAMS, "sine", "steps"])
@pytest.mark.parametrize("n", [200, 400])
def test_physics_and_sound_sensors_are_no_fault(path, n):
    """Knees, reversals, steps, free play, coarse converters, hum and noise; half of the cases lose 5 % of samples."""
    case, alarms = bushing(), []
    for number, (body, sensor, lost) in enumerate(product(BODIES, SENSORS, (False, True))):
        rng = np.random.default_rng([n, number])
        time, q = np.linspace(0, 100, n), program(path, n)
        q, force = sensed(sensor, q, answer(body, q, rng), rng)
        kept = rng.random(n) > (0.05 if lost else 0.0)
        found = find_faults(case, [Recording("axial", q[kept], force[kept], time[kept], name="axial")])
        alarms += [(body, sensor, lost, fault.kind, fault.where) for fault in found]
    assert alarms == []


def test_noise_is_no_spike():
    """At most one false flag in 1e4 samples, with and without memory."""
    flagged = samples = 0
    for seed, correlation in product(range(4), (0.0, 0.5, 0.8)):
        one = recorded(n=2500, seed=seed, correlation=correlation)
        flagged, samples = flagged + masks(find_faults(bushing(), [one]), one).sum(), samples + 2500
    assert flagged <= samples / 1e4


def test_spikes_do_not_raise_the_noise():
    ratios = []
    for seed in range(10):
        clean, rng = recorded(seed=seed), np.random.default_rng(seed)
        sigma = 3e-3 * float(clean.force.max())
        height = rng.uniform(10, 30, 400) * rng.choice([-1, 1], 400) * (rng.random(400) < 0.01)
        ratios.append(replace(clean, force=clean.force + sigma * height).force_noise / clean.force_noise)
    assert max(ratios) < 1.10
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("name", ["batch", "concealed"])
def test_the_examples_have_no_fault(name):
    case = load_case(ROOT / "examples" / name / "case.toml")
    found = [read_recording(source) for source in case.recordings]
    assert find_faults(case, [*found, *(read_recording(source) for source in case.coupons)]) == ()


@pytest.mark.parametrize(
    "file", sorted((ROOT / "tests" / "unit" / "data").glob("*.csv")), ids=lambda file: file.name
)
def test_the_recordings_of_other_tests_have_no_fault(file):
    assert find_faults(bushing(), [read_recording(Source("axial", file))]) == ()


@pytest.mark.skipif(not PRACTICE.is_dir(), reason="the practice recordings are not on this machine")
@pytest.mark.parametrize("name", ["p01", "p02", "p03", "p04", "p05", "p06", "p07", "p07fine", "p08"])
@pytest.mark.parametrize("ending", ["", "_noisefree"])
def test_the_practice_recordings_have_no_fault(name, ending):
    files = {mode: PRACTICE / name / f"{stem}{ending}.csv" for mode, stem in FILES.items()}
    found = [read_recording(Source(mode, file)) for mode, file in files.items() if file.is_file()]
    assert find_faults(bushing(), found) == ()


def test_the_smallest_step_of_a_signal_is_searched_for_once_however_many_samples_repeat(monkeypatch):
    # Each turning point of a slow sine repeats a sample: with a search at each, a day's record took minutes.
    from bushcli.faults import repeats

    searched = []
    monkeypatch.setattr(repeats, "quantum", lambda values: searched.append(1) or 1e-4)
    for cycles in (10, 40):
        time = np.arange(200 * cycles) / 200.0
        q = np.round(2.5 * np.sin(2.0 * np.pi * time), 2)
        assert len(repeats.repetitions(q)) > cycles
        repeats.stuck_displacement(q, 2000.0 * q + 0.01 * time, time)
    assert len(searched) == 2
