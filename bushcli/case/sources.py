"""``[[recordings]]`` and ``[[coupons]]`` -> sources: files, patterns of files, what a file's name says of its mode."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from bushcli.case import motion_path
from bushcli.case.finding import Finding, Keys, dotted_key, toml_text, unknown_name, wrong_key, wrong_value
from bushcli.case.limits import MOST_ENTRIES
from bushcli.case.loads import unused_name
from bushcli.case.schema import DELIMITERS, FileTable
from bushcli.errors import nearest
from bushcli.recording.guess import contradicting_modes, modes_of_name
from bushcli.recording.source import UNITS, Quantity, Source, Specimen
from bushcli.recording.table_cache import TableCache
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.case.schema_recordings import RecordingTable

_PATTERN = re.compile(r"[*?\[]")


def source_of(table: FileTable, mode: str, file: Path) -> Source:
    """Return a source with a table's options for reading its file."""
    quantities: tuple[Quantity, ...] = ("time", "displacement", "force")
    return Source(
        mode=mode,
        file=file,
        columns={q: column for q in quantities if (column := getattr(table.columns, q)) is not None},
        units={q: unit for q in quantities if (unit := getattr(table.units, q)) is not None},
        delimiter=DELIMITERS.get(table.delimiter or "", table.delimiter),
        decimal=table.decimal,
        reverse=None if table.reverse is None else tuple(sorted(set(table.reverse))),
        accept=tuple(sorted({fault for fault in table.accept or () if not isinstance(fault, str)})),
        accepted_faults=tuple(sorted({fault for fault in table.accept or () if isinstance(fault, str)})),
        group=table.group,
        rows=table.rows or {},
        sample_rate=table.sample_rate,
        temperature_column=table.columns.temperature,
        temperature_unit=table.units.temperature or "",
    )


def wrong_units(keys: Keys, source: Source) -> Iterator[Finding]:
    """Yield a finding for each unit of a source that does not fit the quantity in its column."""
    from bushcli.recording.header.units import scaled_unit  # its tables of spellings serve recordings alone
    from bushcli.recording.text.clock_times import is_form

    for quantity, unit in source.units.items():
        measured = source.dimension(quantity)
        scaled = scaled_unit(unit, measured)
        if quantity == "time" and is_form(unit):
            continue
        if scaled is None or scaled.measured != measured:
            kind = f"unit of {quantity} for mode {source.mode}"
            yield unknown_name((*keys, "units", quantity), unit, UNITS[measured], kind)


def _have_same_samples(source: Source, other: Source) -> bool:
    """Whether two sources have samples of the same columns of a file in common."""
    same = all(getattr(source, key) == getattr(other, key) for key in ("mode", "columns", "group", "rows"))
    if not same or source.six or other.six:
        return False
    shared = source.cycles is None or other.cycles is None or set(source.cycles) & set(other.cycles)
    return bool(shared) and source.file.resolve() == other.file.resolve()


