"""Faults that a table of dynamic stiffness shows by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bushcli.faults.dynamic import table_faults
from bushcli.faults.fault import chance_in_words
from bushcli.faults.off_curve import rows_off_curve
from bushcli.recording.dynamic.read import read_dynamic
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.recording.header.units import Unit
from geometry.shape import shapes

PLAIN = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)


def sweeps(temperatures, scale=1.0, noise=0.002, quantity="E", mode="uniaxial"):
    """Return amplitude sweeps of a filled rubber, whose stiffness falls with temperature and amplitude."""
    rng = np.random.default_rng(3)
    strain, temperature = (a.ravel() for a in np.meshgrid(np.geomspace(1e-4, 0.2, 20), temperatures))
    size = scale * (3.0 + 12.0 * np.exp(-temperature / 25.0) / (1.0 + (strain / 0.01) ** 0.6))
    storage = size * (1.0 + noise * rng.normal(size=size.size))
    unknown = np.full(size.size, np.nan)
    return DynamicTable(
        name="sweep", mode=mode, quantity=quantity, frequency=np.ones(size.size), storage=storage, loss=0.15 * storage,
        amplitude=strain, preload=unknown, preload_force=unknown, temperature=temperature, storage_error=unknown,
        loss_error=unknown, third_harmonic=unknown, places=tuple(f"a.csv:{i + 2}" for i in range(size.size)),
    )  # fmt: skip


def kinds(table):
    return [fault.kind for fault in table_faults(PLAIN, [table])]


@pytest.mark.parametrize("temperatures", [[23.0], [0.0, 10.0, 30.0, 50.0], [-20.0, 0.0, 20.0, 60.0, 80.0]])
@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01])
def test_a_sound_table_has_none(temperatures, noise):
    assert kinds(sweeps(temperatures, noise=noise)) == []


@pytest.mark.parametrize(
    ("scale", "meant", "fatal"),
    [(1e-6, "...", False), (1e-3, "GPa", False), (1e3, "kPa", False), (1e6, "Pa", True)],
)
def test_moduli_that_are_rare_are_a_wrong_unit_and_those_of_no_polymer_for_certain(scale, meant, fatal):
    """The glass bounds moduli from above; however soft a gel is, nothing contradicts it."""
    table = replace(sweeps([20.0], scale), units={"storage": Unit("stress", "MPa", 1.0)})
    (fault,) = table_faults(PLAIN, [table])
    assert (fault.kind, fault.fatal, bool(fault.samples.all())) == ("unit", fatal, fatal)
    assert fault.fatal or f"wrong unit is {chance_in_words(fault.probability)}" in fault.where
    assert f'units = {{storage = "{meant}"}}' in fault.remedy
    assert kinds(replace(sweeps([20.0], scale), accepted_faults=("unit",))) == []


@pytest.mark.parametrize(("name", "meant"), [("|K*| [N/mm]", "kN/mm"), ("Stiffness [N/m]", "N/mm")])
def test_the_remedy_of_a_unit_is_that_of_the_column_that_the_file_has(tmp_path, name, meant):
    """With the remedy the table has no fault."""
    size = 1.0 if meant == "kN/mm" else 1e3
    (tmp_path / "t.csv").write_text(f"f [Hz];{name};delta [deg]\n1;{0.34 * size};5\n10;{0.36 * size};5\n")
    source = DynamicSource("axial", (tmp_path / "t.csv",), stiffness_is="magnitude")
    (fault,) = table_faults(PLAIN, [read_dynamic(source)])
    assert f'units = {{stiffness = "{meant}"}}' in fault.remedy
    assert table_faults(PLAIN, [read_dynamic(replace(source, units={"stiffness": meant}))]) == ()


def test_a_sweep_in_another_unit_is_left_out():
    """A glass in some of the rows is none: a compound passes from rubber to glass."""
    table = sweeps([0.0, 20.0, 40.0])
    for part in (table.storage, table.loss):
        part[20:40] *= 1e-3
    (fault,) = table_faults(PLAIN, [table])
    assert (fault.kind, fault.fatal, fault.is_doubtful) == ("unit", False, True)
    np.testing.assert_array_equal(np.flatnonzero(fault.samples), np.arange(20, 40))
    assert "a.csv:22 to a.csv:41, 20 rows" in fault.where
    glass = sweeps([-120.0, 20.0])
    for part in (glass.storage, glass.loss):
        part[:20] *= 2.0
    assert kinds(glass) == []


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(("key", "usual"), [("amplitude", 0.05), ("preload", 3.0)])
def test_amplitudes_and_preloads_in_another_unit_are_a_warning(key, usual, factor):
    """0.05 mm read as 50 mm, or as 50 nm, on 10 mm of rubber; a preload may be as small as one likes."""
    table = relaxing(0.2)
    table = replace(table, **{key: np.full(len(table), factor * usual)})
    expected = [] if factor == 1.0 or (key, factor) == ("preload", 1e-3) else [("unit", False, True)]
    faults = table_faults(PLAIN, [table])
    assert [(fault.kind, fault.fatal, fault.is_doubtful) for fault in faults] == expected
    assert all(f"units = {{{key} = ...}}" in fault.remedy for fault in faults)


def test_the_stiffness_of_a_bushing_is_judged_by_its_shape():
    # An axial stiffness of 2 pi L G / ln(b/a) = 415 N/mm for G = 1 MPa.
    assert kinds(sweeps([20.0], 100.0, quantity="stiffness", mode="axial")) == []
    for factor in (1e-3, 1e3):
        table = sweeps([20.0], 100.0 * factor, quantity="stiffness", mode="axial")
        assert kinds(table) == ["unit"]


def test_a_row_of_another_sweep_is_found_with_that_sweep():
    table = sweeps([0.0, 20.0])
    table.storage[5], table.loss[5] = table.storage[25], table.loss[25]
    (fault,) = table_faults(PLAIN, [table])
    assert (fault.kind, list(np.flatnonzero(fault.samples))) == ("spikes", [5])
    assert "a.csv:7" in fault.where
    assert "20 degrees C" in fault.where


def test_angles_that_are_shown_as_zero_are_left_out():
    """A rig without negative angles; angles in whole degrees may be zero."""
    table = relaxing(0.2)
    late = np.degrees(table.loss_angle) - np.geomspace(0.01, 30.0, len(table))
    for digits, expected in ((2, ["clipped"]), (0, [])):
        angle = np.radians(np.round(np.maximum(late, 0.0), digits))
        size = table.stiffness
        shown = replace(table, storage=size * np.cos(angle), loss=size * np.sin(angle))
        faults = [fault for fault in table_faults(PLAIN, [shown]) if fault.kind == "clipped"]
        assert [fault.kind for fault in faults] == expected
        for fault in faults:
            np.testing.assert_array_equal(fault.samples, angle == 0.0)
            assert not fault.fatal
            assert kinds(replace(shown, accepted_faults=("clipped",))) == []


@pytest.mark.parametrize("lag", [1e-4, 2.2e-4, 2.5e-4, 5e-4])
def test_a_force_that_is_logged_late_has_no_other_angles(lag):
    """Whatever the mean of the angles, one below zero is neither 90 degrees minus another nor a tangent."""
    table = relaxing(0.2)
    K = (table.storage + 1j * table.loss) * np.exp(-2j * np.pi * table.frequency * lag)
    assert kinds(replace(table, storage=K.real, loss=K.imag)) == []


@pytest.mark.parametrize("at", [1, 2, 3])
def test_two_sweeps_that_agree_beside_others_that_do_not_are_named(at):
    table = sweeps([0.0, 15.0, 30.0, 45.0])
    same, before = slice(20 * at, 20 * at + 20), slice(20 * at - 20, 20 * at)
    table.storage[same], table.loss[same] = 1.002 * table.storage[before], 1.002 * table.loss[before]
    table.storage[at] *= 1.3
    found = table_faults(PLAIN, [table])
    assert {fault.kind for fault in found} == {"spikes", "temperature"}
    assert all(len(fault.samples) == len(table) for fault in found)


@pytest.mark.parametrize("exponent", [0.0, 1.0])
@pytest.mark.parametrize("beta", [0.25, 0.5])
@pytest.mark.parametrize(
    "temperatures", [[-40, -30, -10, 0, 10, 60, 80], [-40, -10, 60, 100], [-20, 0, 23, 40, 60, 100]]
)
def test_sweeps_on_the_plateaus_of_rubber_agree_rightly(temperatures, beta, exponent):
    """Beyond the transition, or where the fall of it and the rise of an ideal network cancel, nothing changes."""
    rng, f = np.random.default_rng(4), np.geomspace(1.0, 100.0, 8)
    T, frequency = (a.ravel().astype(float) for a in np.meshgrid(temperatures, f, indexing="ij"))
    shift = 10.0 ** (-12.0 * (T - 20.0) / (80.0 + T - 20.0))
    w = (2j * np.pi * frequency * 1e-3 * shift) ** beta
    K = 300.0 * ((T + 273.0) / 296.0) ** exponent * (1.0 + 5.0 * w / (1.0 + w))
    K = K * np.exp(0.005 * rng.normal(size=len(K)) + 0.003j * rng.normal(size=len(K)))
    none = np.full(len(K), np.nan)
    table = replace(
        sweeps([20.0], 100.0, quantity="stiffness", mode="axial"), frequency=frequency, storage=K.real
    )
    table = replace(
        table, loss=np.abs(K.imag), temperature=T, amplitude=none, preload=none, preload_force=none
    )
    table = replace(table, storage_error=none, loss_error=none, third_harmonic=none, places=())
    assert "temperature" not in kinds(table)


@pytest.mark.parametrize("mass", [0.0, 0.3, -0.6])
def test_inertia_of_a_fixture_is_no_row_off_its_curve(mass):
    """A clamp of 0.3 kg takes 3,000 N/mm down to 2,250 N/mm at 250 Hz; a wrong row is still found."""
    frequency = np.geomspace(1.0, 250.0, 14)
    turned = 2j * np.pi * frequency * 0.0025
    stiffness = 2400.0 * (1.0 + 0.26 * turned / (1.0 + turned)) - 1e-3 * mass * (2 * np.pi * frequency) ** 2
    empty = sweeps([20.0], quantity="stiffness", mode="axial").rows(np.arange(14))
    table = replace(empty, frequency=frequency, storage=stiffness.real, loss=stiffness.imag)
    table = replace(table, amplitude=np.full(14, 0.05))
    assert kinds(table) == []
    table.storage[5] *= 1.5
    (fault,) = table_faults(PLAIN, [table])
    assert list(np.flatnonzero(fault.samples)) == [5]


#: Hz: a list with a row that stands alone, lists of equal steps, and of equal factors.
LISTS = {
    "1, 10 ... 100": np.r_[1.0, np.arange(10.0, 101.0, 10.0)],
    "0.1, 10 ... 100": np.r_[0.1, np.arange(10.0, 101.0, 10.0)],
    "1, 20 ... 200": np.r_[1.0, np.arange(20.0, 201.0, 20.0)],
    "1 ... 100": np.arange(1.0, 101.0),
    "5 a decade": np.geomspace(1.0, 100.0, 11),
}
RUBBERS = {
    "filled": lambda s: (0.8 + 6.0 * (3e-6 * s) ** 0.35) / (1.0 + (3e-6 * s) ** 0.35),
    "butyl": lambda s: (0.3 + 50.0 * (1e-5 * s) ** 0.6) / (1.0 + (1e-5 * s) ** 0.6),
    "branches": lambda s: 0.8 + 0.2 * 0.02 * s / (1.0 + 0.02 * s) + 0.3 * 8e-4 * s / (1.0 + 8e-4 * s),
}


def swept(rubber, frequency, seed, resonance=np.inf):
    """Return a sweep with noise of 0.5 % and 0.2 degrees; the rig resonates at so many of the highest frequencies."""
    rng, count = np.random.default_rng(seed), len(frequency)
    K = 400.0 * RUBBERS[rubber](2j * np.pi * frequency)
    K /= 1.0 - (frequency / frequency.max() / resonance) ** 2
    K *= (1.0 + 0.005 * rng.normal(size=count)) * np.exp(1j * np.radians(0.2) * rng.normal(size=count))
    empty = relaxing(0.2).rows(np.zeros(count, dtype=int))
    places = tuple(f"a.csv:{i + 2}" for i in range(count))
    return replace(empty, frequency=frequency, storage=K.real, loss=K.imag, places=places)


@pytest.mark.parametrize("rubber", RUBBERS)
@pytest.mark.parametrize("name", LISTS)
def test_a_row_that_stands_alone_is_not_off_its_curve(name, rubber):
    """What the others cannot predict is no error, nor is a resonance beyond the table; a wrong row between them is."""
    frequency = LISTS[name]
    for seed in range(5):
        assert not rows_off_curve(swept(rubber, frequency, seed)).any()
        assert not rows_off_curve(swept(rubber, frequency, seed, resonance=1.2)).any()
    table = swept(rubber, frequency, 5)
    row = len(frequency) // 2
    for part in (table.storage, table.loss):
        part[row] *= 1.3
    np.testing.assert_array_equal(np.flatnonzero(rows_off_curve(table)), [row])


@pytest.mark.parametrize("preloads", [[0.0], [0.0, 200.0, 500.0]])
def test_a_mean_force_that_was_measured_divides_no_curve(preloads):
    """Load cells scatter by some newtons, of which a vibration of 20 N does not notice anything."""
    rng, frequency = np.random.default_rng(2), np.geomspace(1.0, 200.0, 15)
    parts = [swept("filled", frequency, seed) for seed in range(len(preloads))]
    storage, loss, all_of_it = (
        np.concatenate([getattr(part, key) for part in parts]) for key in ("storage", "loss", "frequency")
    )
    table = parts[0].rows(np.zeros(len(storage), dtype=int))
    force = np.repeat(preloads, 15) + 2.0 * rng.normal(size=len(storage))
    amplitude = 0.05 * (1.0 + 0.01 * rng.normal(size=len(storage)))
    table = replace(
        table, frequency=all_of_it, storage=storage, loss=loss, preload=np.full(len(storage), np.nan),
        preload_force=force, amplitude=amplitude, places=tuple(f"a.csv:{i + 2}" for i in range(len(storage))),
    )  # fmt: skip
    assert [len(rows) for rows in table.conditions()] == [15] * len(preloads)
    np.testing.assert_allclose(np.unique(table.levelled("preload_force")), preloads, atol=3.0)
    assert table.levelled("preload_force").min() == 0.0
    table.storage[7] *= 1.15
    np.testing.assert_array_equal(np.flatnonzero(rows_off_curve(table)), [7])


@pytest.mark.parametrize("scatter", [0.0, 2.0])
@pytest.mark.parametrize("amplitude", [0.05, 0.5])
def test_preloads_are_apart_however_large_the_vibration_is(amplitude, scatter):
    """0, 50 and 100 N in a vibration of 20 or 200 N: stated, or measured."""
    frequency = np.geomspace(1.0, 200.0, 15)
    rows = np.tile(np.arange(15), 3)
    force = np.repeat([0.0, 50.0, 100.0], 15)
    measured = force + scatter * np.random.default_rng(4).normal(size=45)
    table = replace(
        swept("filled", frequency, 1).rows(rows),
        amplitude=np.full(45, amplitude),
        preload=np.full(45, np.nan),
        preload_force=measured,
    )
    assert [list(part) for part in table.conditions()] == [list(range(k, k + 15)) for k in (0, 15, 30)]
    np.testing.assert_allclose(table.levelled("preload_force"), force, atol=scatter)
    # So are those of some rows, and of none.
    some = np.arange(0, 45, 3)
    np.testing.assert_allclose(table.rows(some).levelled("preload_force"), force[some], atol=scatter)
    assert len(table.rows(np.arange(0)).levelled("preload_force")) == 0


def test_a_dense_sweep_has_many_frequencies():
    frequency = np.tile(np.geomspace(1.0, 100.0, 400), 3)
    table = replace(swept("filled", frequency, 1), amplitude=np.repeat([0.05, 0.1, 0.2], 400))
    assert [len(rows) for rows in table.conditions()] == [400] * 3


def relaxing(glass, tau=0.005, mass=0.0):
    """Return a sweep of rubber that stiffens by `glass` times its modulus about a time, on a rig with a mass."""
    frequency = np.geomspace(1.0, 200.0, 20)
    K = 1.0 + glass * (2j * np.pi * frequency * tau) ** 0.4 / (1.0 + (2j * np.pi * frequency * tau) ** 0.4)
    K -= mass * (frequency / 200.0) ** 2
    unknown = np.full(20, np.nan)
    return DynamicTable(
        name="sweep", mode="axial", quantity="stiffness", frequency=frequency, storage=400.0 * K.real,
        loss=400.0 * K.imag, amplitude=unknown, preload=np.zeros(20), preload_force=unknown, temperature=unknown,
        storage_error=unknown, loss_error=unknown, third_harmonic=unknown,
        places=tuple(f"a.csv:{i + 2}" for i in range(20)),
    )  # fmt: skip


@pytest.mark.parametrize(("glass", "mass"), [(0.2, 0.0), (0.6, 0.0), (0.6, 0.3), (20.0, 0.0)])
def test_the_rise_of_the_stiffness_tells_the_loss_angle_from_its_complement(glass, mass):
    table = relaxing(glass, mass=mass)
    assert kinds(table) == []
    turned = replace(table, storage=table.loss, loss=table.storage)
    (fault,) = table_faults(PLAIN, [turned])
    assert (fault.kind, fault.fatal, fault.is_doubtful) == ("loss_angle", False, True)
    assert fault.probability > 0.9
    assert 'loss_angle_is = "complement"' in fault.remedy
    assert kinds(replace(turned, accepted_faults=("loss_angle",))) == []


def test_loss_angles_in_radians_that_are_read_as_degrees_are_a_warning():
    """Rubber that stiffens by a fifth has a loss angle of degrees, not of hundredths of one."""
    table = relaxing(0.6)
    size, angle = table.stiffness, np.radians(table.loss_angle)
    wrong = replace(table, storage=size * np.cos(angle), loss=size * np.sin(angle))
    (fault,) = table_faults(PLAIN, [wrong])
    assert (fault.kind, fault.fatal, fault.is_doubtful) == ("loss_angle", False, True)
    assert "in radians" in fault.where
    # Natural rubber without fillers.
    low = replace(table, loss=np.full(len(table), np.radians(0.7)) * table.storage)
    assert kinds(low) == []


def softened(order, share):
    """Return sweeps over these amplitudes at two frequencies, softer by a share after the largest amplitude."""
    amplitude, frequency = np.tile(order, 2), np.repeat([1.0, 10.0], len(order))
    after = np.tile(np.arange(len(order)) > np.argmax(order), 2)
    size = (
        400.0 * (1.0 + 0.1 * np.log(frequency) - 0.15 * np.log(amplitude)) * np.where(after, 1 - share, 1.0)
    )
    scatter = 1.0 + 0.003 * np.random.default_rng(1).standard_normal(len(size))
    empty = relaxing(0.2).rows(np.zeros(len(size), dtype=int))
    return replace(
        empty, frequency=frequency, amplitude=amplitude, storage=size * scatter, loss=0.1 * size
    ), after


def test_rows_after_larger_amplitudes_that_are_softer_are_left_out():
    table, after = softened([0.05, 0.1, 0.2, 0.5, 0.2, 0.1, 0.05], 0.06)
    (fault,) = table_faults(PLAIN, [table])
    assert (fault.kind, fault.fatal) == ("order", False)
    assert "by 6.1 % on average" in fault.where
    np.testing.assert_array_equal(fault.samples, after)
    assert kinds(replace(table, accepted_faults=("order",))) == []


@pytest.mark.parametrize(
    ("order", "share"),
    [
        ([0.05, 0.1, 0.2, 0.5, 0.2, 0.1, 0.05], 0.0),
        ([0.05, 0.1, 0.2, 0.5], 0.1),
        ([0.5, 0.2, 0.1, 0.05], 0.1),
    ],
)
def test_the_order_of_a_sweep_is_doubted_only_where_amplitudes_return_softer(order, share):
    assert kinds(softened(order, share)[0]) == []
