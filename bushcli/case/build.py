"""Validate the tables of a case and assemble the Case; errors are collected, not raised."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import ValidationError

from bushcli.case import checks, motion_path
from bushcli.case.case import DENSITY, Case, Material, MeshOptions
from bushcli.case.dynamic import KIND, DynamicRecordingTable, sources
from bushcli.case.finding import (
    Finding,
    Keys,
    dotted_key,
    explain,
    toml_text,
    unknown_key,
    unknown_name,
    wrong_key,
    wrong_value,
)
from bushcli.case.hardness import from_hardness
from bushcli.case.limits import MOST_ENTRIES, mesh_size
from bushcli.case.loads import DynamicTest, Load, LoadCase, with_channel_names
from bushcli.case.schema import (
    SECTIONS,
    CaseTable,
    EffectTable,
    FileTable,
    HeatTable,
    LoadCaseTable,
    MaterialTable,
    MeshTable,
    ToleranceTable,
)
from bushcli.case.sources import ESCAPED, SourceBuilder, find_file, source_of, wrong_units
from bushcli.case.tolerance import CLASSES, DEFAULT, Tolerance
from bushcli.errors import printable
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache
from cases.mode import modes
from forms.law import laws
from geometry.shape import Shape, shapes

if TYPE_CHECKING:
    from bushcli.case.schema_recordings import RecordingTable
    from bushcli.effects.active import ActiveEffect

T = TypeVar("T", bound=CaseTable)

#: Keys of a load case of which one gives the program.
PROGRAMS = ("amplitude", "path", "file", "force", "force_path", "force_file")
#: A larger number is a typing error; the limit is far below the largest float, so that squares stay finite.
_LARGEST = 1e100


class Builder:
    """Builds the parts of a case and collects their errors; one builder serves one ``load_case``."""

    def __init__(self, folder: Path, tables: TableCache | None = None, looks_for_files: bool = True) -> None:
        self.folder, self.tables = folder, tables or TableCache()
        # Whether missing files are errors; a case that is rebuilt from a result may not need them.
        self.looks_for_files = looks_for_files
        self.findings: list[Finding] = []

    def case(self, data: dict[str, Any], path: Path) -> Case | None:
        """Return the case, or None when something in it is wrong; `findings` then says what."""
        self.findings += [unknown_key((key,), SECTIONS, "a case file") for key in data if key not in SECTIONS]
        self.findings += _impossible_values(data)
        title = data.get("title", printable(path.stem))
        if not isinstance(title, str):
            self.findings.append(Finding(("title",), f"title = {toml_text(title)} is not a text in quotes"))
        temperature = self._temperature(data)
        tolerance = self._tolerance(data)
        shape = self._shape(data)
        mesh = self._table(data, "mesh", MeshTable)
        material = self._material(data)
        loads = list(self._valid_tables(data, "load_cases", LoadCaseTable))
        prescribed = [
            _at_temperature(self._load_case(table, keys, shape, material), table.temperature, temperature)
            for table, keys in loads
            if table.dynamic is None
        ]
        vibrating = [
            _at_temperature(self._vibrations(table, keys, shape, material), table.temperature, temperature)
            for table, keys in loads
            if table.dynamic
        ]
        recordings, specimens, coupons = (
            tuple(
                _at_temperature(source, source.temperature, temperature)
                for source in self._sources(data, key, shape_of_sources, material)
            )
            for key, shape_of_sources in (("recordings", shape), ("specimens", shape), ("coupons", None))
        )
        tables = self._dynamic(data, shape, material, [source.label for source in (*recordings, *coupons)])
        measured: tuple[Source | DynamicSource, ...] = (*recordings, *tables)
        load_cases = with_channel_names(prescribed, [channel.label for channel in measured])
        tests = with_channel_names(vibrating, ())
        active = self._effects(data, load_cases, tests, measured, coupons, shape)
        if self.findings or shape is None or mesh is None or material is None:
            return None
        options = MeshOptions(mesh.elements_across, mesh.elements_along, mesh.elements_around)
        used: tuple[Load | Source, ...] = (*load_cases, *tests, *recordings, *specimens)
        self.findings += mesh_size(shape, options, [channel.mode for channel in used])
        if self.findings:
            return None
        return Case(
            title=title,
            path=path,
            geometry=shape,
            mesh=options,
            material=material,
            load_cases=load_cases,
            vibrations=tests,
            recordings=recordings,
            specimens=specimens,
            coupons=coupons,
            dynamic=tables,
            effects=active,
            tolerance=tolerance,
            temperature=temperature,
        )

    def _table(self, data: dict[str, Any], name: str, model: type[T]) -> T | None:
        return self._validate(data.get(name, {}), (name,), model, f"[{name}]")

    def _validate(self, raw: Any, keys: Keys, model: type[T], section: str) -> T | None:
        if not isinstance(raw, dict):
            self.findings.append(wrong_value(keys, raw, "is not a table of keys", f"write {section}"))
            return None
        try:
            return model.model_validate(raw)
        except ValidationError as error:
            self.findings += explain(error, model, keys, section)
            return None

    def _valid_tables(
        self, data: dict[str, Any], name: str, model: type[T], kind: str | None = None
    ) -> Iterator[tuple[T, Keys]]:
        """Yield the tables of a list; for recordings, only those of one kind."""
        for raw, keys in self._entries(data, name):
            if (isinstance(raw, dict) and raw.get("kind") == KIND) != (kind == KIND):
                continue
            table = self._validate(raw, keys, model, f"[[{name}]]")
            if table is not None:
                yield table, keys

    def _entries(self, data: dict[str, Any], name: str) -> list[tuple[Any, Keys]]:
        raw = data.get(name, [])
        if isinstance(raw, list) and len(raw) > MOST_ENTRIES:
            what = f"{name} has {len(raw)} entries"
            self.findings.append(Finding((name,), what, expected=f"at most {MOST_ENTRIES}"))
            return []
        if isinstance(raw, list):
            return [(item, (name, index)) for index, item in enumerate(raw)]
        what = f"{name} is not a list of tables"
        self.findings.append(Finding((name,), what, expected=f"write [[{name}]]"))
        return []

    def _shape(self, data: dict[str, Any]) -> Shape | None:
        raw = data.get("geometry")
        if not isinstance(raw, dict):
            given = f"geometry = {toml_text(raw)} is not a table of keys"
            what = "[geometry] is missing" if raw is None else given
            self.findings.append(Finding(("geometry",), what, expected='[geometry] with shape = "plain"'))
            return None
        name = raw.get("shape")
        model = shapes().get(name) if isinstance(name, str) else None
        if model is None:
            names = ", ".join(shapes())
            missing = Finding(("geometry", "shape"), "geometry.shape is missing", expected=names)
            wrong = unknown_name(("geometry", "shape"), name, shapes(), "shape")
            self.findings.append(missing if name is None else wrong)
            return None
        try:
            dimensions = {key: value for key, value in raw.items() if key != "shape"}
            shape = model.model_validate(dimensions, strict=True, context={"folder": str(self.folder)})
        except ValidationError as error:
            self.findings += explain(error, model, ("geometry",), f'[geometry] with shape "{name}"')
            return None
        findings = list(checks.dimensions(shape))
        self.findings += findings
        return None if findings else shape

    def _material(self, data: dict[str, Any]) -> Material | None:
        if "material" not in data:
            expected = '[material] with law = "yeoh"'
            self.findings.append(Finding(("material",), "[material] is missing", expected=expected))
            return None
        table = self._table(data, "material", MaterialTable)
        if table is None:
            return None
        if table.law not in laws():
            self.findings.append(unknown_name(("material", "law"), table.law, laws(), "law"))
            return None
        self.findings += checks.density(table.density)
        density = DENSITY * table.density
        if table.hardness is not None:
            other_keys = [name for name in ("parameters", "terms") if getattr(table, name)]
            findings = list(checks.hardness(table.hardness, other_keys, bool(data.get("coupons"))))
            self.findings += findings
            if findings:
                return None
            return replace(from_hardness(table.law, table.hardness, table.bulk_modulus), density=density)
        material = Material(table.law, table.bulk_modulus, dict(table.parameters), table.terms, density)
        self.findings += checks.parameters(material)
        if not material.parameters and not any(map(data.get, ("coupons", "recordings", "specimens"))):
            what = (
                "material.parameters are not given, and there are neither coupons nor recordings to identify"
            )
            expected = f"{', '.join(material.parameter_names)}; or [[coupons]] or [[recordings]]"
            keys = ("material", "parameters")
            self.findings.append(Finding(keys, f"{what} {material.law} from", expected=expected))
        return material

    def _mode(
        self, keys: Keys, name: str, shape: Shape | None, specimen: str | None, material: Material | None
    ) -> bool:
        """Check a mode; without a valid shape only its name can be checked."""
        specimen_of_mode = modes()[name].specimen if name in modes() else "bushing"
        specimen = specimen or (shape.specimen if shape else specimen_of_mode)
        bulk_modulus = material.bulk_modulus if material else None
        findings = list(checks.mode(keys, name, specimen, type(shape).name if shape else None, bulk_modulus))
        self.findings += findings
        return not findings

    def _load_case(
        self, table: LoadCaseTable, keys: Keys, shape: Shape | None, material: Material | None
    ) -> LoadCase | None:
        programs = [key for key in PROGRAMS if getattr(table, key) is not None]
        if len(programs) != 1:
            what = f"{dotted_key(keys)} has " + (" and ".join(programs) if programs else "no program")
            at = (*keys, programs[-1]) if programs else keys
            self.findings.append(Finding(at, what, expected=f"give one of {', '.join(PROGRAMS)}"))
        if not self._mode(keys, table.mode, shape, None, material) or len(programs) != 1:
            return None
        key, by_force = (*keys, programs[0]), programs[0].startswith("force")
        if by_force and (modes()[table.mode].specimen == "coupon" or modes()[table.mode].follow is not None):
            what = f": mode {toml_text(table.mode)} is loaded by a displacement"
            expected = "amplitude, path or file; a force loads a bushing in one mode"
            self.findings.append(wrong_key(key, what, expected))
            return None
        if motion_path.is_meant(table):
            path_case, findings = motion_path.load_case(table, keys, shape, self._validate)
            self.findings += findings
            return path_case
        name = table.force_file if by_force else table.file
        if name is not None:
            if table.rate is not None:
                self.findings.append(wrong_key((*keys, "rate"), "has no meaning: the file gives the times"))
            file = find_file(self.folder, key, name, self.findings)
            if file is None:
                return None
            source = source_of(table, table.mode, file)
            self.findings += wrong_units(keys, source)
            return LoadCase(table.mode, steps=table.steps, source=source, by_force=by_force)
        for name in sorted(FileTable.model_fields.keys() & table.model_fields_set):
            self.findings.append(wrong_key((*keys, name), "has no meaning without a file"))
        unit = math.radians(1.0) if modes()[table.mode].rotational and not by_force else 1.0
        listed, largest = (table.force_path, table.force) if by_force else (table.path, table.amplitude)
        points = listed if listed is not None else [0.0, float(largest or 0.0)]
        path = tuple(unit * q for q in (points if points[0] == 0.0 else [0.0, *points]))
        rate = None if table.rate is None else unit * table.rate
        load_case = LoadCase(table.mode, path, rate, by_force=by_force, steps=table.steps)
        if any(a == b for a, b in pairwise(path)):
            what = "stands still"
            expected = "consecutive points must differ; write a hold as a file with times"
            self.findings.append(wrong_value(key, getattr(table, programs[0]), what, expected))
        if shape is not None and not by_force:
            self.findings += checks.travel(key, table.mode, path, shape)
        return load_case

    def _vibrations(
        self, table: LoadCaseTable, keys: Keys, shape: Shape | None, material: Material | None
    ) -> DynamicTest | None:
        if not self._mode(keys, table.mode, shape, None, material):
            return None
        from bushcli.case import vibrations  # few cases have a dynamic test

        vibration_test, findings = vibrations.dynamic_test(table, keys, shape, self._validate)
        self.findings += findings
        return vibration_test

    def _sources(
        self, data: dict[str, Any], section: str, shape: Shape | None, material: Material | None
    ) -> tuple[Source, ...]:
        if section not in data:
            return ()
        from bushcli.case.schema_recordings import CouponTable, RecordingTable

        coupons = section == "coupons"
        usual = "coupon" if coupons or (shape is not None and shape.specimen == "coupon") else "bushing"

        def known(keys: Keys, mode: str, specimen: str | None) -> bool:
            return self._mode(keys, mode, shape, specimen, material)

        model: type[RecordingTable] = CouponTable if coupons else RecordingTable
        tables = self._valid_tables(data, section, model)
        builder = SourceBuilder(self.folder, self.findings, known, self.looks_for_files, self.tables)
        return builder.build(tables, "coupon" if coupons else None, usual, section == "specimens")

    def _dynamic(
        self, data: dict[str, Any], shape: Shape | None, material: Material | None, taken: Sequence[str]
    ) -> tuple[DynamicSource, ...]:
        """Return the tables of dynamic stiffness, of the bushing and of coupons."""
        dynamic_sources: list[DynamicSource] = []
        for section, specimen in (("recordings", None), ("coupons", "coupon")):
            tables = list(self._valid_tables(data, section, DynamicRecordingTable, KIND))
            if not tables:
                continue
            builder = SourceBuilder(
                self.folder, self.findings, lambda *_: True, self.looks_for_files, self.tables
            )

            def known(keys: Keys, mode: str, specimen: str | None = specimen) -> bool:
                return self._mode(keys, mode, shape, specimen, material)

            names = [*taken, *(source.label for source in dynamic_sources)]
            dynamic_sources += sources(tables, builder.files, known, names, self.findings)
        return tuple(dynamic_sources)

    def _temperature(self, data: dict[str, Any]) -> float | None:
        """Return the temperature of the case, degrees C."""
        keys = ("temperature",)
        given = {key: data[key] for key in keys if key in data}
        table = self._validate(given, (), HeatTable, "temperature = 23.0")
        return None if table is None else table.temperature

    def _tolerance(self, data: dict[str, Any]) -> Tolerance:
        raw, keys = data.get("tolerance", DEFAULT.percent), ("tolerance",)
        if isinstance(raw, str) and raw.upper() in CLASSES:
            what = f"tolerance = {toml_text(raw)}: the percentage of the class depends on hardness and wall thickness"
            example = f'tolerance = {{class = "{raw.upper()}", percent = 15}}'
            expected = f"take it from the drawing or the handbook: {example}"
            self.findings.append(Finding(keys, what, expected=expected))
            return DEFAULT
        if not isinstance(raw, dict):
            raw = {"percent": raw}
        table = self._validate(raw, keys, ToleranceTable, "[tolerance]")
        return DEFAULT if table is None else Tolerance(float(table.percent), table.name or "")

    def _effects(
        self,
        data: dict[str, Any],
        load_cases: Sequence[LoadCase],
        tests: Sequence[DynamicTest],
        recordings: Sequence[Source | DynamicSource],
        coupons: Sequence[Source],
        shape: Shape | None,
    ) -> tuple[ActiveEffect, ...]:
        tables = list(self._valid_tables(data, "effects", EffectTable))
        # Effects are checked against channels: an error in a channel would be reported twice.
        channel_sections = ("temperature", "geometry", "load_cases", "recordings")
        if any(finding.keys[0] in channel_sections for finding in self.findings):
            return ()
        if not tables:
            return ()
        from bushcli.case import effects  # with the type of an effect, which a plain model does not need

        channels = []
        for i, load in enumerate(load_cases):
            untimed = ("load_cases", i) if load.path and load.rate is None else ()
            channel = effects.DeclaredChannel(load.label, load.mode, untimed, temperature=load.temperature)
            channels.append(channel)
        channels += [
            effects.DeclaredChannel(source.label, source.mode, temperature=_temperature_of(source))
            if isinstance(source, Source)
            # Its rows may have temperatures of their own.
            else effects.DeclaredChannel(source.label, source.mode, (), "dynamic", math.nan)
            for source in recordings
        ]
        channels += [
            effects.DeclaredChannel(test.label, test.mode, (), "dynamic", test.temperature)
            for test in tests
            if test.label not in {channel.name for channel in channels}
        ]
        taken = {channel.name for channel in channels}
        channels += [
            effects.DeclaredChannel(test.label, test.mode, temperature=_temperature_of(test), coupon=True)
            for test in coupons
            if test.label not in taken
        ]
        active, findings = effects.build(tables, channels, shape)
        self.findings += findings
        return tuple(active)


S = TypeVar("S", LoadCase | None, DynamicTest | None, Source)


def _at_temperature(source: S, of_table: float | None, of_case: float | None) -> S:
    """Return a load case or a source with its own temperature, or with that of the case."""
    return (
        source if source is None else replace(source, temperature=of_case if of_table is None else of_table)
    )


def _temperature_of(source: Source) -> float | None:
    """Return the temperature that the case gives for a recording; nan where a column of its file gives it."""
    return source.temperature if source.temperature_column is None else math.nan


def _impossible_values(value: Any, keys: Keys = ()) -> Iterator[Finding]:
    """Yield nan, infinities (but the bulk modulus), numbers too large or small to compute with, control characters."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _impossible_values(item, (*keys, key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _impossible_values(item, (*keys, index))
    elif isinstance(value, str) and printable(value) != value:
        # "runs\\radial.csv" between quotation marks: the file is looked for with slashes.
        if str(keys[-1]).endswith("file") and printable(value.translate(ESCAPED)) == value.translate(ESCAPED):
            return
        yield wrong_value(keys, value, "has a control character, which would act on a terminal")
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        infinite = keys == ("material", "bulk_modulus") and value == math.inf
        if not infinite and value != 0 and not 1.0 / _LARGEST <= abs(value) <= _LARGEST:
            yield wrong_value(keys, value, "is not a usable number")
