"""The kinds of load: load cases along a program or a path of six motions, and small vibrations about a preload."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from bushcli.case.as_json import in_degrees, path_json, source_json
from bushcli.recording.source import Source
from cases.mode import Mode, mode_of, modes
from cases.program import Program, path, steps_along
from cases.six import MOTIONS, PAIR_MODES, SixPath

if TYPE_CHECKING:
    from bushcli.recording.table_cache import TableCache

# Largest deviation of the force from a prescribed one, as a share of the largest: the march leaves a tenth of it.
NEAR = 1e-6


@dataclass(frozen=True)
class Load:
    """What load cases have in common.

    Attributes
    ----------
    mode : str
    steps : int
        Steps on the longest segment of the path; the others get proportionally fewer.
    temperature : float, optional
        Degrees C.
    name : str
        Name of the channel; the mode's name when empty.
    """

    mode: str
    steps: int = field(default=20, kw_only=True)
    temperature: float | None = field(default=None, kw_only=True)
    name: str = field(default="", kw_only=True)

    @property
    def label(self) -> str:
        """The channel's name."""
        return self.name or self.mode

    @property
    def simulated_mode(self) -> Mode:
        """The mode with the path that it follows, if it has one."""
        return modes()[self.mode]

    def as_json(self, folder: Path) -> dict[str, Any]:
        """Return the load with the keys and units of the case file, which lies in the folder."""
        shown = {"mode": self.mode, "steps": self.steps, "temperature": self.temperature}
        return {key: value for key, value in shown.items() if value is not None}


@dataclass(frozen=True)
class LoadAlongPath(Load):
    """A load that follows a path of six motions."""

    six: SixPath = field(kw_only=True)

    @property
    @override
    def simulated_mode(self) -> Mode:
        return mode_of(self.mode, self.six)


@dataclass(frozen=True)
class LoadCase(Load):
    """A mode and a prescribed program.

    Attributes
    ----------
    path : tuple of float
        Points that the generalised displacement goes through on straight lines, the rest position 0 first:
        mm or rad, stretch - 1 for a coupon. Empty when ``source`` or ``six`` gives the program.
    rate : float, optional
        mm/s or rad/s along the path; None = time plays no part.
    source : Source, optional
        File with the program, for `bushcli.recording.read_program`.
    six : SixPath, optional
        Path of six motions, of a `PathLoadCase`.
    by_force : bool
        The path, the rate and the source's values are forces: N, N/s (N mm, N mm/s); the march finds the travel.
    """

    path: tuple[float, ...] = ()
    rate: float | None = None
    source: Source | None = None
    six: SixPath | None = None
    by_force: bool = False

    @property
    def by_travel(self) -> bool:
        """Whether the travel of one motion is prescribed: effects of a rig act along it."""
        return not self.by_force and self.six is None

    def program(self, tables: TableCache) -> Program:
        """Return the targets of the march: mm, rad or stretch - 1; forces in N or N mm; s along six motions."""
        if self.source is None:
            return path(self.path, self.steps, self.rate)
        from bushcli.recording import read_program  # with the readers, which few load cases need

        read = read_program(self.source, tables, "force" if self.by_force else "displacement")
        return Program(read.displacement, read.time)

    @override
    def as_json(self, folder: Path) -> dict[str, Any]:
        shown = super().as_json(folder)
        if self.source is not None:
            given = {key: value for key, value in source_json(self.source, folder).items() if value}
            del given["name"]
            if self.by_force:
                given["force_file"] = given.pop("file")
            return shown | given
        if self.by_force:
            return shown | {"force_path": list(self.path), "rate": self.rate}
        rotational = modes()[self.mode].rotational
        points = [in_degrees(q, rotational) for q in self.path]
        return shown | {"path": points, "rate": self.rate and in_degrees(self.rate, rotational)}


@dataclass(frozen=True)
class PathLoadCase(LoadAlongPath, LoadCase):
    """A load case that prescribes a path of six motions."""

    @override
    def program(self, tables: TableCache) -> Program:
        return steps_along(self.six, self.steps)

    @override
    def as_json(self, folder: Path) -> dict[str, Any]:
        return Load.as_json(self, folder) | {"path": path_json(self.six)}


