"""Where entries go in the matrix of the tangent."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx.common import IndexMap
from mpi4py import MPI

from cases.matrix import MISSING, Pattern

# Two cells of three unknowns, which share unknown 2; unknown 4 is constrained, 5 belongs to no cell.
CELLS = np.array([[0, 1, 2], [2, 3, 4]], dtype=np.int32)
CONSTRAINED = np.array([4], dtype=np.int32)


@pytest.fixture
def pattern():
    return Pattern(IndexMap(MPI.COMM_SELF, 6), MPI.COMM_SELF, [CELLS], CONSTRAINED)


def dense(pattern):
    """Return the matrix of the pattern's values."""
    matrix = pattern.matrix()
    pattern.add_to(matrix)
    matrix.assemble()
    return matrix.convert("dense").getDenseArray().copy()


def test_entries_are_dropped_added_or_missing(pattern):
    """Dropped for constrained and rigid (negative) unknowns; missing where no cell couples two unknowns."""
    places = pattern.locate(np.array([[0, 3, 4], [2, -1, 1]], dtype=np.int32))
    dropped = len(pattern.values) - 1
    assert places[0, 0, 1] == places[0, 1, 0] == MISSING
    assert (places[0, 2] == dropped).all()
    assert (places[1, 1] == dropped).all()
    assert (places[1, [0, 0, 2, 2], [0, 2, 0, 2]] < dropped).all()


def test_a_wider_pattern_holds_further_couplings(pattern):
    block = np.array([[0, 3, 5]], dtype=np.int32)
    wide = pattern.widen([block])
    places = wide.locate(block)
    assert (places != MISSING).all()
    wide.values[:] = 0.0
    wide.add(places, np.arange(1.0, 10.0).reshape(1, 3, 3))
    wide.add(places, np.arange(1.0, 10.0).reshape(1, 3, 3))
    found = dense(wide)
    np.testing.assert_array_equal(found[np.ix_(block[0], block[0])], 2.0 * np.arange(1.0, 10.0).reshape(3, 3))
    assert found[4, 4] == 1.0
    assert (pattern.locate(block) == MISSING).any()
