"""The example with a concealed effect: the recording has what `truth.json` says, and the case reveals nothing of it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np

from benchmarks.concealed.programs import Leg, path
from benchmarks.concealed.simulate import Channel, force
from benchmarks.concealed.truth import Specimen
from bushcli.case import load_case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect, effects
from bushcli.recording import read_recording

FOLDER = Path(__file__).parents[2] / "examples" / "concealed"
TRUTH = json.loads((FOLDER / "truth" / "truth.json").read_text(encoding="utf-8"))


def test_the_truth_makes_the_recording():
    recorded = read_recording(load_case(FOLDER / "case.toml").recordings[0])
    program = TRUTH["program"]
    legs = tuple(Leg(*leg) for leg in program["legs"])
    time, q = path(legs, program["amplitude"], program["slow"], program["samples"])
    np.testing.assert_allclose(recorded.time, time, atol=1e-3)
    # Five standard deviations of the transducer's noise; one sample of 180 is beyond once in 10,000 recordings.
    np.testing.assert_allclose(recorded.displacement, q, atol=5 * TRUTH["displacement_noise"])
    specimen = Specimen(
        TRUTH["shape"],
        TRUTH["dimensions"],
        TRUTH["law"],
        TRUTH["parameters"],
        TRUTH["bulk_modulus"],
        {"axial": program["amplitude"]},
    )
    channel = Channel("axial", time, q)
    active = [ActiveEffect(effect(name), values) for name, values in TRUTH["effects"].items()]
    span = float(np.ptp(recorded.force))
    rms = [
        100.0
        * float(np.sqrt(np.mean((force(specimen, channel, acts, finer=False)[0] - recorded.force) ** 2)))
        / span
        for acts in (active, [])
    ]
    # The default elements are off by 0.05 % of the range. The standard deviation of 178 samples is known to 16 %, which
    # is three of its standard errors.
    assert abs(rms[0] / TRUTH["noise_percent"] - 1.0) < 0.16
    assert rms[1] > 10 * TRUTH["noise_percent"]


def test_the_case_says_nothing_of_it():
    case = (FOLDER / "case.toml").read_text(encoding="utf-8")
    assert not any(name in case for name in effects())
    told = tomllib.loads(case)
    assert {"shape": told["geometry"].pop("shape"), "dimensions": told["geometry"]} == {
        key: TRUTH[key] for key in ("shape", "dimensions")
    }
    assert "parameters" not in told["material"]
