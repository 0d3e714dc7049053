"""Variations of an energy from its collapsed derivatives (`forms.chain`), to compare with ``ufl.derivative``."""

from __future__ import annotations

from collections.abc import Sequence

import ufl

from forms.chain import collapse
from forms.law import Scalar


def first_variation(density: Scalar, measures: Sequence[Scalar], w: Scalar, v: Scalar) -> Scalar:
    """Derivative of an energy density with respect to ``w`` in the direction ``v``."""
    return sum(slope * _along(y, w, v) for y, slope in collapse(density, measures, w).slopes())


def second_variation(density: Scalar, measures: Sequence[Scalar], w: Scalar, v: Scalar, dw: Scalar) -> Scalar:
    """Derivative of `first_variation` with respect to ``w`` in the direction ``dw``; symmetric."""
    collapsed = collapse(density, measures, w)
    total = ufl.as_ufl(0)
    for a, (y, slope) in enumerate(collapsed.slopes()):
        dy = _along(y, w, v)
        total += dy * sum(collapsed.curvature(a, b) * _along(z, w, dw) for b, z in enumerate(collapsed.y))
        total += slope * ufl.derivative(dy, w, dw)
    return total


def _along(measure: Scalar, w: Scalar, v: Scalar) -> Scalar:
    return ufl.derivative(measure.expression(), w, v)
