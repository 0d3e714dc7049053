"""What a bushing has lost of its force after a first loading, as a force law with memory takes it.

The model of Ogden and Roxburgh softens each point of the rubber below the largest energy that it has seen. Along one
direction of motion all points reach theirs together, at the largest displacement, so that the force depends on the
displacement and on the largest one so far: simulations to several displacements and back give all of it.

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

#: Largest displacements that are simulated, and points of the way back on each side of rest: they leave 0.26 % (rms) of
#: the force range on the bushing of docs/exports.md.
REACHED, POINTS = 6, 10
#: Points of the way there: its force is known.
_THERE = 4


def softening(force: Simulate, mullins: ActiveEffect, grid: Array, virgin: Array) -> dict[str, Any]:
    """Return what the way back from several displacements has lost, the data of `fmu.force_law.Softening`.

    Parameters
    ----------
    force : callable
        Displacements (mm or rad), times (s) and effects with memory -> force (N or N mm).
    mullins : ActiveEffect
    grid, virgin : (n,) array
        Displacement and force of first loadings, mm or rad and N or N mm.
    """
    from scipy.interpolate import CubicSpline

    first = CubicSpline(grid, virgin)
    sign = 1.0 if grid[-1] >= -grid[0] else -1.0
    end, other = max(grid[-1], -grid[0]), min(grid[-1], -grid[0])
    share: Array = np.linspace(-1.0, 1.0, 2 * POINTS + 1, dtype=np.float64)
    curves: list[Array] = []
    reached = end * np.linspace(0.0, 1.0, REACHED + 1)[1:]
    for largest in reached:
        back = sign * largest * share[::-1]
        # As far to the other side as the bushing goes there.
        back = back[sign * back >= -other * (1.0 + 1e-9)]
        there = np.linspace(0.0, sign * largest, _THERE, endpoint=False)
        q = np.concatenate([there, back])
        simulated = force(q, np.linspace(0.0, 1.0, len(q), dtype=np.float64), [mullins])[_THERE:]
        lost = first(back) - simulated
        lost[0] = 0.0  # where it turns
        curves.append(_both_sides(back / largest, lost, share))
    return {
        "reached": reached.tolist(),
        "share": share.tolist(),
        "lost": [lost.tolist() for lost in curves],
        "lost_slope": [CubicSpline(share, lost)(share, 1).tolist() for lost in curves],
    }


def _both_sides(at: Array, lost: Array, share: Array) -> Array:
    """Return the force lost at all shares; where the other side was not reached, that of this side, turned round."""
    order = np.argsort(at)
    own = np.interp(share, at[order], lost[order])
    mirrored = -np.interp(-share, at[order], lost[order])
    there = (share >= at.min() - 1e-9) & (share <= at.max() + 1e-9)
    return np.where(there, own, mirrored)
