"""A bushing's force law with memory in one dimension per channel; an FMU contains this plain Python code.

The force is F = S(q) + sum_i F_i + sum_j f_j: the curve after a long rest S, Maxwell branches F_i' = g_i H(q)' - F_i
/ tau_i and sliders f_j, springs on H(q) that slip at a limit. H is the curve of a branch that neither relaxes nor
slips. S and H are cubic between points with given slopes, straight beyond. Rubber that amplitude thins has further
branches, whose time is that of internal clocks, one for each class of local strain. Rubber that softens after its first
loading loses L(q, a) of S at displacements within the largest displacement a so far. With permanent set, q is replaced
by q less a share of the largest displacements to both sides, which may grow with the cycles; with warming, the whole
force decreases by a share with time. The code needs the standard library only.
"""

from __future__ import annotations

import math
from bisect import bisect_right

#: A step is divided so that no part moves further than this share of the curve's range. Within a part H is assumed to
#: rise linearly in time. On a curve that stiffens six-fold, with steps over the whole range in one to three relaxation
#: times, the error is 0.006 % of the range of the force (parts of 0.1: 0.14 %, undivided steps: 2.3 %).
PART = 0.02
#: This bound matters only for steps of more than 20 ranges, where the curve is straight; 1000 parts take 0.8 ms.
MOST_PARTS = 1000


class Cubic:
    """A curve through points with given slopes (Hermite) at increasing x, straight beyond its ends."""

    def __init__(self, x: list[float], y: list[float], slope: list[float]) -> None:
        self.x, self.y, self.slope = x, y, slope

    def __call__(self, x: float) -> float:
        """Return the value at x."""
        if x <= self.x[0]:
            return self.y[0] + self.slope[0] * (x - self.x[0])
        if x >= self.x[-1]:
            return self.y[-1] + self.slope[-1] * (x - self.x[-1])
        i = bisect_right(self.x, x) - 1
        h = self.x[i + 1] - self.x[i]
        t = (x - self.x[i]) / h
        rise = self.y[i + 1] - self.y[i]
        a, b = h * self.slope[i] - rise, h * self.slope[i + 1] - rise
        return self.y[i] + t * rise + t * (1.0 - t) * (a * (1.0 - t) - b * t)


class Softening:
    """Force that is lost at displacements within the largest displacement so far; zero beyond it.

    Parameters
    ----------
    data : dict
        ``reached``: largest displacements, rising; ``share``: displacements divided by them, from -1 to 1; ``lost`` and
        ``lost_slope``: force lost there, and its derivative by the share, a list for each largest displacement.
    """

    def __init__(self, data: dict) -> None:  # type: ignore[type-arg]  # JSON
        self.reached = [0.0, *data["reached"]]
        curves = zip(data["lost"], data["lost_slope"])  # noqa: B905 - of equal length
        self.lost = [Cubic(data["share"], lost, slope) for lost, slope in curves]

    def __call__(self, q: float, largest: float) -> float:
        """Return the force lost at a displacement, of which the largest so far is given; in the unit of the data."""
        if abs(q) >= largest:
            return 0.0
        x = q / largest
        i = min(bisect_right(self.reached, largest), len(self.lost)) - 1
        below, above = self.reached[i], self.reached[i + 1]
        # Linear between two largest displacements, from zero at rest; constant beyond the last one.
        weight = min(1.0, (largest - below) / (above - below))
        low = self.lost[i - 1](x) if i > 0 else 0.0
        return low + weight * (self.lost[i](x) - low)


