"""A bushing driven through a spring: the displacement that is prescribed is that of both together.

The program is then not the path of the bushing's sleeve. At each target q + c P(q, Q) has to be found, c the spring's
compliance and P the force that it carries: the bushing's force Q, scaled, and that of stops beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# How near to the prescribed displacement the two together have to come, as a share of the largest of the program.
CLOSE = 1e-7
MOST_TRIALS = 12


@dataclass(frozen=True)
class Carried:
    """Force that the spring carries, and its derivatives by displacement, bushing's force, and parameters."""

    force: float
    by_displacement: float
    by_force: float
    by_parameter: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Series:
    """A spring in series with a bushing.

    Attributes
    ----------
    compliance : float
        mm/N, or rad/(N mm).
    compliance_rates : mapping
        Parameter -> derivative of it.
    carried : callable
        ``carried(q, Q, time) -> Carried``, time in s as in the program.
    """

    compliance: float
    compliance_rates: Mapping[str, float]
    carried: Callable[[float, float, float], Carried]

    def excess(self, q: float, force: float, time: float, prescribed: float) -> float:
        """How far bushing and spring together go beyond what is prescribed."""
        return q + self.compliance * self.carried(q, force, time).force - prescribed

    def rate(
        self, name: str, q: float, force: float, time: float, stiffness: float, prescribed: float, work: float
    ) -> float:
        """dq/dc of the bushing with respect to a parameter.

        Parameters
        ----------
        time
            s, as in the program.
        prescribed
            Derivative of the prescribed displacement.
        work
            Derivative of the bushing's force at fixed q.
        stiffness
            dQ/dq at fixed memory.
        """
        at, c = self.carried(q, force, time), self.compliance
        own = self.compliance_rates.get(name, 0.0) * at.force
        load = c * (at.by_force * work + at.by_parameter.get(name, 0.0))
        return (prescribed - own - load) / (1.0 + c * (at.by_displacement + at.by_force * stiffness))
