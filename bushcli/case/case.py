"""The values of a case, validated and in internal units (N, mm, MPa, s, rad)."""

from __future__ import annotations

import hashlib
import math
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from bushcli.case.dynamic import shown_source
from bushcli.case.tolerance import DEFAULT, Tolerance
from bushcli.case.toleranced import Toleranced
from bushcli.case.unit import written
from bushcli.effects.active import ActiveEffect
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.source import Source
from cases.mode import Mode, mode_of, modes
from cases.program import Program, path, steps_along
from cases.six import MOTIONS, PAIR_MODES, REACTIONS, SixPath
from forms.law import laws
from geometry.shape import Refinement, Shape

if TYPE_CHECKING:
    from bushcli.recording.table_cache import TableCache

#: kg/m3 in t/mm^3, the unit of density beside N, mm, MPa and s.
DENSITY = 1e-12
# Largest deviation of the force from a prescribed one, as a share of the largest: the march leaves a tenth of it.
NEAR = 1e-6


@dataclass(frozen=True)
class MeshOptions:
    """Rubber elements in each direction; None = the default of the geometry."""

    elements_across: int | None = None
    elements_along: int | None = None
    elements_around: int | None = None

    @property
    def refinement(self) -> Refinement:
        """The numbers of elements as `geometry` expects them."""
        return Refinement(self.elements_across, self.elements_along, self.elements_around)


