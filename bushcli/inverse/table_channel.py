"""A table of dynamic stiffness as a channel of a comparison of models: all have the same rows, in the same units.

A table with several temperatures has a `DynamicChannel` for each where an effect depends on the temperature. Rows are
in units of their standard errors (`RecordedTable`), and those of all amplitudes count, whatever the model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.effects.active import ActiveEffect
from bushcli.faults.dynamic import table_faults
from bushcli.inverse.channel import Channel, ChannelForces, Patience
from bushcli.inverse.channels import dynamic_tables
from bushcli.inverse.dynamic_channel import DynamicChannel, Store
from bushcli.recording.dynamic.rows import RecordedTable, recorded_table
from bushcli.recording.table_cache import TableCache
from bushcli.simulate.dynamic_tables import by_temperature
from cases.model import FiniteElementModel
from cases.simulate import Prepare, Rubber

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Stores = Callable[[FiniteElementModel, tuple[object, ...]], Store]
"""Body, and what else distinguishes a channel -> reduced matrices of earlier channels like it."""


class TableChannel:
    """A table and its model; a `FitChannel`.

    Attributes
    ----------
    recording : RecordedTable
    comm : MPI.Comm
    active : tuple of ActiveEffect
    model : FiniteElementModel
        Of the first temperature.
    """

    coupon, simulation = False, None

    def __init__(
        self, recording: RecordedTable, rubber: Rubber, case: Case, prepared: Prepare, stores: Stores
    ) -> None:
        self.recording, self.comm = recording, MPI.COMM_SELF
        table = recording.table
        self._parts: list[tuple[NDArray[np.intp], DynamicChannel]] = []
        for rows, temperature in by_temperature(case, table):

            def stored(model: FiniteElementModel, uneven: bool, at: float | None = temperature) -> Store:
                return stores(model, (table.name, at, uneven))

            part = table.rows(rows)
            channel = DynamicChannel(part, rubber, case, self.comm, prepared, temperature, stored)
            self._parts.append((rows, channel))
        self.model = self._parts[0][1].model

    @property
    def name(self) -> str:
        """Name of the channel."""
        return self.recording.name

    @property
    def active(self) -> tuple[ActiveEffect, ...]:
        """Effects that act on it."""
        return self._parts[0][1].active

    @property
    def measured(self) -> Array:
        """Measured rows, shape (2 n,)."""
        return self.recording.force

    @property
    def scale(self) -> Array:
        """Size of a unit of misfit at each row, shape (2 n,)."""
        return np.ones(len(self.recording.force))

    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], patience: Patience | None = None
    ) -> ChannelForces:
        """Return the rows, their preloads (mm or rad) in place of displacements, and derivatives by those named.

        Parameters
        ----------
        parameters, names, patience
            As for `bushcli.inverse.channel.Channel.solve`.

        Raises
        ------
        NotConverged
            A preload was not reached, or is unstable.
        """
        table, states = self.recording.table, []
        value = np.empty(len(table), dtype=np.complex128)
        slope = np.empty((len(table), len(names)), dtype=np.complex128)
        travel = np.empty(len(table))
        for rows, channel in self._parts:
            answer = channel.solve(parameters, names, patience)
            turn = np.exp(1j * table.loss_angle[rows])
            along, across = answer.force.reshape(2, -1)
            value[rows] = (along + 1j * across) * turn
            along, across = answer.slope.reshape(2, len(rows), -1)
            slope[rows] = (along + 1j * across) * turn[:, None]
            travel[rows] = answer.displacement[: len(rows)]
            states += [] if answer.states is None else [answer.states]
        reached = np.concatenate(states) if states else None
        return ChannelForces(
            np.tile(travel, 2), self.recording.rows(value), self.recording.rows(slope), reached
        )

    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        """Return the rows (2 n,) and derivatives (2 n, parameters): those of the answer."""
        return answer.force, answer.slope

    def reached(self, parameters: Mapping[str, float], patience: Patience) -> Array:
        """Return a sample of isochoric principal stretches of the rubber at the preloads, shape (n, 3).

        Parameters
        ----------
        parameters, patience
            As for `bushcli.inverse.channel.Channel.reached`.
        """
        states = self.solve(parameters, (), patience).states
        assert states is not None
        return states


AnyChannel = Channel | TableChannel
"""A channel of a comparison of models."""


def recorded_tables(case: Case, tables: TableCache | None = None) -> tuple[RecordedTable, ...]:
    """Return the tables of dynamic stiffness of the bushing as recordings; rows that are faulty do not count.

    Parameters
    ----------
    case : Case
    tables : TableCache, optional
        Cache of the files that the caller reads.
    """
    found = []
    for table in dynamic_tables(case, tables):
        faulty = np.zeros(len(table), dtype=bool)
        for fault in table_faults(case.geometry, [table]):
            faulty |= fault.samples & (not fault.fatal)
        found.append(recorded_table(table, faulty))
    return tuple(found)