@dataclass
class SourceBuilder:
    """Builds the sources of a case and collects their errors."""

    folder: Path
    findings: list[Finding]
    known: Callable[[Keys, str, str | None], bool]
    looks_for_files: bool
    tables: TableCache

    def build(
        self,
        tables: Iterable[tuple[RecordingTable, Keys]],
        specimen: str | None,
        usual: str,
        parts: bool = False,
    ) -> tuple[Source, ...]:
        """Return the sources of a list of tables; a file with a table of its own is left out of the patterns."""
        sources: list[Source] = []
        listed = [(table, keys, *self.files((*keys, "file"), table.file)) for table, keys in tables]
        listed_files = {
            (files[0].resolve(), table.mode)
            for table, _, files, pattern in listed
            if not pattern and is_file(files[0])
        }
        for table, keys, files, pattern in listed:
            taken = [source.name for source in sources]
            if table.name in taken:
                what = "is the name of another channel"
                self.findings.append(wrong_value((*keys, "name"), table.name, what))
            if pattern:
                kinds = (table.mode, None)
                files = [f for f in files if not listed_files & {(f.resolve(), kind) for kind in kinds}]
            if pattern and table.name is not None and len(files) > 1:
                what = f"is one name, but {toml_text(table.file)} matches {len(files)} files"
                expected = "leave it out: each channel is then named after its file"
                self.findings.append(wrong_key((*keys, "name"), what, expected))
            for file in files:
                taken = [source.name for source in sources]
                mode = self._mode(keys, table, file, usual)
                known = mode is not None and self.known(keys, mode, specimen)
                name = table.name or (file.stem if pattern or parts else mode or file.stem)
                source = self._source(table, keys, file, mode or "", known, unused_name(name, taken))
                channels, path_findings = (
                    motion_path.channels(source, table, keys, taken, self.tables)
                    if known and is_file(file)
                    else ([source], [])
                )
                duplicate = next((other for other in sources if _have_same_samples(other, source)), None)
                if duplicate is not None:
                    at = (*keys, "file")
                    given = f"{dotted_key(at)} = {toml_text(table.file)}"
                    what = f"{given} lists the recording of {duplicate.label} a second time"
                    expected = "one entry for each recording: counted twice, its data look more certain than they are"
                    self.findings.append(Finding(at, what, expected=expected))
                sources += channels
                self.findings += path_findings
        return tuple(sources)

    def _mode(self, keys: Keys, table: RecordingTable, file: Path, usual: str) -> str | None:
        if table.mode is not None:
            by_mode = table.mode in modes() and table.name is None
            modes_in_name = contradicting_modes(file.stem, table.mode) if by_mode else ()
            if modes_in_name:
                setting = f"{dotted_key((*keys, 'mode'))} = {toml_text(table.mode)}"
                what = f"{setting}, but the name of the file, {toml_text(file.name)}, says {' or '.join(modes_in_name)}"
                expected = f'mode = "{modes_in_name[0]}"; or name = "{table.mode}", if the file is misnamed'
                self.findings.append(Finding((*keys, "mode"), what, expected=expected))
            return table.mode
        possible = modes_of_name(file.stem, usual)
        if len(possible) != 1:
            names = ", ".join(mode.name for mode in modes().values() if mode.specimen == usual)
            says = f"may mean {' or '.join(possible)}" if possible else "does not contain a mode"
            what = f"is missing, and the name {toml_text(file.name)} {says}"
            expected = ", ".join(possible) or names
            self.findings.append(wrong_key((*keys, "mode"), what, expected))
        return possible[0] if len(possible) == 1 else None

    def _source(
        self, table: RecordingTable, keys: Keys, file: Path, mode: str, known: bool, name: str
    ) -> Source:
        rotational = known and modes()[mode].rotational
        source = replace(
            source_of(table, mode, file),
            name=name,
            cycles=tuple(sorted(set(table.cycles))) if table.cycles else None,
            branch=getattr(table, "branch", None),
            largest_stretch=getattr(table, "largest_stretch", None),
            rate=None if table.rate is None else math.radians(table.rate) if rotational else table.rate,
            conditioning=table.conditioning,
            standard=table.standard,
            temperature=table.temperature,
            specimen=self._specimen(keys, table, mode if known else ""),
        )
        if table.rate is not None and table.sample_rate is not None:
            what = "and sample_rate both give the time"
            self.findings.append(wrong_key((*keys, "rate"), what, "give one of them"))
        if known:
            self.findings += wrong_units(keys, source)
        return source

    def _specimen(self, keys: Keys, table: RecordingTable, mode: str) -> Specimen:
        """Return the dimensions of a coupon in machine units, and which stress and strain its file holds."""
        keys_of_specimen = [key for key in _OF_SPECIMEN if getattr(table, key) is not None]
        if keys_of_specimen and mode and modes()[mode].specimen != "coupon":
            what = f"belongs to a material test, but mode {mode} to a {modes()[mode].specimen}"
            self.findings.append(wrong_key((*keys, keys_of_specimen[0]), what))
            return Specimen()
        area = table.area
        sizes = [key for key in ("area", "diameter") if getattr(table, key) is not None]
        sizes += ["width and thickness"] if table.width is not None or table.thickness is not None else []
        if len(sizes) > 1:
            what = f"{dotted_key(keys)} has {' and '.join(sizes)}"
            self.findings.append(Finding((*keys, "area"), what, expected="give the cross-section once"))
        if (table.width is None) != (table.thickness is None):
            lacking = "thickness" if table.thickness is None else "width"
            what = "is missing: the cross-section is width times thickness"
            self.findings.append(wrong_key((*keys, lacking), what, "mm"))
        elif table.width is not None and table.thickness is not None:
            area = table.width * table.thickness
        elif table.diameter is not None:
            area = 0.25 * math.pi * table.diameter**2
        machine_units = {"stress": ("a force", area), "strain": ("a travel", table.gauge_length)}
        for key, (measured, size) in machine_units.items():
            value, coupon_mode = getattr(table, key), modes().get(mode)
            possible: tuple[str, ...] = ("engineering", "true")
            if coupon_mode is not None and coupon_mode.needs_compressibility:
                possible = ("engineering", *(("true", "pressure") if key == "stress" else ("volume",)))
            elif coupon_mode is not None and coupon_mode.sheared:
                possible = ("engineering",)
            what = ""
            if value is not None and value not in possible:
                what = f"has no meaning in a {mode} test"
            elif value is not None and value != "engineering" and size is not None:
                what = f"contradicts the dimensions: the file holds {measured}"
            if what:
                suitable = possible if size is None else ("engineering",)
                expected = " or ".join(f'"{word}"' for word in suitable)
                self.findings.append(wrong_key((*keys, key), f'= "{value}" {what}', expected))
        return Specimen(table.gauge_length, area, table.stress, table.strain)

    def files(self, keys: Keys, name: str) -> tuple[list[Path], bool]:
        """Return the files that a name or a pattern stands for, and whether it is a pattern."""
        if not self.looks_for_files:
            return [self.folder / name], False
        name = with_slashes(self.folder, name)
        if not _PATTERN.search(name) or is_file(self.folder / name):
            match = find_file(self.folder, keys, name, self.findings)
            return [match or Path(name)], False
        if "**" in name or Path(name).is_absolute():
            what = "is not a supported pattern"
            expected = 'a pattern relative to the case file, without **: "runs/*.csv"'
            self.findings.append(wrong_value(keys, name, what, expected))
            return [], True
        try:
            hits = sorted(
                islice((p for p in self.folder.glob(name) if p.is_file()), MOST_ENTRIES + 1),
                # run_2 comes before run_10.
                key=lambda path: [
                    (0, int(part), "") if part.isdecimal() else (1, 0, part)
                    for part in re.split(r"(\d{1,18})", str(path))
                ],
            )
        except (OSError, ValueError, NotImplementedError):
            hits = []
        if not hits or len(hits) > MOST_ENTRIES:
            what = f"matches more than {MOST_ENTRIES} files" if hits else "matches no file"
            self.findings.append(wrong_value(keys, name, what, f"looked in {self.folder}"))
            return [], True
        return hits, True


