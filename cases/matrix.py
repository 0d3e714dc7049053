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

# Place of an entry that a pattern has no room for.
MISSING = -1


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
        self._base = _couplings(number, cells, fixed)
        self._take(*self._base)

    def _take(self, start: Index, column: Index) -> None:
        """Store the couplings: index of each row's first entry, and the columns."""
        self._start, self._column = start, column
        self.values = np.zeros(len(self._column) + 1)
        owned = self._constrained[self._constrained < self._rows.size_local]
        self._diagonal = self._start[owned]  # the only entry of its row
        self.places = [self.locate(unknown) for unknown in self._cells]
        self._owned: tuple[Any, Any] | None = None
        self._sharing: PETSc.Mat | None = None

    def bare(self) -> Pattern:
        """The cells' pattern, without any further couplings."""
        bare = copy(self)
        bare._take(*self._base)
        return bare

    def widen(self, blocks: Sequence[Index]) -> Pattern:
        """Return the pattern of the cells with further couplings, except those of negative or constrained numbers.

        Parameters
        ----------
        blocks : sequence of shape (b, n)
            Local numbers of unknowns; all of a block are coupled with each other.
        """
        from scipy.sparse import csr_matrix  # takes 0.1 s: only where bodies touch

        wide = copy(self)
        start, column = self._base
        shape = (len(start) - 1,) * 2
        coupled = csr_matrix((np.ones(len(column), dtype=np.bool_), column, start), shape=shape)
        for unknowns in blocks:
            n = unknowns.shape[1]
            rows, columns = np.repeat(unknowns, n, axis=1).ravel(), np.tile(unknowns, (1, n)).ravel()
            free = (rows >= 0) & (columns >= 0) & (self._fixed[rows] == 0) & (self._fixed[columns] == 0)
            ones = np.ones(int(free.sum()), dtype=np.bool_)
            coupled = coupled + csr_matrix((ones, (rows[free], columns[free])), shape=shape)
        coupled.sort_indices()
        wide._take(coupled.indptr.astype(np.int32), coupled.indices.astype(np.int32))
        return wide

    def add(self, places: Index, entries: Array) -> None:
        """Add entries to `values`.

        Parameters
        ----------
        places : Index
            Places of the entries, from `locate`; none is missing.
        entries : Array
            Numbers to add, of the same shape, in the unit of the tangent (N/mm for displacements).
        """
        self.values += np.bincount(places.ravel(), entries.ravel(), minlength=len(self.values))

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
        if self._comm.size > 1:
            matrix.setValuesLocalCSR(self._start, self._column, self.values[:-1], PETSc.InsertMode.ADD_VALUES)
            return
        if self._sharing is None:
            # A matrix whose entries are `values`: PETSc then need not search the place of each.
            arrays = (self._start, self._column, self.values[:-1])
            self._sharing = PETSc.Mat().createAIJWithArrays(self._rows.size_local, arrays, comm=self._comm)
        matrix.axpy(1.0, self._sharing, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)

    def locate(self, unknowns: Index) -> Index:
        """Return the position in `values` of each entry of blocks.

        Parameters
        ----------
        unknowns : shape (b, n)
            Local numbers of the unknowns of each block; negative or constrained ones have no entries.

        Returns
        -------
        shape (b, n, n)
            The last position of `values` for entries that are dropped, `MISSING` where the pattern has none.
        """
        blocks, n = unknowns.shape
        place = np.empty((blocks, n, n), dtype=np.int32)
        loops().lib.locate(
            blocks,
            n,
            pointer(unknowns, "int32_t"),
            pointer(self._fixed, "uint8_t"),
            pointer(self._start, "int32_t"),
            pointer(self._column, "int32_t"),
            len(self._column),
            MISSING,
            pointer(place, "int32_t"),
        )
        return place


def _couplings(number: int, cells: Sequence[Index], fixed: NDArray[np.uint8]) -> tuple[Index, Index]:
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
