"""Run a script in FElupe's environment: a task as JSON in, forces out."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.install import interpreter

Array = NDArray[np.float64]


class Failed(Exception):
    """The other code found no equilibrium."""


def ask(script: str, task: Mapping[str, Any]) -> Array:
    """Return the forces that a script of this folder computes.

    Raises
    ------
    Failed
    """
    done = subprocess.run(
        [str(interpreter("decks")), str(Path(__file__).parent / f"{script}.py")],
        input=json.dumps(task),
        capture_output=True,
        text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )
    if done.returncode:
        raise Failed(done.stderr.strip()[-300:])
    return np.array(json.loads(done.stdout))
