"""Cache of finite-element models, from one run of a diagnosis to the next.

A diagnosis runs the same few models many times with other values. Meshing a body and deriving its forms takes as long
as half a march, so that models that differ only in values share one body. Effects of the rig change nothing in the
body: all of them share that of the law alone.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, TypeVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from bushcli.inverse.channel import MeshCorrection
from bushcli.inverse.dynamic_simulation import Store
from bushcli.inverse.table_channel import AnyChannel, TableChannel, recorded_tables
from bushcli.inverse.task import Task
from bushcli.recording.dynamic.rows import RecordedTable, recorded_table
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.recording.table_cache import TableCache
from bushcli.runtime.canonical import canonical
from bushcli.simulate.predict import rubber_of
from bushcli.simulate.recording_cache import RecordingCache
from cases.feature import Installed
from cases.march import TOLERANCE
from cases.mode import Mode
from cases.model import FiniteElementModel
from cases.simulate import Prepare, Rubber, prepare
from geometry.shape import Refinement, Shape

T = TypeVar("T")
Array = NDArray[np.float64]
Coarse = Literal["never", "memory", "always"]

# Tolerances of marches (`cases.march`) whose forces compare models. In practice p06 and in the development deck's 024
# (axial and radial) the first changed no force by more than 1e-6 of its range and no derivative by more than 4e-4 of
# its largest value, the second by 5e-6 and 3e-3: noise is 1e-3. In three dimensions a march takes two thirds of the
# time, or half.
COMPARED, ESTIMATED = 1e-6, 1e-5

# Numbers of bodies and of sets of channels that are cached: of the law and of the current effect, for three channels.
BODIES, SETS = 12, 6
# Tables, temperatures and bodies whose reduced matrices are cached: three tables at three temperatures with two bodies.
STORES = 18


class ModelCache:
    """Finite-element models of a diagnosis, those used least recently discarded; they serve one thread at a time.

    Parameters
    ----------
    tables : TableCache, optional
        Cache of the binary files that the caller reads.
    """

    def __init__(self, tables: TableCache | None = None) -> None:
        self.measured = RecordingCache(tables)
        self.tables = self.measured.tables
        self._bodies: OrderedDict[bytes, FiniteElementModel] = OrderedDict()
        self._sets: OrderedDict[bytes, list[AnyChannel]] = OrderedDict()
        # Each with its body, whose name another one could get.
        self._vibrating: OrderedDict[bytes, tuple[FiniteElementModel, Store]] = OrderedDict()
        self._corrections: OrderedDict[bytes, dict[str, MeshCorrection]] = OrderedDict()
        self._recorded: OrderedDict[bytes, tuple[RecordedTable, ...]] = OrderedDict()

    def channels(
        self,
        task: Task,
        fineness: float = 1.0,
        coarse: Coarse = "never",
        anchor: Mapping[str, float] | None = None,
        tolerance: float = TOLERANCE,
    ) -> list[AnyChannel]:
        """Channels of a task, for any values of its parameters: recordings along a path, then tables of stiffness.

        Every solution has to be given all values, because a cached model still has the values of its previous use.

        Parameters
        ----------
        task : Task
        fineness : float
            Factor on the default number of steps of a march.
        coarse
            Which bodies get a coarse mesh: none, those with memory, or all. With "memory", half-plane bodies in which
            an effect of assembly acts keep the default mesh, which costs little more there: it may act on a part of a
            bond.
        anchor : mapping of str to float, optional
            Parameters of the law alone (MPa or dimensionless) at which the force of a coarse body is corrected to that
            of the default mesh.
        tolerance : float
            Of the marches and sweeps (`cases.march.march`), a ratio.
        """
        whole = replace(task.case, effects=())
        name = canonical((whole, _law(task), _structure(task.effects), fineness, coarse, anchor, tolerance))

        def made() -> list[AnyChannel]:
            modes: set[str] = set()
            # Never distributed among ranks: those of `mpirun` run the fits of a diagnosis side by side.
            prepared = self.bodies(task, coarse, modes)

            def mesh_correction(channel: str, model: FiniteElementModel) -> MeshCorrection | None:
                if anchor is None or model.mode.name not in modes:
                    return None
                # A bond that may end anywhere has a mesh of its own.
                bonds = [a.off() for a in task.effects if any(i.feature.released for i in features_of([a]))]
                bonded = replace(whole, effects=tuple(bonds))
                plain = replace(task, case=bonded, start=anchor, fixed=tuple(anchor))
                return self._mesh_corrections(plain, anchor)[channel]

            recorded = self.recorded_tables(whole)
            known = replace(task, tables=tuple(recording.table for recording in recorded))
            channels, _ = known.channels(
                comm=MPI.COMM_SELF, prepared=prepared, measured=self.measured, corrected=mesh_correction
            )
            for channel in channels:
                if (fineness, tolerance) != (1.0, TOLERANCE):
                    channel.plan(fineness, tolerance)
            rubber = rubber_of(task.material)
            vibrating = [
                TableChannel(recording, rubber, task.case, prepared, self._stores) for recording in recorded
            ]
            return [*channels, *vibrating]

        return _entry(self._sets, SETS, name, made)

    def recorded_tables(self, case: Case) -> tuple[RecordedTable, ...]:
        """Return the tables of dynamic stiffness of a case; those that count and those held out are kept."""
        name = canonical((case.geometry, case.dynamic))
        return _entry(self._recorded, 2, name, lambda: recorded_tables(case, self.tables))

    def dynamic_stiffness(
        self, task: Task, table: DynamicTable, values: Mapping[str, float], names: Sequence[str]
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Return K* (n,) of the rows of a table that need not have been measured, and its derivatives (n, names).

        Parameters
        ----------
        task : Task
        table : DynamicTable
            N/mm or N mm/rad, of which the conditions count alone.
        values : mapping of str to float
            Of all parameters by name, N, mm, MPa, s.
        names : sequence of str
            Parameters by which derivatives are wanted.

        Raises
        ------
        NotConverged
        """
        recorded = recorded_table(table)
        channel = TableChannel(recorded, rubber_of(task.material), task.case, self.bodies(task), self._stores)
        answer = channel.solve(values, names)
        slopes = np.array([recorded.stiffness(slope) for slope in answer.slope.T], dtype=np.complex128)
        return recorded.stiffness(answer.force), slopes.reshape(-1, len(table)).T

    def _stores(self, model: FiniteElementModel, name: tuple[object, ...]) -> Store:
        """Return the reduced matrices of channels of a body."""
        return _entry(self._vibrating, STORES, canonical((id(model), name)), lambda: (model, {}))[1]

    def _mesh_corrections(self, plain: Task, anchor: Mapping[str, float]) -> dict[str, MeshCorrection]:
        """Return the corrections of the force of a coarse mesh to the default one, by channel.

        They are computed for the law alone, at its parameters `anchor`, with the effects of the task off. A coarse mesh
        is too stiff by a factor that hardly depends on the rubber's memory; the difference that the factor leaves is
        added as it is.
        """

        def made() -> dict[str, MeshCorrection]:
            corrections = {}
            meshes = self.channels(plain), self.channels(plain, coarse="always")
            off = {
                active.full_name(p): active.values[p.name]
                for active in plain.effects
                for p in active.parameters
            }
            for pair in zip(*meshes, strict=True):
                exact, rough = (
                    channel.at_samples(channel.solve({**anchor, **off}, ()))[0] for channel in pair
                )
                share = float(rough @ exact) / max(float(rough @ rough), 1e-300)
                corrections[pair[0].name] = MeshCorrection(share, exact - share * rough)
            return corrections

        return _entry(self._corrections, SETS, canonical((plain.case, _law(plain), dict(anchor))), made)

    def bodies(self, task: Task, coarse: Coarse = "never", modes: set[str] | None = None) -> Prepare:
        """Return a function like `cases.simulate.prepare` for the law and effects of a task, with cached bodies.

        It adds the modes that get a coarse mesh to `modes`.

        Parameters
        ----------
        task : Task
        coarse : {"never", "memory", "always"}
        modes : set of str, optional
        """

        def body(
            shape: Shape,
            mode: Mode,
            rubber: Rubber,
            refinement: Refinement,
            comm: MPI.Comm,
            features: Sequence[Installed] = (),
        ) -> FiniteElementModel:
            solid = mode.section is None or not shape.axisymmetric
            remembers = any(item.feature.branches is not None for item in features)
            acting = [active for active in task.effects if active.name in {item.name for item in features}]
            assembled = any(active.effect.acts == "assembly" for active in acting)
            if coarse == "always" or (coarse == "memory" and remembers and (solid or not assembled)):
                refinement = shape.coarse
                if modes is not None:
                    modes.add(mode.name)
            rest = mode.solid.six, _law(task), rubber.bulk_modulus, refinement, _structure(acting)
            name = canonical((shape, mode.name, *rest))
            return _entry(
                self._bodies, BODIES, name, lambda: prepare(shape, mode, rubber, refinement, comm, features)
            )

        return body


def _entry(store: OrderedDict[bytes, T], most: int, name: bytes, make: Callable[[], T]) -> T:
    """Return the entry of that name, made if missing; the least recently used one is discarded."""
    if name not in store:
        store[name] = make()
        if len(store) > most:
            store.popitem(last=False)
    store.move_to_end(name)
    return store[name]


def _law(task: Task) -> tuple[str, tuple[str, ...]]:
    return task.law.name, tuple(task.material.parameters)


def _structure(active: Sequence[ActiveEffect]) -> list[Any]:
    """Return all that distinguishes effects except values: their names, parameters, and influence on the mesh."""
    return [
        (
            effect.name,
            effect.channels,
            [(p.name, effect.values[p.name] if p.of_mesh else None) for p in effect.parameters],
        )
        for effect in active
    ]
