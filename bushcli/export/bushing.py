"""The curves, the stiffness matrix and the force law of a bushing: taken from the source, or else simulated."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from bushcli.case import Case, LoadCase
from bushcli.effects.active import in_state, state_in_words
from bushcli.errors import InputError, Problem
from bushcli.export.curves import Array, BushingData, ForceCurve, matrix_remedy
from bushcli.export.law import BushingLaw
from bushcli.export.reduce import Progress, reduce
from bushcli.export.source import ExportSource
from bushcli.export.vibration import motions
from bushcli.export.writer import Writer
from bushcli.recording import read_recording
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache
from cases.mode import modes


def bushing_of(
    source: ExportSource,
    writer: Writer,
    progress: Progress | None = None,
    tables: TableCache | None = None,
    unrelaxed: bool = False,
) -> BushingData:
    """Return the bushing's data for a writer of vehicle models.

    Parameters
    ----------
    source : ExportSource
        Case whose parameters all have values, and the curves that exist already.
    writer : Writer
        Of kind "bushing", "matrix", "force_law" or "vibration".
    progress : callable or None
        As in `bushcli.simulate.predict.predict`.
    tables : TableCache, optional
        Cache of the binary files that the caller reads.
    unrelaxed : bool
        Of a static model: whether its curves and its matrix are those in a sudden step, not after a long rest.

    Raises
    ------
    InputError
        There is no stiffness matrix in this state, nothing to simulate, or the specimen is not a bushing.
    """
    if source.case.geometry.specimen != "bushing":
        what = "is a coupon; a vehicle model needs a bushing"
        raise InputError(Problem(source.where, what, "", "choose another geometry.shape"))
    if writer.kind == "vibration":
        return _dynamic_stiffness(source, progress)
    state = state_in_words(source.case.effects, unrelaxed)
    matrix = source.stiffness_matrix
    if writer.static and any(active.effect.fades for active in source.case.effects):
        matrix = matrix if source.state == ("unrelaxed" if unrelaxed else "relaxed") else None
    if writer.kind == "matrix":
        if matrix is None:
            what = f"has no stiffness matrix{' in this state' if source.stiffness_matrix is not None else ''}"
            raise InputError(Problem(source.where, what, "", matrix_remedy(unrelaxed)))
        return BushingData(
            (), matrix, (*filter(None, [state]), *_matrix_remarks(source)), unrelaxed=unrelaxed
        )
    rig = [active for active in source.case.effects if active.effect.acts == "rig"]
    remarks = [f"without effects of the rig: {', '.join(effect.name for effect in rig)}"] if rig else []
    if writer.static and state:
        remarks.append(state)
    effects = tuple(effect for effect in source.case.effects if effect not in rig)
    settled = in_state(effects, unrelaxed) if writer.static else effects
    path_labels = _labels_of_paths(source.case)
    if path_labels:
        remarks.append(f"without {', '.join(path_labels)}: a path of several motions gives no curve of one")
    reduced = replace(
        source.case,
        effects=settled,
        load_cases=tuple(load for load in source.case.load_cases if load.six is None),
        recordings=tuple(recording for recording in source.case.recordings if recording.six is None),
    )
    tables = TableCache() if tables is None else tables
    if writer.kind == "force_law":
        ranges: dict[str, tuple[str, str, float, float]] = {}
        # A result contains the paths; the files of its recordings may have moved.
        paths = [(curve.name, curve.mode, curve.displacement) for curve in source.curves]
        for name, mode, q in paths or _paths_of_channels(reduced, tables):
            ranges.setdefault(mode, (name, mode, float(min(q.min(), 0.0)), float(max(q.max(), 0.0))))
        if not ranges:
            raise _nothing_to_export(source)
        law = BushingLaw(reduce(reduced, list(ranges.values()), progress))
        return BushingData(remarks=tuple(remarks), law=law)
    as_they_are = source.curves and settled == source.case.effects
    curves = source.curves if as_they_are else _simulated_curves(source, reduced, progress, tables)
    of_matrix = [] if matrix is None else _matrix_remarks(source)
    if not writer.static and matrix is not None and state:
        of_matrix.append(f"the stiffness matrix is that of the {source.state} rubber, without friction")
    return BushingData(curves, matrix, (*remarks, *of_matrix), unrelaxed=unrelaxed)


def _dynamic_stiffness(source: ExportSource, progress: Progress | None) -> BushingData:
    """Return dynamic stiffness, which is without the rig and without effects that depend on the amplitude."""
    effects = [active.effect for active in source.case.effects]
    excluded = [effect.name for effect in effects if effect.acts == "rig" or effect.slides]
    vibrations = list(source.vibrations)
    if not vibrations and not source.case.vibrations:
        remedy = "add a table [load_cases.dynamic] to load cases, or export the folder of `bushcli dynamic CASE -o OUT`"
        raise InputError(Problem(source.where, "has no vibrations", "", remedy))
    if not vibrations:
        from bushcli.simulate.dynamic import vibrate

        response = vibrate(source.case, progress=progress)
        if not response.complete:
            failures = ("preload_not_reached", "unstable_preload")
            failed = next(condition for condition in response.conditions if condition.name in failures)
            raise InputError(Problem(source.where, failed.message, "", failed.remedy))
        for curve in response.curves:
            values = curve.stiffness if curve.matrix is None else curve.matrix
            static, peak = (curve.preload, curve.force), curve.amplitude
            mode, transfer = curve.test.mode, curve.test.transfer
            vibrations += motions(curve.name, mode, static, transfer, curve.frequency, values, peak)
    remarks = [f"dynamic stiffness of small vibrations, without {' and '.join(excluded)}"] if excluded else []
    if any(vibration.static is None for vibration in vibrations):
        remarks.append("without coupling between motions: of a pose's matrix only the diagonal is written")
    return BushingData(remarks=tuple(remarks), vibrations=tuple(vibrations))


def _matrix_remarks(source: ExportSource) -> list[str]:
    """Return in words which effects the stiffness matrix of a result lacks, though its curves have them."""
    if source.stiffness_matrix is None:
        return []
    lacking = [
        active.name
        for active in source.case.effects
        if active.effect.feature is None and active.effect.acts != "rig"
    ]
    return [f"the stiffness matrix is that without {' and '.join(lacking)}"] if lacking else []


def _simulated_curves(
    source: ExportSource, case: Case, progress: Progress | None, tables: TableCache
) -> tuple[ForceCurve, ...]:
    """Return the curves of a case with some of the source's effects."""
    from bushcli.simulate.predict import predict
    from bushcli.simulate.prediction_cache import PredictionCache
    from bushcli.simulate.recording_cache import RecordingCache

    if not case.load_cases and not case.recordings:
        if source.stiffness_matrix is not None:
            return ()
        raise _nothing_to_export(source)
    response = predict(case, progress=progress, kept=PredictionCache(measured=RecordingCache(tables)))
    stopped = [channel for channel in response.channels if channel.stopped]
    if stopped:
        what = f"{stopped[0].name}: no equilibrium beyond {stopped[0].reach:.4g} ({stopped[0].stopped})"
        raise InputError(Problem(source.where, what, "", "ask for a smaller displacement"))
    return tuple(
        ForceCurve(c.name, c.mode, c.curve.displacement, c.curve.force, c.curve.time)
        for c in response.channels
    )


