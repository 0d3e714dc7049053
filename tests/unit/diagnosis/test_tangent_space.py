"""Which conditions hold an optimum: the nearest point that meets all, among those on any of their intersections."""

from __future__ import annotations

from itertools import chain, combinations

import numpy as np
import pytest

from bushcli.selection.tangent_space import Cuts, tangent_space

ROWS, PARAMETERS, CONDITIONS = 12, 3, 5


@pytest.mark.parametrize("seed", range(40))
def test_the_conditions_that_hold_the_optimum_are_those_of_the_least_misfit(seed):
    rng = np.random.default_rng(seed)
    slopes, misfit = rng.standard_normal((ROWS, PARAMETERS)), 3.0 * rng.standard_normal(ROWS)
    none = np.zeros(PARAMETERS)
    space = tangent_space(misfit, slopes, np.ones(PARAMETERS, dtype=bool), none, none)
    # At the parameters themselves all conditions are met.
    cuts = Cuts(rng.standard_normal((CONDITIONS, PARAMETERS)), rng.uniform(0.0, 0.5, CONDITIONS))
    further = rng.standard_normal(ROWS)
    held = space.active(cuts, further)

    def end(chosen):
        at = space.within(cuts.only(chosen)) if chosen else space
        x = at.optimum(further)
        return x, float(np.sum((misfit + slopes @ x + further) ** 2))

    subsets = chain.from_iterable(combinations(range(CONDITIONS), n) for n in range(PARAMETERS + 1))
    met = [size for x, size in map(end, subsets) if (cuts.values + cuts.slopes @ x > -1e-9).all()]
    x, size = end(held)
    assert (cuts.values + cuts.slopes @ x > -1e-9).all()
    assert size == pytest.approx(min(met), rel=1e-9)
