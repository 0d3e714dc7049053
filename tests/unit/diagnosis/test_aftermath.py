"""The next test separates rivals, which have to be known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

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
    extras = aftermath.Extras()
    extras.make(given, given, models, given, given, False, searched, lambda *_: None)
    assert extras.test == ("axial to 6 mm" if searched else None)
    assert extras.conditions == ()
