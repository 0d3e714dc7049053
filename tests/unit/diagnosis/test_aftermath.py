"""The next test separates rivals, which have to be known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bushcli.diagnosis import aftermath


@pytest.mark.parametrize("searched", [True, False])
def test_no_test_is_proposed_before_most_models_have_been_looked_at(
    monkeypatch: pytest.MonkeyPatch, searched: bool
) -> None:
    monkeypatch.setattr(aftermath, "next_test", lambda *_: "axial to 6 mm")
    models: Any = [
        SimpleNamespace(effects=("friction",), probability=0.6),
        SimpleNamespace(effects=("mullins",), probability=0.4),
    ]
    given: Any = SimpleNamespace()
    search: Any = SimpleNamespace(
        problem=SimpleNamespace(recordings=()),
        states={},
        share_left=0.0 if searched else 1.0,
        progress=lambda *_: None,
    )
    extras = aftermath.Extras()
    extras.make(search, given, models, given, given, False)
    assert extras.test == ("axial to 6 mm" if searched else None)
    assert extras.conditions == ()


@pytest.mark.parametrize(
    ("before", "after", "share"), [(8.0, 2.0, 0.25), (8.0, 0.0, 0.0), (2.0, 3.0, 1.0), (0.0, 0.0, 0.0)]
)
def test_what_is_left_is_a_share_of_the_plain_laws_misfit(before: float, after: float, share: float) -> None:
    """Channels closer than the noise count as zero, not as less."""

    def state(excess: float) -> Any:
        return SimpleNamespace(
            evidence=SimpleNamespace(left=SimpleNamespace(excess=np.array([excess, -5.0])))
        )

    best: Any = SimpleNamespace(state=state(after))
    assert aftermath.misfit_share_left(best, state(before)) == share
