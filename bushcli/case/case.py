"""The values of a case, validated and in internal units (N, mm, MPa, s, rad)."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bushcli.case.dynamic import shown_source
from bushcli.case.tolerance import DEFAULT, Tolerance
from bushcli.case.toleranced import Toleranced
from bushcli.case.unit import written
from bushcli.effects.active import ActiveEffect
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.source import Source
from cases.mode import modes
from cases.six import MOTIONS, REACTIONS, SixPath
from forms.law import laws
from geometry.shape import Refinement, Shape

#: kg/m3 in t/mm^3, the unit of density beside N, mm, MPa and s.
DENSITY = 1e-12


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
class LoadCase:
    """A mode and a prescribed program.

    Attributes
    ----------
    mode : str
    path : tuple of float
        Points that the generalised displacement goes through on straight lines, the rest position 0 first:
        mm or rad, stretch - 1 for a coupon. Empty when ``source`` or ``six`` gives the program.
    rate : float, optional
        mm/s or rad/s along the path; None = time plays no part.
    steps : int
        Steps on the longest segment of the path; the others get proportionally fewer.
    source : Source, optional
        File with the program, for `bushcli.recording.read_program`.
    six : SixPath, optional
        Path of six motions.
    by_force : bool
        The path, the rate and the source's values are forces: N, N/s (N mm, N mm/s); the march finds the travel.
    temperature : float, optional
        Degrees C.
    """

    mode: str
    path: tuple[float, ...] = ()
    rate: float | None = None
    steps: int = 20
    source: Source | None = None
    six: SixPath | None = None
    by_force: bool = False
    temperature: float | None = None

    @property
    def amplitude(self) -> float:
        """Largest distance from rest on the path, mm or rad (N, N mm); 0 when the program is in a file."""
        return max(map(abs, self.path), default=0.0)


@dataclass(frozen=True)
class DynamicTest:
    """Small vibrations about preloads.

    Attributes
    ----------
    mode : str
    frequency : tuple of float
        Hz.
    preload : tuple of float
        Displacements about which the bushing vibrates, mm or rad (stretch - 1 of a coupon), or forces, N or N mm; 0
        with ``six``.
    by_force : bool
        Whether the preloads are forces.
    amplitude : tuple of float
        Peaks, mm or rad (strain of a coupon); empty = small.
    transfer : bool
        Whether the force is taken at the held sleeve; else where the bushing is driven.
    steps : int
        Steps to the furthest preload.
    six : SixPath, optional
        Path to a pose, which is then the preload.
    motion : int
        Number of the motion that vibrates there (`cases.six.MOTIONS`); 0 of a single motion.
    temperature : float, optional
        Degrees C.
    """

    mode: str
    frequency: tuple[float, ...]
    preload: tuple[float, ...] = (0.0,)
    by_force: bool = False
    amplitude: tuple[float, ...] = ()
    transfer: bool = True
    steps: int = 20
    six: SixPath | None = None
    motion: int = 0
    temperature: float | None = None


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
        named = load_case_names(self.load_cases, self.recordings)
        prescribed = zip(named, (load.mode for load in self.load_cases), strict=True)
        return (*prescribed, *((source.label, source.mode) for source in self.recordings))

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
        """Return which tables a command expects, and what reads the ``[[specimens]]`` that the case has instead."""
        return f"{tables}; [[specimens]] are for `bushcli batch`" if self.specimens else tables

    @property
    def needs_fit(self) -> bool:
        """Whether the law has no parameters yet and must first be identified."""
        return not self.material.parameters


def load_case_names(
    load_cases: Sequence[LoadCase | DynamicTest], recordings: Sequence[Source | DynamicSource]
) -> tuple[str, ...]:
    """Return the channel names of load cases: the mode, with the number of the load case where the mode alone is taken.

    Parameters
    ----------
    load_cases : sequence of LoadCase
        In the order of the case file.
    recordings : sequence of Source
        Their names are taken before those of the load cases.
    """
    names = []
    for number, load in enumerate(load_cases):
        taken = [other.mode for i, other in enumerate(load_cases) if i != number]
        taken += [source.label for source in recordings]
        names.append(load.mode if load.mode not in taken else f"{load.mode}-{number + 1}")
    return tuple(names)


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
    tests = zip(load_case_names(case.vibrations, ()), (test.mode for test in case.vibrations), strict=True)
    channels, effects = (*case.channels, *tests), []
    for one in case.effects:
        turned = any(modes()[mode].rotational for name, mode in channels if one.acts_on(name, mode, None))
        values = {k: written(one.effect.parameter(k), value, turned) for k, value in one.values.items()}
        on = None if one.channels is None else list(one.channels)
        effects.append({"name": one.effect.name, "parameters": values, "channels": on})
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
            "density": float(f"{case.material.density / DENSITY:.12g}"),
            "hardness": case.material.hardness,
        },
        "load_cases": [
            *(_load_case(load_case, folder) for load_case in case.load_cases),
            *map(_vibrations, case.vibrations),
        ],
        "recordings": [_source(source, folder) for source in case.recordings] + _dynamic(case, "bushing"),
        "coupons": [_source(source, folder) for source in case.coupons] + _dynamic(case, "coupon"),
        "effects": effects,
    }
    if case.temperature is not None:
        shown["temperature"] = case.temperature
    if case.specimens:
        shown["specimens"] = [_source(one, folder) for one in case.specimens]
    if case.toleranced:
        shown["toleranced"] = {key: vars(one) for key, one in case.toleranced.items()}
    return shown


def _load_case(load_case: LoadCase, folder: Path) -> dict[str, Any]:
    shown: dict[str, Any] = {"mode": load_case.mode, "steps": load_case.steps, **_warm(load_case)}
    if load_case.six is not None:
        return shown | {"path": _six(load_case.six)}
    if load_case.source is not None:
        given = {key: value for key, value in _source(load_case.source, folder).items() if value}
        renamed = {"file": "force_file"} if load_case.by_force else {}
        return shown | {renamed.get(key, key): value for key, value in given.items() if key != "name"}
    if load_case.by_force:
        return shown | {"force_path": list(load_case.path), "rate": load_case.rate}
    turned = modes()[load_case.mode].rotational
    # Twelve digits: 30 degrees must not come back as 29.999999999999996.
    path = [float(f"{math.degrees(q) if turned else q:.12g}") for q in load_case.path]
    rate = load_case.rate
    if rate is not None and turned:
        rate = float(f"{math.degrees(rate):.12g}")
    return shown | {"path": path, "rate": rate}


def _vibrations(test: DynamicTest) -> dict[str, Any]:
    unit = math.degrees(1.0) if modes()[test.mode].rotational else 1.0
    peak = math.degrees(1.0) if test.motion >= 3 else unit
    shown: dict[str, Any] = {
        "amplitude": [float(f"{peak * one:.12g}") for one in test.amplitude] or None,
        "frequency": list(test.frequency),
        "point": "transfer" if test.transfer else "driving",
    }
    if test.six is not None:
        shown |= {"motion": MOTIONS[test.motion]}
        whole = {"mode": test.mode, "steps": test.steps, "path": _six(test.six), "dynamic": shown}
        return whole | _warm(test)
    if test.by_force:
        shown["preload_force"] = list(test.preload)
    else:
        shown["preload"] = [float(f"{unit * q:.12g}") for q in test.preload]
    return {"mode": test.mode, "steps": test.steps, "dynamic": shown, **_warm(test)}


def _warm(one: LoadCase | DynamicTest) -> dict[str, float]:
    return {} if one.temperature is None else {"temperature": one.temperature}


def _six(path: SixPath) -> dict[str, Any]:
    shown: dict[str, Any] = {"time": path.time.tolist()}
    for k, name in enumerate(MOTIONS):
        if k not in path.free and path.motion[:, k].any():
            values = np.degrees(path.motion[:, k]) if k >= 3 else path.motion[:, k]
            shown[name] = [float(f"{value:.12g}") for value in values]
    shown |= {REACTIONS[k]: path.loads[:, k].tolist() for k in path.loaded}
    free = [MOTIONS[k] for k in path.free if k not in path.loaded]
    return shown | ({"free": free} if free else {})


def _source(source: Source, folder: Path) -> dict[str, Any]:
    turned = source.mode in modes() and modes()[source.mode].rotational
    rate = source.rate if source.rate is None or not turned else float(f"{math.degrees(source.rate):.12g}")
    six = source.six
    rarer = {
        "branch": source.branch,
        "largest_stretch": source.largest_stretch,
        "group": source.group,
        "rows": dict(source.rows) or None,
        "sample_rate": source.sample_rate,
        "rate": rate,
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
        "columns": dict(source.columns) | _given("temperature", source.temperature_column),
        "units": dict(source.units) | _given("temperature", source.temperature_unit or None),
        "delimiter": source.delimiter,
        "decimal": source.decimal,
        "reverse": None if source.reverse is None else list(source.reverse),
        "cycles": list(source.cycles) if source.cycles else None,
        "accept": [*source.accept, *source.accepted_faults] or None,
        **{key: value for key, value in rarer.items() if value is not None},
    }


def _dynamic(case: Case, specimen: str) -> list[dict[str, Any]]:
    return [shown_source(one) for one in case.dynamic if modes()[one.mode].specimen == specimen]


def _given(key: str, value: str | int | None) -> dict[Any, Any]:
    return {} if value is None else {key: value}


def _relative(file: Path, folder: Path) -> str:
    below = os.path.relpath(file, folder)
    # A file given with its whole path, outside the case's folder, keeps that path.
    return str(file) if below.startswith("..") and file.is_absolute() else Path(below).as_posix()
