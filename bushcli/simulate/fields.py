"""Field files of a channel, and the reason if they cannot be written."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from cases.fields import write_fields
from cases.march import History
from cases.model import FiniteElementModel
from cases.stretches import Surface, surface


@contextmanager
def _without_stderr() -> Iterator[None]:
    """Discard the stack of errors that HDF5 prints on stderr before it raises an error, which is sufficient."""
    sys.stderr.flush()
    saved = os.dup(2)
    try:
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
            yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)


def write_field_file(model: FiniteElementModel, history: History, file: Path) -> str:
    """Write the field file of a march with its states; return why that failed, or an empty text. Parts are removed."""
    assert history.states is not None
    try:
        with _without_stderr():
            write_fields(model, history.displacement, history.states, file)
    except (OSError, RuntimeError) as error:  # HDF5 raises the second on a full disk
        with suppress(OSError):
            for part in (file, file.with_suffix(".h5")):
                part.unlink(missing_ok=True)
        return (str(error).splitlines() or [type(error).__name__])[0]
    return ""


def picture(model: FiniteElementModel, history: History) -> Surface | None:
    """Return the surface at the largest displacement, for a picture; None where no state was reached."""
    assert history.states is not None
    if not len(history.states):
        return None
    widest = int(np.argmax(np.abs(history.displacement)))
    model.state.x.array[:] = history.states[widest]
    return surface(model, float(history.displacement[widest]))
