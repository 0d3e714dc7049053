"""A whole diagnosis with the whole catalogue: an axial and a radial recording of third-order elements."""

from __future__ import annotations

from pathlib import Path

import pytest

from bushcli.case import load_case
from bushcli.diagnosis.diagnose import diagnose

# Recording 002 of the development deck (benchmarks/decks/manifests/dev.json): what it conceals, in mm and s.
TRUTH = {"swaging": {"reduction": 0.4482}, "time_lag": {"lag": -0.0693808}}


@pytest.mark.slow
def test_a_pair_is_found_among_the_whole_catalogue() -> None:
    """Elements, mesh and steps are not those of the diagnosis; calibration errs, and noise has a memory."""
    case = load_case(Path(__file__).parent / "data" / "third-order" / "case.toml", ())
    found = diagnose(case, maps=False)
    assert found.verdict == "missing_physics"
    assert {one.name for one in found.effects} == set(TRUTH)
    # The pair is the credible set, and no other effect is probable.
    assert found.rivals == ()
    assert all(p > 0.95 if name in TRUTH else p < 0.05 for name, p in found.probability.items())
    for one in found.effects:
        for name, true in TRUTH[one.name].items():
            value = one.parameters[name]
            assert value.lower < true < value.upper
    for channel in found.channels:
        # The law alone leaves 12 and 17 times the noise (measured).
        assert channel.after_percent < 1.1 * channel.noise_percent
        assert channel.before_percent > 10.0 * channel.noise_percent
