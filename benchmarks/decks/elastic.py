"""Elastic curve of a bushing by third-order elements, solved at points of a range and interpolated by a spline."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from benchmarks.concealed.simulate import SHAPES
from benchmarks.concealed.truth import Specimen
from cases.mode import modes
from cases.simulate import Rubber, even_targets, is_odd, prepare, sweep
from forms.law import law
from geometry.shape import Refinement

Array = NDArray[np.float64]
Curve = Callable[[Array], Array]

# Steps on the longer side: the spline is within 1e-5 of the range (twice as many as the tool takes).
STEPS, SOLID_STEPS = 16, 10
# Factor on the recorded range, for effects that drive the bushing further than the recorded displacement.
ROOM = 1.1


def elastic(specimen: Specimen, mode: str, low: float, high: float) -> Curve:
    """Force as a function of displacement between two displacements (mm or rad), one on each side of rest."""
    key = tuple(sorted(specimen.dimensions.items())), tuple(sorted(specimen.parameters.items()))
    return _solution(specimen.shape, *key, specimen.law, specimen.bulk_modulus, mode, ROOM * low, ROOM * high)


@lru_cache(maxsize=8)
def _solution(
    shape: str,
    dimensions: tuple[tuple[str, float], ...],
    parameters: tuple[tuple[str, float], ...],
    name: str,
    bulk: float,
    mode: str,
    low: float,
    high: float,
) -> Curve:
    known = modes()[mode]
    solid = known.section is None
    body = SHAPES[True][shape](**dict[str, Any](dimensions))
    rubber = Rubber(law(name), dict(parameters), bulk)
    model = prepare(body, known, rubber, Refinement() if solid else Refinement(factor=1.5))
    odd = is_odd(body, known)
    if odd:
        low, high = 0.0, max(high, -low)
    history = sweep(model, even_targets(low, high, SOLID_STEPS if solid else STEPS))
    q, force = history.displacement, history.force
    if odd:
        q, first = np.unique(np.concatenate([q, -q]), return_index=True)
        force = np.concatenate([force, -force])[first]
    return CubicSpline(q, force)
