"""Virtual environments for the peers, separate from bushcli's: $BUSHCLI_HOME/bench/NAME."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

# FElupe differentiates some of its rubbers with tensortrax, which is not among its requirements.
PACKAGES = {"ngsolve": ["ngsolve"], "felupe": ["felupe"], "decks": ["felupe", "tensortrax"]}


def home() -> Path:
    """Folder of the environments."""
    data = Path(os.environ.get("XDG_DATA_HOME", Path.home() / ".local" / "share"))
    return Path(os.environ.get("BUSHCLI_HOME", data / "bushcli")) / "bench"


def interpreter(peer: str) -> Path:
    """Return a Python that has the peer, installed from PyPI if necessary; raise RuntimeError if that fails."""
    folder = home() / f"{peer}-{sys.version_info.major}.{sys.version_info.minor}"
    python = folder / "bin" / "python"
    if (folder / "complete").exists():
        return python
    print(f"installing {peer} in {folder}", file=sys.stderr)
    steps = (
        [sys.executable, "-m", "venv", "--clear", str(folder)],
        [str(python), "-m", "pip", "install", "-q", "--disable-pip-version-check", *PACKAGES[peer]],
    )
    for step in steps:
        done = subprocess.run(step, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"{peer} could not be installed: {done.stderr.strip()[-300:]}")
    (folder / "complete").touch()
    return python


def calculix() -> str:
    """Return the program `ccx`, from $CCX or the PATH (Debian: apt-get install calculix-ccx), or raise RuntimeError."""
    program = os.environ.get("CCX") or shutil.which("ccx")
    if program is None:
        raise RuntimeError(
            "no ccx on the PATH: apt-get install calculix-ccx (Debian 12 has it), or CCX=/path/to/ccx"
        )
    return program