class StrainClass:
    """Rubber of about the same local strain, with a clock of its own for the branches on it.

    On the clock dt + path (offset + a)^exponent |dx| passes, with x the local shear strain and a half of its range so
    far: the range is centre - a <= x <= centre + a, and fades towards the present strain.

    Parameters
    ----------
    clock : dict
        ``path`` (s), ``offset``, ``exponent``, ``fading`` (1/s), and ``maxwell``, pairs (g, tau).
    data : dict
        ``share`` of the class in H; ``strain``, ``strain_slope``: x at displacements.
    q : list of float
        Those displacements.
    """

    def __init__(self, clock: dict, data: dict, q: list[float]) -> None:  # type: ignore[type-arg]  # JSON
        self.clock = clock
        self.strain = Cubic(q, data["strain"], data["strain_slope"])
        self.maxwell = [(data["share"] * g, tau) for g, tau in clock["maxwell"]]

    def clock_time(
        self, start: float, end: float, duration: float, strain_range: list[float]
    ) -> tuple[float, list[float]]:
        """Return what passes on the clock while the strain moves, s, and centre and half of its range at the end."""
        retained = math.exp(-self.clock["fading"] * duration)
        centre, half = retained * strain_range[0] + (1.0 - retained) * start, retained * strain_range[1]
        beyond = max(abs(end - centre) - half, 0.0)
        # With the mean of a at beginning and end.
        thinning = (self.clock["offset"] + half + 0.25 * beyond) ** self.clock["exponent"]
        moved = centre + math.copysign(0.5 * beyond, end - centre)
        advance = self.clock["pace"] * duration + self.clock["path"] * abs(end - start)
        return duration + thinning * advance, [moved, half + 0.5 * beyond]


