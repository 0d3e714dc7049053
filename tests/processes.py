"""Processes that a test has seen."""

from __future__ import annotations

from pathlib import Path


def lives(pid):
    """Whether a process runs; one that has ended and waits for its parent, or for the system, to notice does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
