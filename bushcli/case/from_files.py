"""The text of a case file to start from, given the files of a test rig: ``bushcli init --from FILES``.

Each file is read in all possible ways: as a recording of a translation or a rotation of a bushing, or as a test of its
rubber. The mode is that in the file's name; without one, the first mode that the columns permit is written, with a
remark. Where several columns or groups are possible, the first is written, with a remark that lists the others.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from bushcli.case.as_json import relative_name
from bushcli.case.dynamic_from_files import DynamicEntry, dynamic_entry, dynamic_text
from bushcli.case.identified import inline
from bushcli.errors import CaseError, InputError, Problem, RecordingError, printable
from bushcli.recording import Recording, read_recording
from bushcli.recording.find_table import format_of
from bushcli.recording.guess import modes_of_name
from bushcli.recording.header.match import WantedColumn, candidates, columns_by_unit, has_columns
from bushcli.recording.header.meaning import says_compression
from bushcli.recording.reader import readers, unique_names
from bushcli.recording.six import columns_of
from bushcli.recording.source import Quantity, SixColumns, Source, Specimen
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.table import Table
from bushcli.recording.text_file import read_table
from bushcli.recording.time.rasters import clock_columns
from cases.mode import Mode, modes
from cases.six import MOTIONS, PAIR_MODES, REACTIONS

_QUANTITIES: tuple[Quantity, ...] = ("time", "displacement", "force")
#: Units that are proposed if a file of Zwick does not state them.
_USUAL = {"length": "mm", "angle": "deg", "force": "N", "moment": "Nmm", "strain": "percent", "stress": "MPa"}
#: Test length (mm) and cross-section (4 mm x 2 mm, in mm2) of the dumb-bell type 2 of ISO 37, as placeholders: they are
#: marked in the case file, and the user replaces them by those of the specimen.
_GAUGE_LENGTH, _AREA = 20.0, 8.0
MOST_FILES = 100

_HEAD = """\
# Written by bushcli from the files of a test rig. Check the lines marked <--: the files do not state them.
title = {title}
# tolerance = 15.0          # percent; 10 is the default

[geometry]                  # <-- enter the dimensions of your bushing, mm
shape = "plain"             # bushcli list shapes names the others; a STEP file: bushcli mesh PART
inner_radius = {inner:.3g}
outer_radius = {outer:.3g}
length = {length:.3g}

