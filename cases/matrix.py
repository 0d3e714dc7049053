"""The tangent's matrix, without what couples to constrained unknowns.

Prescribed values leave rows and columns of zeros, which a factorisation would take for entries and fill in. A third of
a bushing's unknowns lie on the sleeves: without their couplings the factorisation takes half the time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from geometry.dolfinx_api import column_map


def reduced_matrix(form: Any, constrained: NDArray[np.int32]) -> PETSc.Mat:
    """Matrix for a compiled symmetric form in which constrained unknowns have nothing but their diagonal.

    Other entries that are added to their rows and columns are ignored.

    Parameters
    ----------
    form
        Of rank 2, on a space without blocks (a mixed one).
    constrained
        Local indices of the constrained unknowns that this rank owns.
    """
    rows = form.function_spaces[0].dofmap.index_map
    comm = form.mesh.comm
    pattern = fem.create_sparsity_pattern(form)
    pattern.finalize()
    edges, starts = pattern.graph
    row = np.repeat(np.arange(rows.size_local), np.diff(starts[: rows.size_local + 1]))
    column = edges[: len(row)]
    columns = column_map(pattern)
    number = columns.local_to_global(np.arange(columns.size_local + columns.num_ghosts, dtype=np.int32))
    fixed = PETSc.Vec().createMPI((rows.size_local, None), comm=comm)
    fixed.array_w[constrained] = 1.0
    free_row, free_column = fixed.array_r == 0.0, _values(fixed, number) == 0.0
    fixed.destroy()
    keep = (free_row[row] & free_column[column]) | (number[column] == rows.local_range[0] + row)
    ends = np.cumsum(np.bincount(row[keep], minlength=rows.size_local))
    csr = np.append(0, ends).astype(PETSc.IntType), number[column[keep]].astype(PETSc.IntType)
    matrix = PETSc.Mat().create(comm)
    matrix.setSizes([(rows.size_local, None)] * 2)
    matrix.setType(PETSc.Mat.Type.AIJ)
    matrix.setPreallocationCSR(csr)
    everything = np.arange(rows.size_local + rows.num_ghosts, dtype=np.int32)
    numbering = PETSc.LGMap().create(rows.local_to_global(everything).astype(PETSc.IntType), comm=comm)
    matrix.setLGMap(numbering, numbering)
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATIONS, False)
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    matrix.setOption(PETSc.Mat.Option.SYMMETRY_ETERNAL, True)
    return matrix


def _values(vector: PETSc.Vec, entries: NDArray[np.int64]) -> NDArray[np.float64]:
    """Entries of a distributed vector, by global index."""
    index = PETSc.IS().createGeneral(entries.astype(PETSc.IntType), comm=PETSc.COMM_SELF)
    local = PETSc.Vec().createSeq(len(entries))
    scatter = PETSc.Scatter().create(vector, index, local, None)
    scatter.scatter(vector, local)
    values = local.array_r.copy()
    for item in (scatter, local, index):
        item.destroy()
    return values
