"""The check of ``make lint`` that all code is used finds what it is for."""

from __future__ import annotations

from pathlib import Path

from tests.unused import faults


def test_what_is_not_used_is_found_and_so_are_needless_exceptions(tmp_path: Path) -> None:
    (tmp_path / "some.py").write_text(
        "def used():\n    pass\n\n\ndef alone():\n    pass\n\n\ndef hook():\n    pass\n\n\nused()\n"
    )
    allowed = {("some", "hook"): "a library", ("some", "gone"): "nobody any more"}
    assert faults(tmp_path, ["some.py"], allowed) == [
        "some.py:5: function alone is not used",
        "no unused gone in some: remove the exception",
    ]
