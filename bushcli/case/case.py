"""The values of a case, validated and in internal units (N, mm, MPa, s, rad)."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bushcli.case.as_json import relative, source_json, twelve_digits
from bushcli.case.dynamic import dynamic_source_json
from bushcli.case.loads import DynamicTest, LoadCase
from bushcli.case.tolerance import DEFAULT, Tolerance, Toleranced
from bushcli.case.unit import case_file_value
from bushcli.effects.active import ActiveEffect
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.source import Source
from cases.mode import modes
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

    def expected_tables(self, tables: str) -> str:
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


def case_json(case: Case) -> dict[str, Any]:
    """Return a case as JSON-ready data with all defaults filled in and the keys and units of the case file.

    Angles are in degrees; an infinite bulk modulus is the text "inf", since JSON has no infinity. File
    names are relative to the case file where they lie below it. An amplitude is shown as the path that it
    stands for.
    """
    folder = case.path.parent
    geometry = {"shape": type(case.geometry).name} | case.geometry.model_dump(mode="json", by_alias=True)
    if geometry.get("file"):
        geometry["file"] = relative(Path(geometry["file"]), folder)
    channels, effects = (*case.channels, *((test.label, test.mode) for test in case.vibrations)), []
    for active in case.effects:
        acting = (mode for name, mode in channels if active.acts_on(name, mode, None))
        rotational = any(modes()[mode].rotational for mode in acting)
        parameter = active.effect.parameter
        values = {k: case_file_value(parameter(k), v, rotational) for k, v in active.values.items()}
        channel_names = None if active.channels is None else list(active.channels)
        effects.append({"name": active.effect.name, "parameters": values, "channels": channel_names})
    tables: dict[str, list[dict[str, Any]]] = {"bushing": [], "coupon": []}
    for table in case.dynamic:
        tables[modes()[table.mode].specimen].append(dynamic_source_json(table))
    material = case.material
    shown_material = {
        "bulk_modulus": material.bulk_modulus if math.isfinite(material.bulk_modulus) else "inf",
        "parameters": dict(material.parameters),
        "density": twelve_digits(material.density / DENSITY),
    }
    shown: dict[str, Any] = {
        "title": case.title,
        "tolerance": {"percent": case.tolerance.percent, "class": case.tolerance.name or None},
        "path": str(case.path),
        "geometry": geometry,
        "mesh": dict(vars(case.mesh)),
        "material": vars(material) | shown_material,
        "load_cases": [load.as_json(folder) for load in (*case.load_cases, *case.vibrations)],
        "recordings": [source_json(source, folder) for source in case.recordings] + tables["bushing"],
        "coupons": [source_json(source, folder) for source in case.coupons] + tables["coupon"],
        "effects": effects,
    }
    if case.temperature is not None:
        shown["temperature"] = case.temperature
    if case.specimens:
        shown["specimens"] = [source_json(specimen, folder) for specimen in case.specimens]
    if case.toleranced:
        shown["toleranced"] = {key: vars(tolerance) for key, tolerance in case.toleranced.items()}
    return shown
