"""Numbers of steps of a march, from which the curve between the steps follows as a cubic spline."""

from __future__ import annotations

from geometry.shape import Shape

# Of a recording that `direct` simulates, on the longer side of its range: exact to 0.01 % of the force.
RECORDED = 16
# Of a law alone in the half-plane, where steps cost little: with 8 and the tolerance of comparisons its fit in foreign
# 027 ended at other values beside the edge of stability, and the fit of the right effect did not converge.
IDENTIFIED = 12
# Of a fitted curve without memory: with 8 steps (6 for a solid body, which is moved less far) it is within 2e-5 of the
# force range of that with 16 (debonded and swaged bushings) and 48 (32 channels of decks, benchmarks/reduced.md);
# contact begins at a kink, which needs more.
PLANE, SOLID, CONTACT = 8, 6, 16
# Of a leg of rubber with memory, or of a line of a path, that goes over the whole range; a shorter one gets
# proportionally fewer, but no fewer than the second numbers.
LEG, FEWEST_OF_LEG, FEWEST_OF_LINE = 12, 4, 3
# Of a hold, even in the logarithm of time.
HOLD = 10


def steps_of_sweep(shape: Shape, dimension: int) -> int:
    """Return the number of steps of a fitted curve without memory, on the longer side of its range.

    Parameters
    ----------
    shape : Shape
    dimension : int
        Dimension of its mesh.
    """
    if getattr(shape, "snubber", None) is not None:
        return CONTACT
    return SOLID if dimension == 3 else PLANE