_OF_SPECIMEN = ("gauge_length", "area", "width", "thickness", "diameter", "stress", "strain")


def is_file(path: Path) -> bool:
    """Whether a path is that of a file; False for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


#: Characters that TOML makes of a backslash with a letter, between quotation marks: "runs\\new.csv".
ESCAPED = str.maketrans({"\\": "/", "\t": "/t", "\n": "/n", "\b": "/b", "\f": "/f", "\r": "/r"})


def with_slashes(folder: Path, name: str) -> str:
    """Return a name with slashes in place of backslashes where there is no such file, but its folder with slashes."""
    other = name.translate(ESCAPED)
    return other if other != name and not is_file(folder / name) and is_folder(folder / other) else name


def is_folder(path: Path) -> bool:
    """Whether the folder of a file exists; False for a name that no file can have."""
    try:
        return path.parent.is_dir()
    except (OSError, ValueError):
        return False


def find_file(folder: Path, keys: Keys, name: str, findings: list[Finding]) -> Path | None:
    """Return the file that a case names relative to its own folder; None, with a finding, if it does not exist."""
    file = folder / with_slashes(folder, name)
    try:
        if file.is_file():
            return file
        parent = file.parent
        file_names = [p.name for p in parent.iterdir() if p.is_file()] if parent.is_dir() else []
        reason = "is a directory" if file.is_dir() else "does not exist"
        if file.exists() and not file.is_dir():
            file_names, reason = [], "is a device or a pipe, not a file"
    except (OSError, ValueError):
        file_names, reason = [], "is not a file name"
    nearest_name = nearest(file.name, file_names)
    place = f"looked in {file.parent}" if reason == "does not exist" else ""
    findings.append(wrong_value(keys, name, reason, place, suggested=nearest_name))
    return None
