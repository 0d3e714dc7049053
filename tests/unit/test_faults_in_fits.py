"""Bad samples do not enter a fit: `bushcli inverse` and `bushcli fit` leave them out as a diagnosis does."""

import numpy as np

from bushcli.faults import bad_samples
from bushcli.inverse.channel import Channel, bushing_channels
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
