"""A table of dynamic stiffness as a channel of a comparison of models: all have the same rows, in the same units.

A table with several temperatures has a `DynamicChannel` for each where an effect depends on the temperature. Rows are
in units of their standard errors (`RecordedTable`), and those of all amplitudes count, whatever the model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from typing_extensions import override

from bushcli.case import Case
from bushcli.faults.dynamic import table_faults
from bushcli.inverse.channel import Channel, ChannelForces, FitChannel, StepLimit
from bushcli.inverse.channels import dynamic_tables
from bushcli.inverse.dynamic_channel import DynamicChannel
from bushcli.inverse.dynamic_simulation import Store
from bushcli.recording.dynamic.rows import RecordedTable, recorded_table
from bushcli.recording.table_cache import TableCache
from bushcli.simulate.dynamic_tables import by_temperature
from bushcli.simulate.extent import Extent, of_table
from cases.model import FiniteElementModel
from cases.simulate import Prepare, Rubber

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Stores = Callable[[FiniteElementModel, tuple[object, ...]], Store]
"""Body, and what else distinguishes a channel -> reduced matrices of earlier channels like it."""


class TableChannel(FitChannel):
    """A table and its model, of the first temperature if there are several.

    Attributes
    ----------
    recording : RecordedTable
    """

    def __init__(
        self, recording: RecordedTable, rubber: Rubber, case: Case, prepared: Prepare, stores: Stores
    ) -> None:
        self.recording = recording
        table = recording.table
        self._parts: list[tuple[NDArray[np.intp], DynamicChannel]] = []
        for rows, temperature in by_temperature(case, table):
            part = table.rows(rows)
            conditions = (part.preload, part.preload_force, part.frequency, part.amplitude)
            name = (table.name, temperature, *(values.tobytes().hex() for values in conditions))

            def stored(model: FiniteElementModel, uneven: bool, name: tuple[object, ...] = name) -> Store:
                return stores(model, (*name, uneven))

            channel = DynamicChannel(part, rubber, case, MPI.COMM_SELF, prepared, temperature, stored)
            self._parts.append((rows, channel))
        self.model, self.active = self._parts[0][1].model, self._parts[0][1].active
        self.measured, self.scale = recording.force, np.ones(len(recording.force))

    @property
    @override
    def name(self) -> str:
        return self.recording.name

    @override
    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], limit: StepLimit | None = None
    ) -> ChannelForces:
        table, states = self.recording.table, []
        value = np.empty(len(table), dtype=np.complex128)
        slope = np.empty((len(table), len(names)), dtype=np.complex128)
        travel = np.empty(len(table))
        for rows, channel in self._parts:
            answer = channel.solve(parameters, names, limit)
            turn = np.exp(1j * table.loss_angle[rows])
            along, across = answer.force.reshape(2, -1)
            value[rows] = (along + 1j * across) * turn
            along, across = answer.slope.reshape(2, len(rows), -1)
            slope[rows] = (along + 1j * across) * turn[:, None]
            travel[rows] = answer.displacement[: len(rows)]
            states += [] if answer.states is None else [answer.states]
        curves = np.tile(travel, 2), self.recording.rows(value), self.recording.rows(slope)
        return ChannelForces(*curves, np.concatenate(states) if states else None)

    @override
    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        return answer.force, answer.slope

    @override
    def extent(self, temperature: float | None) -> Extent:
        return of_table(self.recording.table)


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
    recorded = []
    for table in dynamic_tables(case, tables):
        faulty = np.zeros(len(table), dtype=bool)
        for fault in table_faults(case.geometry, [table]):
            faulty |= fault.samples & (not fault.fatal)
        recorded.append(recorded_table(table, faulty))
    return tuple(recorded)
