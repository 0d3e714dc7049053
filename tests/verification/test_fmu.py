"""FMUs of the force law with memory, run by FMPy: against the same law in Python, and against finite elements."""

import os
import subprocess
import sys
import textwrap

import fmpy
import fmpy.validation
import numpy as np
import pytest

from bushcli.export import Order, read_source, unit_system, writer_for
from bushcli.export.bushing import bushing_of
from bushcli.export.fmu.force_law import Channel, Cubic
from bushcli.export.reduce import follow

CASE = """
title = "12/22/40"
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 3
elements_along = 8
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.5
C20 = -0.05
C30 = 0.01
[[load_cases]]
mode = "axial"
path = [0, 5, -4, 0]
rate = 1.0
[[load_cases]]
mode = "torsional"
path = [0, 12, -12]
rate = 4.0
[[effects]]
name = "viscoelasticity"
parameters = { g1 = 0.2, tau1 = 4.0, g2 = 0.15, tau2 = 0.5 }
[[effects]]
name = "friction"
parameters = { g = 0.3, slip = 0.05 }
[[effects]]
name = "gain"
parameters = { error = 0.1 }
channels = ["axial"]
"""


@pytest.fixture(scope="module")
def bushing(tmp_path_factory):
    file = tmp_path_factory.mktemp("fmu") / "case.toml"
    file.write_text(CASE)
    return bushing_of(read_source(file), writer_for("fmu2"))


@pytest.fixture(scope="module")
def fmu(bushing, tmp_path_factory):
    def make(version, units):
        path = tmp_path_factory.mktemp("fmu") / "bushing.fmu"
        order = Order("12/22/40", "case.toml", unit_system(units), None, None, bushing)
        path.write_bytes(writer_for(f"fmu{version}").text(order))
        return path

    return make


def speed_of(name):
    return name.replace("displacement", "velocity")


def test_the_force_law_is_the_bushing_within_one_percent(bushing):
    """The program of the check has ramps, reversals at two amplitudes and holds; none of it took part in the law."""
    for channel in bushing.law.channels:
        assert channel.rms_percent < 1.0, channel.name
        assert channel.peak_percent < 3.0, channel.name
        # Without memory the law would be far off: the check can tell.
        plain = dict(channel.data, maxwell=[], sliders=[])
        error = follow(plain, channel.program) - channel.simulated
        assert np.sqrt(np.mean(error**2)) > 0.03 * np.ptp(channel.simulated)


def test_the_rig_is_left_out_and_said(bushing):
    assert bushing.remarks == ("without what the rig does: gain",)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("units", ["N-mm-s", "SI"])
def test_fmpy_finds_the_forces_of_the_bushing(fmu, bushing, version, units):
    path = fmu(version, units)
    assert fmpy.validation.validate_fmu(str(path)) == []
    description = fmpy.read_model_description(str(path))
    assert description.fmiVersion == f"{version}.0"
    length = {"N-mm-s": 1.0, "SI": 1e-3}[units]
    axial, twist = bushing.law.channels
    assert axial.name == "axial"
    time = axial.program[:, 0]
    step = np.diff(time).min()
    columns = [
        ("axial_displacement", axial, length, "axial_force", 1.0),
        ("torsional_displacement", twist, 1.0, "torsional_moment", length),
    ]
    # FMPy holds an input through a step: the displacement at its end is the input plus the velocity times its duration.
    steps = round(time[-1] / step)
    at = step * np.arange(steps + 1)
    names = [name for column in columns for name in (column[0], speed_of(column[0]))]
    table = np.zeros(steps + 1, dtype=[(name, float) for name in ("time", *names)])
    table["time"] = at
    for name, channel, scale, _, _ in columns:
        q = scale * np.interp(at, channel.program[:, 0], channel.program[:, 1])
        table[name] = q
        table[speed_of(name)][:-1] = np.diff(q) / step
    outputs = [c[3] for c in columns]
    found = fmpy.simulate_fmu(str(path), stop_time=at[-1], output_interval=step, input=table, output=outputs)
    for _, channel, _, output, scale in columns:
        force = np.interp(channel.program[:, 0], found["time"], found[output]) / scale
        size = np.ptp(channel.simulated)
        # The same law along the same program: only the division into steps differs.
        assert np.abs(force - channel.predicted).max() < 5e-3 * size
        error = np.sqrt(np.mean((force - channel.simulated) ** 2)) / size
        assert 100 * error == pytest.approx(channel.rms_percent, abs=0.2)


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_needs_nothing_of_bushcli(fmu, tmp_path, version):
    """FMPy runs it in a process that cannot import bushcli, NumPy aside for FMPy itself."""
    path = fmu(version, "N-mm-s")
    script = textwrap.dedent(
        f"""
        import sys
        class Gone:
            def find_spec(self, name, *rest):
                if name.split(".")[0] in ("bushcli", "cases", "forms", "geometry"):
                    raise ImportError(name)
        sys.meta_path.insert(0, Gone())
        import fmpy
        result = fmpy.simulate_fmu({str(path)!r}, stop_time=1.0, output_interval=0.1,
            start_values={{"axial_displacement": 0.0, "axial_velocity": 20.0}}, output=["axial_force"])
        assert "bushcli" not in sys.modules
        print(result["axial_force"][-1])
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.splitlines()[-1]) > 0


def test_channels_of_any_name_become_variables(bushing):
    from dataclasses import replace

    from bushcli.export.law import BushingLaw

    named = [replace(bushing.law.channels[0], name=name) for name in ("axial slow", "2 Hz")]
    data = BushingLaw(tuple(named)).data("x", "x", unit_system("SI"))
    assert list(data["channels"]) == ["axial_slow", "channel_2_Hz"]


def test_a_cubic_meets_its_points_and_slopes_and_goes_on_straight():
    x = [-1.0, 0.0, 2.0]
    curve = Cubic(x, [v**3 for v in x], [3 * v**2 for v in x])
    assert [curve(v) for v in x] == pytest.approx([v**3 for v in x])
    assert curve(0.7) == pytest.approx(0.343)
    assert curve(3.0) == pytest.approx(8.0 + 12.0)
    assert curve(-2.0) == pytest.approx(-1.0 - 3.0)


def test_a_maxwell_branch_and_a_slider_have_their_closed_forms():
    straight = {"displacement": [-1.0, 1.0], "force": [-10.0, 10.0], "force_slope": [10.0, 10.0]}
    straight |= {"elastic": [-10.0, 10.0], "elastic_slope": [10.0, 10.0]}
    ramp = Channel(straight | {"maxwell": [[0.5, 2.0]], "sliders": []})
    # A ramp of H at rate v against tau: g v tau (1 - exp(-t/tau)), whatever the steps; then a hold.
    for duration in (0.3, 1.2, 1.5):
        ramp.advance(ramp.q + duration / 6.0, duration)
    peak = 0.5 * (10.0 / 6.0) * 2.0 * (1 - np.exp(-1.5))
    assert ramp.force == pytest.approx(5.0 + peak)
    assert ramp.advance(ramp.q, 4.0) == pytest.approx(5.0 + peak * np.exp(-2.0))
    slider = Channel(straight | {"maxwell": [], "sliders": [[0.5, 2.0]]})
    # Sticks to H = 4, slips, and after the reversal takes twice that to slip back.
    assert [slider.advance(q, 1.0) - 10 * q for q in (0.2, 0.4, 0.9, 0.7, 0.1, -0.5)] == pytest.approx(
        [1.0, 2.0, 2.0, 1.0, -2.0, -2.0]
    )