[material]
law = "yeoh"                # identified from {origin}; bushcli list laws names the others
bulk_modulus = 2000.0       # MPa; inf = incompressible
"""


@dataclass(frozen=True)
class _Entry:
    """A file as the case names it: its source, what was read with it, and remarks on what was guessed."""

    source: Source
    recording: Recording
    remarks: tuple[str, ...]

    @property
    def file(self) -> Path:
        """The file."""
        return self.source.file

    @property
    def mode(self) -> str:
        """Name of the mode."""
        return self.source.mode


def case_from_files(files: Sequence[Path], folder: Path) -> str:
    """Return the text of a case file.

    Parameters
    ----------
    files : sequence of Path
        Files of a test rig.
    folder : Path
        Folder of the case file to be, to which names are relative.

    Raises
    ------
    InputError
        Files cannot be used; it says of each what is wrong.
    """
    if len(files) > MOST_FILES:
        raise InputError(Problem("--from", f"{len(files)} files are given", "", f"at most {MOST_FILES}"))
    entries: list[_Entry | DynamicEntry] = []
    problems: list[Problem] = []
    tables = TableCache()
    for file in dict.fromkeys(files):
        name = relative_name(file, folder)
        if printable(name) != name:
            what = "has a control character, or bytes that are not UTF-8, in its path: a case file cannot name it"
            problems.append(Problem(str(file), what, "", "rename it"))
            continue
        try:
            entries.append(dynamic_entry(file, tables) or _entry(file, tables))
        except RecordingError as error:
            for problem in error.problems:
                expected = problem.expected
                if "case file" in expected:
                    # Where to put the line that the remedy asks for.
                    expected += "; there is none yet: `bushcli init DIR` writes an example whose file and "
                    expected += "mode you replace"
                problems.append(replace(problem, expected=expected))
    if problems:
        raise CaseError(*problems)
    bushing = [entry for entry in entries if modes()[entry.mode].specimen == "bushing"]
    coupons = [entry for entry in entries if entry not in bushing]
    # A length in mm, in proportion to the travel of the recordings.
    travels = [
        8.0 if modes()[entry.mode].rotational else float(abs(entry.recording.displacement).max())
        for entry in bushing
        if isinstance(entry, _Entry)
    ]
    reach = max((min(max(travel, 2.0), 50.0) for travel in travels), default=8.0)
    head = _HEAD.format(
        title=inline(printable(folder.resolve().name) or "bushing"),
        # Rubber twice as thick as the largest travel, and a bush of usual proportions around it.
        inner=reach,
        outer=3.0 * reach,
        length=5.0 * reach,
        origin="the coupon tests" if coupons else "the recordings, by bushcli inverse",
    )
    texts = [
        _table(entry, name, relative_name(entry.file, folder))
        for part in (bushing, coupons)
        for entry, name in zip(part, _names(part), strict=True)
    ]
    return head + "".join(texts)


def _names(entries: Sequence[_Entry | DynamicEntry]) -> list[str]:
    """Return the names of channels: that of the file if the mode occurs more than once, else an empty one."""
    entry_modes = [entry.mode for entry in entries]
    stems = unique_names([entry.file.stem for entry in entries])
    return [
        stem if entry_modes.count(mode) > 1 else "" for mode, stem in zip(entry_modes, stems, strict=True)
    ]


def _entry(file: Path, tables: TableCache) -> _Entry:
    """Return how a file is to be read, or raise the error of the most likely way: one for which it has the columns."""
    path = _path(file, tables)
    if path is not None:
        return path
    errors: list[tuple[bool, RecordingError]] = []
    for kind, machine in _kinds_in_order(file):
        tried = len(errors)
        modes_in_name = modes_of_name(file.stem, modes()[kind[0]].specimen)
        guessed = next((mode for mode in modes_in_name if mode in kind), None)
        for source, remarks in _ways(Source(guessed or kind[0], file), machine, tables):
            try:
                recording = read_recording(source, tables=tables)
            except RecordingError as error:
                fitting: Sequence[Table] = ()
                with suppress(RecordingError):
                    fitting = _suitable_tables(source, tables)
                errors.append((not fitting, error))
                continue
            mode_of_file = modes()[kind[0]]
            # Those of the same specimen, with the same kind of displacement.
            kind_of_file = (mode_of_file.specimen, mode_of_file.rotational)
            alike = [
                m.name for m in modes().values() if m.words and (m.specimen, m.rotational) == kind_of_file
            ]
            possible = modes_in_name if len(modes_in_name) > 1 else kind if len(kind) > 1 else alike
            other_modes = ", ".join(mode for mode in possible if mode != guessed)
            what = f"<-- mode: the file name does not state it; the columns suit {', '.join(kind)}"
            if guessed is not None and other_modes:
                what = f"<-- mode: guessed from the name of the file; it may also be {other_modes}"
            if guessed is None or other_modes:
                remarks = (what, *remarks)
            return _Entry(source, recording, remarks)
        # With its columns in the file, the mode that the name states is the right one: no other is tried.
        own = [error for lacks_columns, error in errors[tried:] if not lacks_columns]
        if guessed is not None and own:
            raise own[0]
    raise min(errors, key=lambda error: error[0])[1]


def _path(file: Path, tables: TableCache) -> _Entry | None:
    """Return how a file with named motions and reactions is to be read; None if it has no two of either."""
    source = Source("path", file)
    try:
        motions, forces = columns_of(source, None, None, tables)
    except RecordingError:
        return None
    pairs = [k for k in range(6) if MOTIONS[k] in motions and REACTIONS[k] in forces]
    for k in pairs if len(motions) > 1 or len(forces) > 1 else ():
        columns: dict[Quantity, str | int] = {
            "displacement": motions[MOTIONS[k]],
            "force": forces[REACTIONS[k]],
        }
        six, name = SixColumns(motions, (), "path"), f"path.{REACTIONS[k]}"
        try:
            recording = read_recording(Source(PAIR_MODES[k], file, name, columns, six=six), tables=tables)
        except RecordingError:
            continue  # a motion that stands still
        names = ", ".join([*(name for name in MOTIONS if name in motions), *forces])
        return _Entry(source, recording, (f"motions and reactions found: {names}",))
    return None


def _kinds_in_order(file: Path) -> list[tuple[tuple[str, ...], bool]]:
    """Return the kinds of modes, those in the file's name first; each with whether a coupon is in machine units.

    A file with stress and strain is of a coupon; one with force and travel can be of either, and is a bushing's unless
    its name says otherwise.
    """
    # Modes that read the same columns, in groups, the usual mode of each group first.
    groups: dict[tuple[str, bool, bool, bool], list[Mode]] = {}
    for mode in modes().values():
        if mode.words:
            kind = (mode.specimen, mode.rotational, mode.needs_compressibility, mode.sheared)
            groups.setdefault(kind, []).append(mode)
    kinds: dict[str, list[tuple[str, ...]]] = {"coupon": [], "bushing": []}
    for (specimen, *_), group in groups.items():
        kinds[specimen].append(tuple(mode.name for mode in sorted(group, key=lambda mode: not mode.is_usual)))
    order = [(kind, False) for kind in (*kinds["coupon"], *kinds["bushing"])]
    order += [(kind, True) for kind in kinds["coupon"]]
    modes_in_name = {mode for specimen in kinds for mode in modes_of_name(file.stem, specimen)}
    named = [entry for entry in order if modes_in_name & set(entry[0])]
    return named + [
        entry for entry in order if entry not in named and any(modes()[name].is_usual for name in entry[0])
    ]


def _ways(source: Source, machine: bool, tables: TableCache) -> Iterator[tuple[Source, tuple[str, ...]]]:
    """Yield ways to read a file in a mode: as it is, with a choice of columns and group, with units that it lacks."""
    remarks: tuple[str, ...] = ()
    if machine:
        source = replace(source, specimen=Specimen(_GAUGE_LENGTH, _AREA))
        what = "<-- gauge_length (mm), area (mm2): put in those of your specimen; these are of ISO 37, type 2"
        remarks = (what,)
    yield source, remarks
    if says_compression(source.file.stem) and modes()[source.mode].specimen == "coupon":
        what = "<-- reverse: the name of the file says compression, and its values are positive"
        yield replace(source, reverse=("displacement", "force")), (*remarks, what)
    chosen, choices = _with_choices(source, tables)
    if choices:
        yield chosen, (*remarks, *choices)
    units: dict[Quantity, str] = {"time": "s"}
    for quantity in _QUANTITIES[1:]:
        units[quantity] = _USUAL[source.dimension(quantity)]
    table = None if format_of(source.file) else read_table(source.file)
    if table is not None and len(table.names) in (2, 3) and not any(table.names) and not any(table.units):
        # Two or three columns in the most common order.
        names: tuple[Quantity, ...] = _QUANTITIES[3 - len(table.names) :]
        columns: dict[Quantity, str | int] = {name: i for i, name in enumerate(names, start=1)}
        what = "<-- columns, units: the file has no header; time, travel and force in this order?"
        yield replace(source, columns=columns, units={name: units[name] for name in names}), (*remarks, what)
    if format_of(source.file) == "zs2":
        what = "<-- units: the file does not state them; compare with what the test program shows"
        yield replace(chosen, units=units), (*remarks, *choices, what)


def _suitable_tables(source: Source, tables: TableCache) -> list[Table]:
    """Return the tables of a file that have a displacement and a force of the mode."""
    name = format_of(source.file)
    candidates = list(tables.tables(source.file, name, ()).tables) if name else [read_table(source.file)]
    return [t for t in candidates if has_columns(t, source, ("displacement", "force"))]


def _with_choices(source: Source, tables: TableCache) -> tuple[Source, tuple[str, ...]]:
    """Return a source with the first possible group and columns, and remarks that list the others."""
    remarks = []
    fitting = _suitable_tables(source, tables)
    if not fitting:
        return source, ()
    table = fitting[0]
    if len(fitting) > 1:
        source = replace(source, group=table.part)
        remarks.append(f"<-- group: also {', '.join(inline(t.part) for t in fitting[1:6])}")
    columns: dict[Quantity, str | int] = {}
    # Where each channel has a time beside it, none of these is that of all.
    several_times = len(clock_columns(table, source)) > 1
    for quantity in _QUANTITIES[1:] if several_times else _QUANTITIES:
        column = WantedColumn.of(source, quantity)
        indices = candidates(table, column) or columns_by_unit(table, column)
        if len(indices) > 1:
            columns[quantity] = indices[0] + 1
            for i in indices:
                # A channel that stands still is not the one.
                with suppress(RecordingError):
                    values = table.numbers(i)
                    if values.min() < values.max():
                        columns[quantity] = i + 1
                        break
            others = ", ".join(f"{i + 1} ({inline(table.names[i])})" for i in indices[:6])
            remarks.append(f"<-- columns: the {quantity} could be any of {others}")
    return replace(source, columns=columns), tuple(remarks)


def _table(entry: _Entry | DynamicEntry, name: str, file: str) -> str:
    lines = (
        dynamic_text(entry, name, file)
        if isinstance(entry, DynamicEntry)
        else _static_text(entry, name, file)
    )
    # Remarks quote the file, and a comment cannot contain control characters either.
    return "\n" + "\n".join(printable(line.replace("\n", " ")) for line in lines) + "\n"


def _static_text(entry: _Entry, name: str, file: str) -> list[str]:
    source, recording = entry.source, entry.recording
    section = "recordings" if modes()[entry.mode].specimen == "bushing" else "coupons"
    reader = readers().get(format_of(source.file))
    form = reader.name if reader else "a text file"
    time = "no time" if recording.time is None else f"{recording.time[-1] - recording.time[0]:.4g} s"
    lines = [f"# {form}: {len(recording.force)} samples, {time}", f"[[{section}]]"]
    lines.append(f"mode = {inline(source.mode)}")
    if name:
        lines.append(f"name = {inline(name)}")
    lines.append(f"file = {inline(file)}")
    if source.group is not None:
        lines.append(f"group = {inline(source.group)}")
    if source.columns:
        inside = ", ".join(f"{quantity} = {column}" for quantity, column in source.columns.items())
        lines.append(f"columns = {{ {inside} }}")
    if source.units:
        inside = ", ".join(f"{quantity} = {json.dumps(unit)}" for quantity, unit in source.units.items())
        lines.append(f"units = {{ {inside} }}")
    if source.reverse:
        lines.append(f"reverse = {inline(source.reverse)}")
    if source.specimen.gauge_length is not None:
        lines += [f"gauge_length = {source.specimen.gauge_length:g}", f"area = {source.specimen.area:g}"]
    lines += [f"# {remark}" for remark in entry.remarks]
    lines += [f"# {repair.text}" for repair in recording.repairs]
    if recording.time is None and not any("sample_rate" in repair.text for repair in recording.repairs):
        lines.append("# sample_rate = 100.0     # Hz, if the samples were taken at equal intervals")
    lines.append("# conditioning = 3        # first cycles that only condition the part")
    return lines