class ChannelForceLaw:
    """One channel's force law and its state.

    Parameters
    ----------
    data : dict
        ``displacement``, ``force``, ``force_slope``: the curve S; ``elastic``, ``elastic_slope``: H at the same
        points; ``maxwell``: pairs (g, tau); ``sliders``: pairs (stiffness on H, limit). Optional: ``clock``, that of
        each `StrainClass`, with the data of the ``classes``; ``softening``, data of a `Softening`; ``set``, the share
        of the largest displacements that remains, and ``set_cycles``, in which it grows; ``warming``, the share of the
        force that is finally lost and its time constant. The states of these four follow those of the branches.
    """

    def __init__(self, data: dict) -> None:  # type: ignore[type-arg]  # JSON
        q = data["displacement"]
        self.static = Cubic(q, data["force"], data["force_slope"])
        self.elastic = Cubic(q, data["elastic"], data["elastic_slope"])
        self.maxwell = [(float(g), float(tau)) for g, tau in data["maxwell"]]
        self.sliders = [(float(k), float(limit)) for k, limit in data["sliders"]]
        clock = data.get("clock") or {"maxwell": [], "classes": []}
        self.classes = [StrainClass(clock, data_of_class, q) for data_of_class in clock["classes"]]
        self.range = q[-1] - q[0]
        self.softening = Softening(data["softening"]) if data.get("softening") else None
        self.set, self.set_cycles = (float(data.get(key) or 0.0) for key in ("set", "set_cycles"))
        self.warming = tuple(float(value) for value in data.get("warming") or ())
        self.q = 0.0
        # The branches on the clocks follow the others.
        self.clocked = len(self.maxwell) + len(self.sliders)
        self.branches = self.clocked + len(clock["maxwell"]) * len(self.classes)
        # Indices of the states that follow those of the branches.
        self.reached = self.branches
        self.largest = self.reached + 2 * len(self.classes)
        self.extremes = self.largest + (self.softening is not None)
        # Largest displacements to both sides, and what the set lags behind.
        self.elapsed = self.extremes + (3 if self.set else 0)
        self.state = [0.0] * (self.elapsed + bool(self.warming))

    @property
    def displacement_from_set(self) -> float:
        """Displacement from the position to which the rubber has set, mm or rad, or in the unit of the data."""
        if not self.set:
            return self.q
        up, down, lag = self.state[self.extremes : self.extremes + 3]
        return self.q - self.set * (up + down) + lag

    @property
    def force(self) -> float:
        """The present force."""
        q = self.displacement_from_set
        force = self.static(q) + sum(self.state[: self.branches])
        if self.softening is not None:
            force -= self.softening(q, self.state[self.largest])
        if self.warming:
            amount, tau = self.warming
            force *= 1.0 + amount * math.expm1(-self.state[self.elapsed] / tau)
        return force

    def value(self, place: int) -> float:
        """Return the state of this index; index -1 is the present displacement."""
        return self.q if place < 0 else self.state[place]

    def put(self, place: int, value: float) -> None:
        """Set the state of an index as in `value`; a program restores what it saved."""
        if place < 0:
            self.q = value
        else:
            self.state[place] = value

    def initialise(self, q: float) -> None:
        """Start at rest at a displacement, mm or rad, or in the unit of the data, with relaxed branches."""
        self.state[:] = [0.0] * len(self.state)
        self._move(q)
        for i, strain_class in enumerate(self.classes):
            self.state[self.reached + 2 * i] = strain_class.strain(self.displacement_from_set)

    def advance(self, q: float, duration: float) -> float:
        """Move to a displacement at constant speed in a time, s; 0 for a sudden step; and return the force there."""
        parts = min(MOST_PARTS, max(1, math.ceil(abs(q - self.q) / (PART * self.range))))
        start, last = self.q, self.displacement_from_set
        for part in range(1, parts + 1):
            self._move(start + (q - start) * part / parts)
            displacement = self.displacement_from_set
            self._follow(last, displacement, duration / parts)
            last = displacement
        if self.warming:
            self.state[self.elapsed] += duration
        return self.force

    def _move(self, q: float) -> None:
        """Move to a displacement, and store it if it is the largest so far."""
        path, self.q = abs(q - self.q), q
        if self.set:
            index = self.extremes
            up, down, lag = self.state[index : index + 3]
            farthest = max(up, q), min(down, q)
            if self.set_cycles:
                lag = self._lag(
                    lag, path, self.set * (sum(farthest) - up - down), up - down, farthest[0] - farthest[1]
                )
            self.state[index : index + 3] = *farthest, lag
        if self.softening is not None:
            self.state[self.largest] = max(self.state[self.largest], abs(self.displacement_from_set))

    def _lag(self, lag: float, path: float, rise: float, before: float, after: float) -> float:
        """Return what the set lags behind after a path on which its full value rises and the range grows."""
        way, wider = 2.0 * self.set_cycles, after - before
        lag *= math.exp(-(path - wider) / (way * before)) if before else 0.0
        if wider:
            steady = way / (1.0 + way) * rise / wider
            lag = steady * after + (
                (lag - steady * before) * (before / after) ** (1.0 / way) if before else 0.0
            )
        return lag

    def _follow(self, start: float, end: float, duration: float) -> None:
        """Advance the branches by a motion; the result is exact for a rise of H that is linear in time."""
        rise = self.elastic(end) - self.elastic(start)
        self._relax(0, self.maxwell, rise, duration)
        for j, (k, limit) in enumerate(self.sliders, len(self.maxwell)):
            self.state[j] = max(-limit, min(limit, self.state[j] + k * rise))
        for i, strain_class in enumerate(self.classes):
            state_of_class = slice(self.reached + 2 * i, self.reached + 2 * i + 2)
            strains = strain_class.strain(start), strain_class.strain(end)
            time, self.state[state_of_class] = strain_class.clock_time(
                *strains, duration, self.state[state_of_class]
            )
            self._relax(self.clocked + i * len(strain_class.maxwell), strain_class.maxwell, rise, time)

    def _relax(self, first: int, maxwell: list[tuple[float, float]], rise: float, time: float) -> None:
        """Advance the Maxwell branches, whose states begin at this index, by a change of H in a time step, s."""
        for i, (g, tau) in enumerate(maxwell, first):
            y = time / tau
            # (1 - exp(-y)) / y without loss of digits.
            mean = -math.expm1(-y) / y if y > 0.0 else 1.0
            self.state[i] = self.state[i] * math.exp(-y) + g * rise * mean


class ForceLaw:
    """The channels of a bushing, which are independent of each other: ``channels``, name -> data of a channel."""

    def __init__(self, data: dict) -> None:  # type: ignore[type-arg]  # JSON
        self.channels = {name: ChannelForceLaw(channel) for name, channel in data["channels"].items()}
