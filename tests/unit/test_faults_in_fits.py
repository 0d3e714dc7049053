"""Bad samples do not enter a fit: `bushcli inverse` and `bushcli fit` leave them out as a diagnosis does."""

import numpy as np

from bushcli.faults import bad_samples
from bushcli.inverse.channel import Channel
from bushcli.inverse.channels import bushing_channels
from bushcli.recording import Recording


def test_spikes_weigh_nothing():
    time = np.arange(200.0)
    q = 4.0 * np.sin(2 * np.pi * time / 100)
    rng = np.random.default_rng(2)
    force = 300 * q + 2 * q**3 + rng.normal(size=200)
    force[[40, 140]] += 400.0
    made = Recording("axial", q, force, time, name="axial")
    assert list(np.flatnonzero(bad_samples(made))) == [40, 140]


def test_a_channel_gives_spikes_no_weight(tmp_path):
    from bushcli.case import load_case
    from cases.simulate import Rubber
    from forms.law import law

    time = np.arange(200.0)
    q = 4.0 * np.sin(2 * np.pi * time / 100)
    force = 300 * q + 2 * q**3 + np.random.default_rng(2).normal(size=200)
    force[40] += 400.0
    rows = "\n".join(f"{t},{a:.6f},{f:.4f}" for t, a, f in zip(time, q, force, strict=True))
    (tmp_path / "axial.csv").write_text(f"time_s,displacement_mm,force_N\n{rows}\n")
    (tmp_path / "case.toml").write_text(
        'title = "spiked"\n[geometry]\nshape = "plain"\ninner_radius = 12.0\nouter_radius = 22.0\nlength = 40.0\n'
        '[material]\nlaw = "neo_hookean"\n[[recordings]]\nmode = "axial"\nfile = "axial.csv"\n'
    )
    case = load_case(tmp_path / "case.toml")
    (channel,) = bushing_channels(case, Rubber(law("neo_hookean"), {"C10": 0.4}))
    assert isinstance(channel, Channel)
    assert np.isinf(channel.scale[40])
    assert np.isfinite(np.delete(channel.scale, 40)).all()


def test_the_misfit_of_a_fit_does_not_count_bad_samples(tmp_path):
    from bushcli.case import load_case
    from bushcli.inverse import Task, identify
    from bushcli.simulate.simulation import Simulation
    from cases.mode import modes
    from cases.simulate import Rubber
    from forms.law import law

    (tmp_path / "case.toml").write_text(
        'title = "spiked"\n[geometry]\nshape = "plain"\ninner_radius = 12.0\nouter_radius = 22.0\nlength = 40.0\n'
        "[mesh]\nelements_across = 2\nelements_along = 3\n"
        '[material]\nlaw = "neo_hookean"\n[[recordings]]\nmode = "axial"\nfile = "axial.csv"\n'
    )
    q = np.linspace(0.0, 4.0, 80)
    rows = "\n".join(f"{i},{u:.6f},{100 * u:.4f}" for i, u in enumerate(q))
    (tmp_path / "axial.csv").write_text(f"time_s,displacement_mm,force_N\n{rows}\n")
    shaped = load_case(tmp_path / "case.toml")
    rubber, mesh = Rubber(law("neo_hookean"), {"C10": 0.4}, 2000.0), shaped.mesh.refinement
    body = Simulation(shaped.geometry, modes()["axial"], rubber, mesh, (), np.arange(80.0), q, None)
    force = body.solve({"C10": 0.4}).force
    force = force + 0.002 * np.ptp(force) * np.random.default_rng(4).normal(size=80)
    force[[40, 79]] += 0.5 * np.ptp(force)
    rows = "\n".join(f"{i},{u:.6f},{f:.4f}" for i, (u, f) in enumerate(zip(q, force, strict=True)))
    (tmp_path / "axial.csv").write_text(f"time_s,displacement_mm,force_N\n{rows}\n")
    found = identify(Task(load_case(tmp_path / "case.toml"), "neo_hookean"))
    # 0.2 % of the range is the noise; two spikes of half of it would be 8 %.
    assert found.curves[0].rms_percent < 0.3
