"""What the designs of a study share in a process."""

from __future__ import annotations

from dataclasses import dataclass, field

from bushcli.recording.table_cache import TableCache
from bushcli.simulate.bodies import PreparedModels
from bushcli.simulate.measured import Measured


@dataclass(frozen=True)
class DesignCache:
    """Finite-element models and recordings, from one design to the next; they serve one thread at a time.

    Attributes
    ----------
    bodies : PreparedModels
        The models.
    measured : Measured
        The recordings.
    """

    bodies: PreparedModels = field(default_factory=PreparedModels)
    measured: Measured = field(default_factory=Measured)

    @property
    def tables(self) -> TableCache:
        """Cache of the binary files that the recordings are read from."""
        return self.measured.tables
