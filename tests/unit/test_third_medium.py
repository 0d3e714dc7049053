"""The third medium of the benchmark: no energy at rest, and a gap that it closes and presses through."""

from __future__ import annotations

import dolfinx
import numpy as np
import pytest
import ufl
from mpi4py import MPI

from benchmarks.medium import CURVATURES, MEDIUM, RUBBER, Medium, Problem, march_path, medium_energy
from benchmarks.third_medium import knee


@pytest.fixture(scope="module")
def strip():
    """Two blocks of rubber of 1 by 1 mm with a gap of 0.2 mm between them, all in one mesh."""
    mesh = dolfinx.mesh.create_rectangle(MPI.COMM_SELF, [[0, 0], [2.2, 1]], [11, 3])
    count = mesh.topology.index_map(2).size_local
    middle = dolfinx.mesh.compute_midpoints(mesh, 2, np.arange(count, dtype=np.int32))[:, 0]
    tags = np.where(abs(middle - 1.1) < 0.1, MEDIUM, RUBBER).astype(np.int32)
    return mesh, dolfinx.mesh.meshtags(mesh, 2, np.arange(count, dtype=np.int32), tags)


@pytest.mark.parametrize("variant", CURVATURES)
def test_a_medium_at_rest_has_no_energy(strip, variant):
    mesh, _ = strip
    u = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh, ("P", 2, (2,))))
    energy = dolfinx.fem.form(medium_energy(u, 1e-4, 1e-3, variant) * ufl.dx)
    assert dolfinx.fem.assemble_scalar(energy) == pytest.approx(0.0, abs=1e-15)
    u.interpolate(lambda x: np.vstack([-0.1 * x[0] ** 2, 0 * x[1]]))
    assert dolfinx.fem.assemble_scalar(energy) > 1e-6


def test_a_gap_closes_and_transfers_force(strip):
    """The blocks are free to expand sideways along y = 1 alone: hardly any force before 0.2 mm, and much after it."""
    left, right = (lambda x, end=end: np.isclose(x[0], end) for end in (0.0, 2.2))
    held = [(left, 0, 1.0), (right, 0, 0.0), (lambda x: np.isclose(x[1], 0.0), 1, 0.0)]
    problem, force = Problem(*strip, Medium(1e-4, 1.0), held), []
    tried, cut = march_path(problem, [0.1, 0.15, 0.3, 0.4], lambda: force.append(problem.reaction()))
    assert len(force) == 4
    assert tried - cut >= 4
    assert 0 < force[1] < 0.01
    # Plane strain: Young's modulus over 1 - nu^2 is 4 mu, and 0.1 mm on 2 mm are 5 %.
    assert force[2] == pytest.approx(4 * 0.05, rel=0.15)
    assert 1.5 < force[3] / force[2] < 2.5


def test_the_knee_is_where_two_lines_meet():
    q = 0.2 * np.arange(1, 7)
    assert knee(6.8 * q + 6.0 * np.maximum(q - 0.8, 0)) == pytest.approx(0.8)