def _labels_of_paths(case: Case) -> list[str]:
    """Return the names of the channels that move in six directions at once."""
    channels: tuple[LoadCase | Source, ...] = (*case.load_cases, *case.recordings)
    return [channel.label for channel in channels if channel.six is not None]


def _nothing_to_export(source: ExportSource) -> InputError:
    what = "has neither [[load_cases]] nor [[recordings]], which give the range of displacement"
    if _labels_of_paths(source.case):
        what = 'has only paths of six motions (mode = "path"), which give no curve of a single motion'
    elif source.case.vibrations:
        what = (
            "has only load cases with vibrations, which give no curve; they are for nastran and csv_dynamic"
        )
    return InputError(Problem(source.where, what, "", 'add [[load_cases]] with mode = "axial" and amplitude'))


def _paths_of_channels(case: Case, tables: TableCache) -> Iterator[tuple[str, str, Array]]:
    """Yield name, mode and displacement of the channels that move a bushing in one direction."""
    for load in case.load_cases:
        if modes()[load.mode].specimen != "bushing":
            continue
        if load.by_force:
            what = f"{load.label} prescribes a force: its travel is known only in a result"
            remedy = f"run bushcli direct {case.path.name} -o DIR, and export DIR; or give it an amplitude"
            raise InputError(Problem(case.path.name, what, "", remedy))
        yield load.label, load.mode, load.program(tables).displacement
    for source in case.recordings:
        if modes()[source.mode].specimen == "bushing":
            yield source.label, source.mode, read_recording(source, tables=tables).displacement
