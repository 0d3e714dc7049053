"""The same force under `mpirun` as on one process."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
# Every kind of mesh and constraint: half-plane, solid cut at two planes, elastic sleeves (idle pressures), a full turn.
SCRIPT = textwrap.dedent(
    """
    import json
    import sys
    import numpy as np
    from mpi4py import MPI
    from bushcli.effects.library import viscoelasticity
    from bushcli.effects.library.swaging import feature
    from cases.feature import Installed
    from cases.march import NotConverged, march
    from cases.mode import modes
    from cases.program import ramp
    from cases.rigid import tangent
    from cases.simulate import Rubber, prepare, sweep
    from cases.six import SixPath
    from forms.law import law
    from geometry.shape import Refinement, Sleeve, shapes

    yeoh = Rubber(law("yeoh"), {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
    gent = Rubber(law("gent"), {"mu": 1.0, "Jm": 1.0}, 2000.0)
    coarse = Refinement(across=2, along=6, around=8)
    dimensions = {"inner_radius": 12.0, "outer_radius": 22.0, "length": 40.0}
    rigid = shapes()["plain"](**dimensions)
    elastic = shapes()["plain"](**dimensions, inner_sleeve=Sleeve(thickness=2.0), outer_sleeve=Sleeve(thickness=2.0))
    ends = Sleeve(thickness=2.0, grip="ends")
    result, all_models = {}, sys.argv[1] == "all"
    # A sleeve that is swaged, of which some ranks have no held boundary.
    swaged = prepare(
        shapes()["plain"](**dimensions, outer_sleeve=ends), modes()["axial"], yeoh, coarse,
        features=[Installed("swaging", feature(), {"reduction": 0.3})],
    )
    history = march(swaged, ramp(1.0, 2), tolerance=1e-11, sensitivity=("swaging.reduction",))
    result["swaged"] = [history.force.tolist(), history.sensitivity.ravel().tolist()]
    # A clock that the strain drives; a sleeve so fine that a rank may have no rubber.
    thick = shapes()["plain"](**dimensions, outer_sleeve=Sleeve(thickness=8.0))
    values = {"g1": 0.3, "tau1": 1.0, "exponent": 3.0}
    activated = [Installed("viscoelasticity", viscoelasticity.feature(), values)]
    model = prepare(thick, modes()["axial"], yeoh, Refinement(across=1, along=1), features=activated)
    history = march(model, ramp(4.0, 2), tolerance=1e-11, sensitivity=("viscoelasticity.exponent",))
    result["clock"] = [history.force.tolist(), history.sensitivity.ravel().tolist()]
    for name, shape, mode, end in (
        ("axial", rigid, "axial", 4.0),
        ("radial", rigid, "radial", 2.0),
        ("sleeves", elastic, "radial", 1.0),
        ("conical", rigid, "conical", 0.05),
    ):
        if not all_models and name != "sleeves":
            continue
        model = prepare(shape, modes()[mode], yeoh, coarse)
        history = march(model, ramp(end, 2), tolerance=1e-11, sensitivity=("C10", "compliance"))
        result[name] = [history.force.tolist(), history.energy.tolist(), history.sensitivity.ravel().tolist()]
        # What the factorisation's count of negative eigenvalues, which is of all ranks, is compared with.
        result[name].append([model.system.free_pressures])
    # Six motions, two of them free, and their tangent.
    pose = np.array([0.8, 0.0, 2.0, 0.03, 0.0, 0.1])
    six = SixPath(np.array([0.0, 1.0]), np.array([np.zeros(6), pose]), free=(1, 4), whole=True)
    model, found = prepare(rigid, modes()["path"].follow(six), yeoh, coarse), []

    def observe(solver):
        solver.factorise()
        found.append(tangent(model, solver.factor, solver.q).symmetric.ravel().tolist())

    if all_models:
        history = march(model, ramp(1.0, 2), tolerance=1e-11, sensitivity=("C10",), observer=observe)
        result["six"] = [history.reactions[-1].tolist(), history.motion[-1].tolist(), found[-1],
                         history.reaction_sensitivity[-1].ravel().tolist()]
    # Every rank must see the failure.
    try:
        march(prepare(rigid, modes()["torsional"], gent, coarse), ramp(1.0, 4))
        stopped = False
    except NotConverged:
        stopped = True
    result["stopped"] = MPI.COMM_WORLD.allreduce(int(stopped))
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(result | {"size": MPI.COMM_WORLD.size}))
    """
)


def run(models, *launcher):
    # More processes than processors: as Open MPI 4 and 5 call it.
    environment = os.environ | {
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
        "OMPI_MCA_mpi_yield_when_idle": "1",
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(
        [*launcher, sys.executable, "-c", SCRIPT, models],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("mpirun") is None, reason="there is no mpirun on the PATH")
@pytest.mark.parametrize(("ranks", "models"), [(2, "all"), (3, "with sleeves")])
def test_several_processes_find_the_force_of_one(ranks, models):
    """With three, some have no rubber, or no boundary that is held: models with sleeves are for them."""
    alone, together = run(models), run(models, "mpirun", "-n", str(ranks))
    assert (alone.pop("size"), together.pop("size")) == (1, ranks)
    assert (alone.pop("stopped"), together.pop("stopped")) == (1, ranks)
    for name in alone:
        for one, two in zip(alone[name], together[name], strict=True):
            np.testing.assert_allclose(two, one, rtol=1e-8, atol=1e-8 * np.abs(one).max(), err_msg=name)
