"""Force that a bushing loses after a first loading, as data of a force law with memory.

The model of Ogden and Roxburgh softens each point of the rubber below the largest energy that it has seen. In a motion
along one direction all points reach their largest energy together, at the largest displacement. The force therefore
depends on the displacement and on the largest displacement so far only, and simulations to several displacements and
back determine it.

References
----------
Ogden and Roxburgh (1999), A pseudo-elastic model for the Mullins effect in filled rubber, Proc. R. Soc. Lond. A
455:2861-2877, doi:10.1098/rspa.1999.0431.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.active import ActiveEffect

Array = NDArray[np.float64]
Simulate = Callable[[Array, Array, Sequence[ActiveEffect]], Array]

#: Number of largest displacements that are simulated, and points of unloading on each side of rest: the error is 0.26 %
#: (rms) of the force range for the bushing of docs/exports.md.
REACHED, POINTS = 6, 10
#: Points of the loading before it, whose force is known.
_THERE = 4


def softening(force: Simulate, mullins: ActiveEffect, grid: Array, virgin: Array) -> dict[str, Any]:
    """Return the force lost in unloading from several displacements, the data of `fmu.force_law.Softening`.

    Grid and virgin (n,) are displacement (mm or rad) and force (N or N mm) of first loadings; `force` simulates
    displacements along times (s) with effects that have a memory.
    """
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(grid, virgin)
    sign = 1.0 if grid[-1] >= -grid[0] else -1.0
    end, other = max(grid[-1], -grid[0]), min(grid[-1], -grid[0])
    share: Array = np.linspace(-1.0, 1.0, 2 * POINTS + 1, dtype=np.float64)
    curves: list[Array] = []
    amplitudes = end * np.linspace(0.0, 1.0, REACHED + 1)[1:]
    for largest in amplitudes:
        back = sign * largest * share[::-1]
        # On the other side only up to the bushing's largest displacement there.
        back = back[sign * back >= -other * (1.0 + 1e-9)]
        loading = np.linspace(0.0, sign * largest, _THERE, endpoint=False)
        q = np.concatenate([loading, back])
        simulated = force(q, np.linspace(0.0, 1.0, len(q), dtype=np.float64), [mullins])[_THERE:]
        lost = spline(back) - simulated
        lost[0] = 0.0  # at the turning point
        # Where one side was not reached, the force of the other one is mirrored.
        rising = slice(None, None, -int(sign))
        unloading, lost = (back / largest)[rising], lost[rising]
        same_side, mirrored = (np.interp(share, unloading, lost), -np.interp(-share, unloading, lost))
        curves.append(
            np.where((share >= unloading[0] - 1e-9) & (share <= unloading[-1] + 1e-9), same_side, mirrored)
        )
    return {
        "reached": amplitudes.tolist(),
        "share": share.tolist(),
        "lost": [lost.tolist() for lost in curves],
        "lost_slope": [CubicSpline(share, lost)(share, 1).tolist() for lost in curves],
    }
