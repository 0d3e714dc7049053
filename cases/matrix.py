"""The matrix of the tangent, without entries for constrained unknowns.

Prescribed values leave rows and columns of zeros, which a factorisation would take for entries and fill in. A third of
a bushing's unknowns lie on the sleeves: without their couplings the factorisation takes half the time.

Element matrices are added to an array of this rank's rows, those that belong to other ranks included; PETSc gets whole
rows of it, and sends the rows of other ranks to them.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from dolfinx.common import IndexMap
from dolfinx.cpp.la import SparsityPattern
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.kernels import loops, pointer

Array = NDArray[np.float64]
Index = NDArray[np.int32]


class Pattern:
    """Which unknowns are coupled, and where element matrices go.

    Parameters
    ----------
    rows
        DOLFINx's index map of the unknowns, in blocks of one.
    comm
        MPI communicator.
    cells
        Unknowns of cells, shape (cells, n), part by part.
    constrained
        Local numbers of the constrained unknowns, of other ranks too.

    Attributes
    ----------
    values : Array
        Entries of this rank's rows, to which element matrices are added, and one more for entries that are dropped.
    places : list of Index
        For each part, the position in `values` of each entry of its element matrices.
    """

    def __init__(self, rows: Any, comm: Any, cells: Sequence[Index], constrained: Index) -> None:
        self._rows, self._comm = rows, comm
        number = rows.size_local + rows.num_ghosts
        fixed = np.zeros(number, dtype=np.uint8)
        fixed[constrained] = 1
        self._cells, self._constrained, self._fixed = cells, constrained, fixed
        self._base = _coupled(number, cells, fixed)
        self._take(*self._base)

    def _take(self, start: Index, column: Index) -> None:
        """Take over couplings: first entry of each row, and columns."""
        self._start, self._column = start, column
        self.values = np.zeros(len(self._column) + 1)
        owned = self._constrained[self._constrained < self._rows.size_local]
        self._diagonal = self._start[owned]  # the only entry of its row
        self.places = [self._located(unknown, self._fixed) for unknown in self._cells]
        self._owned: tuple[Any, Any] | None = None
        self._keys: NDArray[np.int64] | None = None

    def bare(self) -> Pattern:
        """The cells' pattern, without any further couplings."""
        bare = copy(self)
        bare._take(*self._base)
        return bare

    def widened(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Pattern:
        """Return the pattern of the cells with further couplings, except those of negative or constrained numbers.

        Parameters
        ----------
        rows, columns : shape (n,)
            Local numbers of the unknowns that are coupled.
        """
        from scipy.sparse import csr_matrix  # takes 0.1 s: only where bodies touch

        wide = copy(self)
        free = self._free(rows, columns)
        there = np.ones(int(free.sum()), dtype=np.bool_)
        start, column = self._base
        shape = (len(start) - 1,) * 2
        base = csr_matrix((np.ones(len(column), dtype=np.bool_), column, start), shape=shape)
        coupled = (base + csr_matrix((there, (rows[free], columns[free])), shape=shape)).tocsr()
        coupled.sort_indices()
        wide._take(coupled.indptr.astype(np.int32), coupled.indices.astype(np.int32))
        return wide

    def holds(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> bool:
        """Return whether all couplings that are needed are in the pattern.

        Parameters
        ----------
        rows, columns : shape (n,)
            Local numbers of the unknowns that are coupled; negative or constrained ones need no place.
        """
        keys = self._key(rows, columns)[self._free(rows, columns)]
        return bool(np.all(self._numbers[self._found(keys)] == keys))

    def add(self, rows: NDArray[np.int64], columns: NDArray[np.int64], entries: Array) -> None:
        """Add entries to `values`, except those of constrained unknowns and of negative numbers.

        Parameters
        ----------
        rows, columns : shape (n,)
            Local numbers of the unknowns that are coupled; each pair is in the pattern.
        entries : Array
            Numbers to add, shape (n,), in the unit of the tangent (N/mm for displacements).
        """
        free = self._free(rows, columns)
        place = self._found(self._key(rows, columns)[free])
        self.values[:-1] += np.bincount(place, entries[free], minlength=len(self._column))

    def _free(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.bool_]:
        fixed = self._fixed
        return np.asarray((rows >= 0) & (columns >= 0) & (fixed[rows] == 0) & (fixed[columns] == 0))

    def _key(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.asarray(rows * np.int64(len(self._fixed)) + columns)

    @property
    def _numbers(self) -> NDArray[np.int64]:
        """Keys of the entries, in order."""
        if self._keys is None:
            rows = np.repeat(np.arange(len(self._start) - 1), np.diff(self._start))
            self._keys = self._key(rows, self._column.astype(np.int64))
        return self._keys

    def _found(self, keys: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.minimum(np.searchsorted(self._numbers, keys), len(self._column) - 1)

    def matrix(self) -> PETSc.Mat:
        """Return a new matrix, which ignores entries outside of the pattern."""
        rows = self._rows
        matrix = PETSc.Mat().create(self._comm)
        matrix.setSizes([(rows.size_local, None)] * 2)
        matrix.setType(PETSc.Mat.Type.AIJ)
        self.shape(matrix)
        matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATIONS, False)
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        matrix.setOption(PETSc.Mat.Option.SYMMETRY_ETERNAL, True)
        return matrix

    def shape(self, matrix: PETSc.Mat) -> None:
        """Give a matrix this pattern."""
        rows = self._rows
        everything = np.arange(rows.size_local + rows.num_ghosts, dtype=np.int32)
        numbering = PETSc.LGMap().create(
            rows.local_to_global(everything).astype(PETSc.IntType), comm=self._comm
        )
        if self._owned is None and self._comm.size == 1:
            self._owned = (self._start, self._column)
        if self._owned is None:
            # Entries from other ranks are known only after an assembly.
            matrix.setLGMap(numbering, numbering)
            matrix.setUp()
            self.values[:] = 0.0
            self.add_to(matrix)
            matrix.assemble()
            self._owned = matrix.getValuesCSR()[:2]
        else:
            matrix.setPreallocationCSR(self._owned)
            matrix.setLGMap(numbering, numbering)

    def add_to(self, matrix: PETSc.Mat) -> None:
        """Add `values` to a matrix, and ones on the diagonal of constrained unknowns."""
        self.values[self._diagonal] = 1.0
        matrix.setValuesLocalCSR(self._start, self._column, self.values[:-1], PETSc.InsertMode.ADD_VALUES)

    def _located(self, unknown: Index, fixed: NDArray[np.uint8]) -> Index:
        cells, n = unknown.shape
        place = np.empty((cells, n, n), dtype=np.int32)
        loops().lib.locate(
            cells,
            n,
            pointer(unknown, "int32_t"),
            pointer(fixed, "uint8_t"),
            pointer(self._start, "int32_t"),
            pointer(self._column, "int32_t"),
            len(self._column),
            pointer(place, "int32_t"),
        )
        return place


def _coupled(number: int, cells: Sequence[Index], fixed: NDArray[np.uint8]) -> tuple[Index, Index]:
    """First entry of each row, and columns, of the free unknowns' couplings and of all diagonals."""
    everything = IndexMap(MPI.COMM_SELF, number)
    pattern = SparsityPattern(MPI.COMM_SELF, [everything, everything], [1, 1])
    for unknown in cells:
        for row in unknown:
            free = row[fixed[row] == 0]
            pattern.insert(free, free)
    pattern.insert_diagonal(np.arange(number, dtype=np.int32))
    pattern.finalize()
    column, start = pattern.graph
    return start.astype(np.int32), column.astype(np.int32)