@dataclass(frozen=True)
class DynamicTest(Load):
    """Small vibrations about preloads.

    Attributes
    ----------
    frequency : tuple of float
        Hz.
    preload : tuple of float
        Displacements about which the bushing vibrates, mm or rad (stretch - 1 of a coupon), or forces, N or N mm.
    by_force : bool
        Whether the preloads are forces.
    amplitude : tuple of float
        Peaks, mm or rad (strain of a coupon); empty = small.
    transfer : bool
        Whether the force is taken at the held sleeve; else where the bushing is driven.
    motion : int
        Number of the motion that vibrates at a pose (`cases.six.MOTIONS`); 0 of a single motion.
    """

    frequency: tuple[float, ...]
    preload: tuple[float, ...] = (0.0,)
    by_force: bool = False
    amplitude: tuple[float, ...] = ()
    transfer: bool = True
    motion: int = 0

    @property
    def shown_motion(self) -> str:
        """The motion that vibrates, as it follows the name; empty where the mode says it."""
        return ""

    @property
    def pose(self) -> NDArray[np.float64] | None:
        """Where the sleeve is at the end of a path of six motions, shape (6,), mm and rad; None of a single motion."""
        return None

    @property
    def vibrating_mode(self) -> str:
        """Name of the mode whose displacement and force are those of the vibration."""
        return self.mode

    def programs(self) -> Iterator[Program]:
        """Yield the ways from rest to the preloads: on each side from the nearest to the furthest."""
        sides = [sorted((q for q in self.preload if sign * q > 0.0), key=abs) for sign in (1, -1)]
        for side in sides:
            if side:
                yield path(side, self.steps)
        if not any(sides):
            yield Program(np.zeros(1))

    def preload_number(self, q: float, force: float) -> int | None:
        """Return which preload an equilibrium is; None if it is none.

        Parameters
        ----------
        q, force : float
            Displacement and force there: mm or rad, N or N mm; s along a path.
        """
        value, near = (force, NEAR * max(map(abs, self.preload))) if self.by_force else (q, 0.0)
        return next((i for i, preload in enumerate(self.preload) if abs(value - preload) <= near), None)

    def place(self, q: float) -> str:
        """Return in words where the march is at a displacement (mm or rad; s of a path)."""
        return f"{np.degrees(q):.4g} deg" if modes()[self.mode].rotational else f"{q:.4g} mm"

    @override
    def as_json(self, folder: Path) -> dict[str, Any]:
        rotational = modes()[self.vibrating_mode].rotational
        shown: dict[str, Any] = {
            "amplitude": [in_degrees(value, rotational) for value in self.amplitude] or None,
            "frequency": list(self.frequency),
            "point": "transfer" if self.transfer else "driving",
        }
        if self.by_force:
            shown["preload_force"] = list(self.preload)
        elif self.pose is None:
            shown["preload"] = [in_degrees(q, rotational) for q in self.preload]
        return super().as_json(folder) | {"dynamic": shown}


@dataclass(frozen=True)
class PosedTest(LoadAlongPath, DynamicTest):
    """Small vibrations about the end of a path of six motions, a pose."""

    @property
    @override
    def shown_motion(self) -> str:
        return f" ({MOTIONS[self.motion]})"

    @property
    @override
    def pose(self) -> NDArray[np.float64]:
        return np.asarray(self.six.motion[-1])

    @property
    @override
    def vibrating_mode(self) -> str:
        return PAIR_MODES[self.motion]

    @override
    def programs(self) -> Iterator[Program]:
        yield steps_along(self.six, self.steps)

    @override
    def preload_number(self, q: float, force: float) -> int | None:
        return 0 if q == self.six.time[-1] else None

    @override
    def place(self, q: float) -> str:
        return f"{q:.4g} s of the path"

    @override
    def as_json(self, folder: Path) -> dict[str, Any]:
        shown = super().as_json(folder)
        dynamic = shown.pop("dynamic") | {"motion": MOTIONS[self.motion]}
        return shown | {"path": path_json(self.six), "dynamic": dynamic}


T = TypeVar("T", bound=Load)


def unused_name(name: str, taken: Collection[str]) -> str:
    """Return the name of a channel, numbered from 2 on where it is taken."""
    numbered = (name if i == 1 else f"{name}_{i}" for i in count(1))
    return next(candidate for candidate in numbered if candidate not in taken)


def with_channel_names(load_cases: Sequence[T | None], channel_names: Iterable[str]) -> tuple[T, ...]:
    """Return load cases with the names of their channels: the mode, numbered where the mode alone is taken."""
    loads: list[T] = [load for load in load_cases if load is not None]
    taken = list(channel_names)
    uses, named = Counter([*(load.mode for load in loads), *taken]), []
    for number, load in enumerate(loads, 1):
        # A recording may be named as load cases are numbered.
        name = unused_name(load.mode if uses[load.mode] == 1 else f"{load.mode}-{number}", taken)
        named.append(replace(load, name=name))
        taken.append(name)
    return tuple(named)