@dataclass(frozen=True)
class Material:
    """The rubber of a case.

    Attributes
    ----------
    law : str
        Name of a law.
    bulk_modulus : float
        MPa; ``inf`` means exactly incompressible.
    parameters : mapping of str to float
        By name, within the law's bounds; empty when the law is to be identified.
    terms : int, optional
        Number of terms to identify of a law that has optional ones.
    density : float
        t/mm^3; of vibrations only.
    hardness : float, optional
        Shore A from which the parameters were taken, because nothing else is known.
    """

    law: str
    bulk_modulus: float = math.inf
    parameters: Mapping[str, float] = field(default_factory=dict)
    terms: int | None = None
    density: float = 1.1e-9
    hardness: float | None = None

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters that the case gives or, if it gives none, of those to identify."""
        law = laws()[self.law]
        if self.parameters:
            return tuple(p.name for p in law.parameters if p.name in self.parameters)
        if self.terms is None:
            return tuple(p.name for p in law.parameters)
        return tuple(name for group in parameter_terms(self.law)[: self.terms] for name in group)


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
        return not self.by_force

    def program(self, tables: TableCache) -> Program:
        """Return the targets of the march: mm, rad or stretch - 1; forces in N or N mm; s along six motions."""
        if self.source is None:
            return path(self.path, self.steps, self.rate)
        from bushcli.recording import read_program  # with the readers, which few load cases need

        read = read_program(self.source, tables, "force" if self.by_force else "displacement")
        return Program(read.displacement, read.time)

    def resolved(self, folder: Path) -> dict[str, Any]:
        """Return the load case with the keys and units of the case file, which lies in the folder."""
        if self.source is not None:
            values = {key: value for key, value in _source(self.source, folder).items() if value}
            renamed = {"file": "force_file"} if self.by_force else {}
            return {renamed.get(key, key): value for key, value in values.items() if key != "name"}
        if self.by_force:
            return {"force_path": list(self.path), "rate": self.rate}
        rotational = modes()[self.mode].rotational
        points = [_with_twelve_digits(math.degrees(q) if rotational else q) for q in self.path]
        return {"path": points, "rate": _rate(self.rate, rotational)}


@dataclass(frozen=True)
class PathLoadCase(LoadCase):
    """A load case that prescribes a path of six motions."""

    six: SixPath = field(kw_only=True)

    @property
    @override
    def simulated_mode(self) -> Mode:
        return mode_of(self.mode, self.six)

    @property
    @override
    def by_travel(self) -> bool:
        return False

    @override
    def program(self, tables: TableCache) -> Program:
        return steps_along(self.six, self.steps)

    @override
    def resolved(self, folder: Path) -> dict[str, Any]:
        return {"path": _six(self.six)}


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

    def resolved(self) -> dict[str, Any]:
        """Return the vibration and its preloads with the keys and units of the case file."""
        unit = math.degrees(1.0) if modes()[self.vibrating_mode].rotational else 1.0
        shown: dict[str, Any] = {
            "amplitude": [_with_twelve_digits(unit * value) for value in self.amplitude] or None,
            "frequency": list(self.frequency),
            "point": "transfer" if self.transfer else "driving",
        }
        if self.by_force:
            return {"dynamic": shown | {"preload_force": list(self.preload)}}
        return {"dynamic": shown | {"preload": [_with_twelve_digits(unit * q) for q in self.preload]}}


@dataclass(frozen=True)
class PosedTest(DynamicTest):
    """Small vibrations about the end of a path of six motions, a pose."""

    six: SixPath = field(kw_only=True)

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
    def simulated_mode(self) -> Mode:
        return mode_of(self.mode, self.six)

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
    def resolved(self) -> dict[str, Any]:
        shown = super().resolved()["dynamic"]
        del shown["preload"]
        return {"path": _six(self.six), "dynamic": shown | {"motion": MOTIONS[self.motion]}}


@dataclass(frozen=True)
class Case:
    """The contents of a case file.

    Attributes
    ----------
    title : str
    path : Path
        The case file.
    geometry : Shape
        Dimensions in mm; angles of the shape stay in degrees inside it.
    mesh : MeshOptions
    material : Material
    load_cases : tuple of LoadCase
    vibrations : tuple of DynamicTest
        Load cases with ``[load_cases.dynamic]``, which are not among the former.
    recordings, coupons : tuple of Source
        Bushing (or, for a coupon shape, specimen) recordings, and material tests. Channel names are unique.
    dynamic : tuple of DynamicSource
        Tables of dynamic stiffness, of the bushing and of coupons.
    specimens : tuple of Source
        Recordings of several parts of one drawing, for `bushcli batch`.
    effects : tuple of ActiveEffect
        Effects that are added to the plain model, each once, or once in each rig; parameters that are not given have
        no value.
    tolerance : Tolerance
        Band within which a simulated channel is accepted.
    toleranced : mapping of str to Toleranced
        Tolerances by dotted key, for the numbers that were given with one.
    temperature : float, optional
        Degrees C, of everything that has no temperature of its own.
    tables : mapping
        The tables of the case file as written, with the overrides; empty where no file was read.
    """

    title: str
    path: Path
    geometry: Shape
    mesh: MeshOptions
    material: Material
    load_cases: tuple[LoadCase, ...] = ()
    vibrations: tuple[DynamicTest, ...] = ()
    recordings: tuple[Source, ...] = ()
    coupons: tuple[Source, ...] = ()
    specimens: tuple[Source, ...] = ()
    dynamic: tuple[DynamicSource, ...] = ()
    effects: tuple[ActiveEffect, ...] = ()
    tolerance: Tolerance = DEFAULT
    toleranced: Mapping[str, Toleranced] = field(default_factory=dict)
    temperature: float | None = None
    tables: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def channels(self) -> tuple[tuple[str, str], ...]:
        """Name and mode of every channel, load cases first."""
        channels: tuple[LoadCase | Source, ...] = (*self.load_cases, *self.recordings)
        return tuple((channel.label, channel.mode) for channel in channels)

    @property
    def files(self) -> tuple[Path, ...]:
        """Files that the case reads, besides the case file itself."""
        part = getattr(self.geometry, "file", None)
        programs = (load.source for load in self.load_cases if load.source is not None)
        sources = (*self.recordings, *self.specimens, *self.coupons, *programs)
        tables = (file for table in self.dynamic for file in table.files)
        return (*(source.file for source in sources), *tables, *([Path(part)] if part else []))

    def data_digest(self) -> str:
        """Return a digest of the present contents of `files`; one that cannot be read does not count."""
        digest = hashlib.sha256()
        for file in self.files:
            with suppress(OSError), file.open("rb") as opened:
                digest.update(hashlib.file_digest(opened, "sha256").digest())
        return digest.hexdigest()

    def expected(self, tables: str) -> str:
        """Return which tables a command expects, and what reads those that the case has instead."""
        if self.specimens:
            return f"{tables}; [[specimens]] are for `bushcli batch`"
        if any(modes()[source.mode].specimen == "coupon" for source in self.dynamic):
            return f"{tables}; dynamic moduli of a coupon are for `bushcli fit`"
        return tables

    @property
    def needs_fit(self) -> bool:
        """Whether the law has no parameters yet and must first be identified."""
        return not self.material.parameters


T = TypeVar("T", bound=Load)


def named(load_cases: Sequence[T | None], channel_names: Iterable[str]) -> tuple[T, ...]:
    """Return load cases with the names of their channels: the mode, numbered where the mode alone is taken."""
    loads: list[T] = [load for load in load_cases if load is not None]
    count = Counter([*(load.mode for load in loads), *channel_names])
    return tuple(
        replace(load, name=load.mode if count[load.mode] == 1 else f"{load.mode}-{number}")
        for number, load in enumerate(loads, 1)
    )


def parameter_terms(law: str) -> list[tuple[str, ...]]:
    """Return a law's parameters by term: all required ones, then each group of optional ones of equal number.

    ``ogden`` gives ``[("mu1", "alpha1"), ("mu2", "alpha2"), ("mu3", "alpha3")]``; a law without optional
    parameters is one term.
    """
    required: list[str] = []
    groups: dict[str, list[str]] = {}
    for parameter in laws()[law].parameters:
        number = parameter.name[len(parameter.name.rstrip("0123456789")) :]
        (groups.setdefault(number, []) if parameter.optional else required).append(parameter.name)
    return [tuple(required), *(tuple(group) for group in groups.values())]


def resolved(case: Case) -> dict[str, Any]:
    """Return a case as JSON-ready data with all defaults filled in and the keys and units of the case file.

    Angles are in degrees; an infinite bulk modulus is the text "inf", since JSON has no infinity. File
    names are relative to the case file where they lie below it. An amplitude is shown as the path that it
    stands for.
    """
    folder = case.path.parent
    geometry = {"shape": type(case.geometry).name} | case.geometry.model_dump(mode="json", by_alias=True)
    if geometry.get("file"):
        geometry["file"] = _relative(Path(geometry["file"]), folder)
    channels, effects = (*case.channels, *((test.label, test.mode) for test in case.vibrations)), []
    for active in case.effects:
        rotational = any(
            modes()[mode].rotational for name, mode in channels if active.acts_on(name, mode, None)
        )
        values = {
            k: written(active.effect.parameter(k), value, rotational) for k, value in active.values.items()
        }
        channel_names = None if active.channels is None else list(active.channels)
        effects.append({"name": active.effect.name, "parameters": values, "channels": channel_names})
    shown: dict[str, Any] = {
        "title": case.title,
        "tolerance": {"percent": case.tolerance.percent, "class": case.tolerance.name or None},
        "path": str(case.path),
        "geometry": geometry,
        "mesh": {
            "elements_across": case.mesh.elements_across,
            "elements_along": case.mesh.elements_along,
            "elements_around": case.mesh.elements_around,
        },
        "material": {
            "law": case.material.law,
            "bulk_modulus": case.material.bulk_modulus
            if math.isfinite(case.material.bulk_modulus)
            else "inf",
            "parameters": dict(case.material.parameters),
            "terms": case.material.terms,
            "density": _with_twelve_digits(case.material.density / DENSITY),
            "hardness": case.material.hardness,
        },
        "load_cases": [
            *(_written(load) | load.resolved(folder) for load in case.load_cases),
            *(_written(test) | test.resolved() for test in case.vibrations),
        ],
        "recordings": [_source(source, folder) for source in case.recordings] + _dynamic(case, "bushing"),
        "coupons": [_source(source, folder) for source in case.coupons] + _dynamic(case, "coupon"),
        "effects": effects,
    }
    if case.temperature is not None:
        shown["temperature"] = case.temperature
    if case.specimens:
        shown["specimens"] = [_source(specimen, folder) for specimen in case.specimens]
    if case.toleranced:
        shown["toleranced"] = {key: vars(tolerance) for key, tolerance in case.toleranced.items()}
    return shown


def _written(load: Load) -> dict[str, Any]:
    temperature = {} if load.temperature is None else {"temperature": load.temperature}
    return {"mode": load.mode, "steps": load.steps, **temperature}


def _with_twelve_digits(value: float) -> float:
    """Return a number with twelve digits: 30 degrees must not come back as 29.999999999999996."""
    return float(f"{value:.12g}")


def _rate(rate: float | None, rotational: bool) -> float | None:
    return rate if rate is None or not rotational else _with_twelve_digits(math.degrees(rate))


def _six(path: SixPath) -> dict[str, Any]:
    shown: dict[str, Any] = {"time": path.time.tolist()}
    for k, name in enumerate(MOTIONS):
        if k not in path.free and path.motion[:, k].any():
            values = np.degrees(path.motion[:, k]) if k >= 3 else path.motion[:, k]
            shown[name] = list(map(_with_twelve_digits, values))
    shown |= {REACTIONS[k]: path.loads[:, k].tolist() for k in path.loaded}
    free = [MOTIONS[k] for k in path.free if k not in path.loaded]
    return shown | ({"free": free} if free else {})


def _source(source: Source, folder: Path) -> dict[str, Any]:
    rotational = source.mode in modes() and modes()[source.mode].rotational
    six = source.six
    rarer = {
        "branch": source.branch,
        "largest_stretch": source.largest_stretch,
        "group": source.group,
        "rows": dict(source.rows) or None,
        "sample_rate": source.sample_rate,
        "rate": _rate(source.rate, rotational),
        "conditioning": source.conditioning or None,
        "standard": source.standard,
        "temperature": source.temperature,
        "gauge_length": source.specimen.gauge_length,
        "area": source.specimen.area,
        "stress": source.specimen.stress,
        "strain": source.specimen.strain,
        "path": six and {"motions": dict(six.motions), "free": [MOTIONS[k] for k in six.free]},
    }
    return {
        "mode": source.mode,
        "file": _relative(source.file, folder),
        "name": source.label,
        "columns": dict(source.columns) | _entry_of("temperature", source.temperature_column),
        "units": dict(source.units) | _entry_of("temperature", source.temperature_unit or None),
        "delimiter": source.delimiter,
        "decimal": source.decimal,
        "reverse": None if source.reverse is None else list(source.reverse),
        "cycles": list(source.cycles) if source.cycles else None,
        "accept": [*source.accept, *source.accepted_faults] or None,
        **{key: value for key, value in rarer.items() if value is not None},
    }


def _dynamic(case: Case, specimen: str) -> list[dict[str, Any]]:
    return [shown_source(source) for source in case.dynamic if modes()[source.mode].specimen == specimen]


def _entry_of(key: str, value: str | int | None) -> dict[Any, Any]:
    return {} if value is None else {key: value}


def _relative(file: Path, folder: Path) -> str:
    below = os.path.relpath(file, folder)
    # A file given with its whole path, outside the case's folder, keeps that path.
    return str(file) if below.startswith("..") and file.is_absolute() else Path(below).as_posix()
