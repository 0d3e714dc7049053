"""Recordings of several parts of one drawing -> a law for all, a stiffness factor for each, scatter and outliers.

One law with its effects gives the force of the batch; the force of a part is that force times the part's own factor.
Parts that ran the same program, even if logging began at another time or phase, are compared sample by sample. The
curve of the batch is their median until the outliers are known, and then the mean of the others. The law is identified
from that mean with one simulation for all of them: with factors whose mean is one, the least-squares fit to all parts
is the fit to their mean. A part that ran another program is simulated separately.

The logarithm of the factor and that of the misfit left after it are each tested for outliers (`study.outliers`), with
half of the probability of a false alarm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.curve.curve import Curve
from bushcli.errors import InputError, Problem
from bushcli.faults import DataFault, find_faults
from bushcli.faults import condition as fault_condition
from bushcli.inverse import Fit, Task, identify
from bushcli.inverse.problem import Progress
from bushcli.recording import Recording, read_recording
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache
from bushcli.recording.write import write_curve_csv
from bushcli.runtime.condition import Condition
from bushcli.simulate.predict import predict
from bushcli.study.causes import Cause, effect_cause, travel_cause
from bushcli.study.outliers import FALSE_ALARM, FEWEST, find_outliers, is_foreign, tolerance_factor

Array = NDArray[np.float64]

# Programs are equal if their samples differ by at most this share of the travel, and their numbers of samples by at
# most this share of them: a logger that is stopped by hand writes some samples more or fewer.
EQUAL = 0.02
# Share of a recording that it must have in common with the others, if it begins at another time or phase. Arbitrary: of
# two or more cycles half a cycle may be missing.
SHARED = 0.7


@dataclass(frozen=True)
class BatchPart:
    """One part of a batch.

    Attributes
    ----------
    factor, std : float
        Its stiffness over that of the batch, and the standard error that the noise leaves.
    rms_percent, noise_percent : float
        Misfit with its own factor, and the noise of its recording, percent of the force range.
    deviation : float
        Of the logarithm of the factor, in standard deviations of the parts that are no outliers.
    simulated : bool
        Whether its own program was simulated; else it shares that of the batch.
    outlier : tuple of str
        "data", "program", "stiffness", "shape": in what it is one; empty for none.
    causes : tuple of Cause
        What its recording shows.
    """

    name: str
    mode: str
    recording: Recording
    factor: float
    std: float
    rms_percent: float
    noise_percent: float
    deviation: float = 0.0
    simulated: bool = False
    outlier: tuple[str, ...] = ()
    causes: tuple[Cause, ...] = ()


@dataclass(frozen=True)
class BatchCurve:
    """The curve of a batch in one mode.

    Attributes
    ----------
    mean : Curve
        Mean of the parts that are no outliers: mm or rad, N or N mm.
    lower, upper : (n,) array
        Ends of the tolerance band, N or N mm.
    parts : int
        Number of parts in it.
    scatter : float
        Standard deviation of the logarithm of the factors.
    k : float
        The band is that many standard deviations wide to either side.
    """

    mode: str
    mean: Curve
    lower: Array
    upper: Array
    parts: int
    scatter: float
    k: float


@dataclass(frozen=True)
class Batch:
    """Result of a batch: its case, the law and effects of all parts, the parts, curves by mode, and doubts."""

    case: Case
    fit: Fit
    parts: tuple[BatchPart, ...]
    curves: tuple[BatchCurve, ...]
    conditions: tuple[Condition, ...]
    faults: tuple[DataFault, ...]
    programs: int

    @property
    def outliers(self) -> tuple[BatchPart, ...]:
        """The parts that are outliers."""
        return tuple(part for part in self.parts if part.outlier)


def batch(
    case: Case,
    model: str,
    *,
    tables: TableCache | None = None,
    progress: Progress | None = None,
    told: Callable[[str], None] = lambda _: None,
) -> Batch:
    """Identify one law from the recordings of several parts, and a stiffness factor for each part.

    Parameters
    ----------
    case : Case
        With ``[[specimens]]``.
    model : str
        Name of the law.
    tables : TableCache, optional
        Cache of the binary files that the caller reads.
    progress : callable, optional
        Called after each evaluation of the identification.
    told : callable
        Called with a sentence on each stage.

    Raises
    ------
    InputError
        There are no parts, or none that can be used.
    """
    if len(case.specimens) < 2:
        what = f"has {'one part' if case.specimens else 'no parts'}, and a batch has several"
        expected = '[[specimens]] with mode and file = "parts/*.csv"'
        raise InputError(Problem(case.path.name, what, "", expected))
    recordings = [read_recording(source, tables) for source in case.specimens]
    faults = find_faults(case, recordings)
    faulty = {fault.channel for fault in faults if fault.fatal}
    parts: list[BatchPart] = []
    curves: list[BatchCurve] = []
    programs, outsiders = 0, set[str]()
    for mode in dict.fromkeys(recording.mode for recording in recordings):
        groups = _programs([recording for recording in recordings if recording.mode == mode])
        groups.sort(key=lambda group: -sum(recording.name not in faulty for recording in group))
        programs += len(groups)
        # As of a stiffness, up to a third of the parts can be outliers by their program.
        few = sum(map(len, groups)) // 3
        outsiders |= {recording.name for group in groups[1:] if len(group) <= few for recording in group}
        compared, curve = _compare_parts(case, groups[0], faulty)
        parts += compared
        curves.append(curve)
    with TemporaryDirectory() as folder:
        sources = []
        for curve in curves:
            sources.append(Source(curve.mode, Path(folder) / f"{curve.mode}-mean.csv"))
            write_curve_csv(sources[-1].file, curve.mean)
        mean = replace(case, recordings=tuple(sources), specimens=(), dynamic=())
        told(f"identifying {model} from the mean of {sum(curve.parts for curve in curves)} parts")
        fit = identify(Task(mean, model), progress=progress, tables=tables)
        compared_names = {part.name for part in parts}
        others = [recording for recording in recordings if recording.name not in compared_names]
        for recording in others:
            told(f"simulating {recording.name}, which ran another program")
        identified = replace(mean, effects=fit.effects or case.effects)
        parts += _simulate_others(identified, fit.material, case, others, parts)
    parts = [
        replace(part, outlier=("program", *part.outlier)) if part.name in outsiders else part
        for part in parts
    ]
    order = {recording.name: i for i, recording in enumerate(recordings)}
    parts.sort(key=lambda part: order[part.name])
    common = _common_remedies(faults, len(parts))
    # What most parts have sets none apart.
    own = [fault for fault in faults if fault.remedy not in common]
    parts = [_with_causes(part, own, curves, parts) for part in parts]
    return Batch(case, fit, tuple(parts), tuple(curves), _conditions(parts, faults, fit), faults, programs)


def _programs(recordings: Sequence[Recording]) -> list[list[Recording]]:
    """Return recordings of one mode in groups that ran the same program, each with the samples that all have."""
    groups: list[list[tuple[Recording, float]]] = []
    for recording in recordings:
        least = SHARED * len(recording.force)
        for group in groups:
            offset = shift(group[0][0].displacement, recording.displacement)
            if offset is not None and _common([*group, (recording, offset)])[1] >= least:
                group.append((recording, offset))
                break
        else:
            groups.append([(recording, 0.0)])
    return [
        [_cut(recording, at - offset, n) for recording, offset in group]
        for group in groups
        for at, n in [_common(group)]
    ]


def shift(q: Array, p: Array) -> float | None:
    """Return at which sample of a program another recording (m,) begins, a fraction too; None for another program.

    A logger that is started by hand begins at another time, or at another phase of the cycles.
    """
    n, size = min(len(q), len(p)), float(np.ptp(q))
    if max(len(q), len(p)) - n <= EQUAL * n and bool(np.abs(q[:n] - p[:n]).max() <= EQUAL * size):
        return 0.0
    from scipy.signal import correlate

    lags = np.arange(1 - len(p), len(q))
    start, stop = np.maximum(lags, 0), np.minimum(lags + len(p), len(q))
    squares = [np.concatenate([[0.0], np.cumsum(path**2)]) for path in (q, p)]
    ends = (squares[0][stop] - squares[0][start], squares[1][stop - lags] - squares[1][start - lags])
    # Mean square difference of the samples that both have, by lag.
    apart = (ends[0] + ends[1] - 2.0 * correlate(q, p, method="fft")) / (stop - start)
    apart[stop - start < max(SHARED * n, 3)] = np.inf
    # Between samples it may be smaller.
    inner = apart[1:-1]
    near = (inner <= apart[:-2]) & (inner <= apart[2:]) & (inner <= (2.0 * EQUAL * size) ** 2)
    low = np.flatnonzero(near) + 1
    for k in low[np.argsort(np.abs(lags[low]), kind="stable")]:
        # The difference grows with the square of the shift: its least value lies between samples.
        before, here, after = apart[k - 1 : k + 2]
        bend = before - 2.0 * here + after
        offset = lags[k] + (0.5 * float((before - after) / bend) if np.isfinite(bend) and bend > 0.0 else 0.0)
        at = np.arange(max(math.ceil(offset), 0), min(len(q), math.floor(offset) + len(p)))
        if np.abs(q[at] - np.interp(at - offset, np.arange(len(p)), p)).max() <= EQUAL * size:
            return float(offset)
    return None


def _common(group: Sequence[tuple[Recording, float]]) -> tuple[int, int]:
    """Return the first sample of the program that all recordings have, and how many they have in common."""
    start = math.ceil(max(at for _, at in group) - 1e-9)
    return start, math.floor(min(at + len(recording.force) - 1 for recording, at in group) + 1e-9) - start + 1


def _cut(recording: Recording, start: float, n: int) -> Recording:
    """Return n samples of a recording from one on; between its samples they are interpolated."""
    if start == 0.0 and len(recording.force) == n:
        return recording
    whole = round(start)
    at = start + np.arange(n)
    cut: dict[str, Any] = {}
    for name in ("displacement", "force", "time", "numbers", "selected"):
        if (values := getattr(recording, name)) is not None:
            cut[name] = values[whole : whole + n]
            if start != whole and name in ("displacement", "force"):
                cut[name] = np.interp(at, np.arange(len(values)), values)
    return replace(recording, **cut)


def _compare_parts(
    case: Case, group: Sequence[Recording], faulty: set[str]
) -> tuple[list[BatchPart], BatchCurve]:
    """Compare the parts that ran one program, sample by sample."""
    sound = [recording for recording in group if recording.name not in faulty]
    if not sound:
        names = ", ".join(sorted(faulty))
        what = f"no part has a sound recording ({names})"
        raise InputError(Problem(case.path.name, what, "", "bushcli check says what is wrong"))
    median = np.median([recording.force for recording in sound], axis=0)
    parts = [_batch_part(recording, median) for recording in sound]
    factors, misfits = (np.array([getattr(part, key) for part in parts]) for key in ("factor", "rms_percent"))
    stiffness, deviation = find_outliers(np.log(np.maximum(factors, 1e-9)), FALSE_ALARM / 2.0)
    shape, _ = find_outliers(np.log(np.maximum(misfits, 1e-9)), FALSE_ALARM / 2.0)
    # A misfit below the others' is no fault of a part.
    shape &= misfits > np.median(misfits)
    inliers = [recording for recording, *out in zip(sound, stiffness, shape, strict=True) if not any(out)]
    mean = np.mean([recording.force for recording in inliers], axis=0)
    q = np.mean([recording.displacement for recording in inliers], axis=0)
    # The mean is the batch: the factors are relative to it.
    share = float(mean @ median) / float(median @ median)
    parts = [
        replace(
            part,
            factor=part.factor / share,
            std=part.std / share,
            deviation=float(deviation[i]),
            outlier=("stiffness",) * bool(stiffness[i]) + ("shape",) * bool(shape[i]),
        )
        for i, part in enumerate(parts)
    ]
    parts += [
        replace(_batch_part(recording, mean), deviation=float("nan"), outlier=("data",))
        for recording in group
        if recording.name in faulty
    ]
    factors = np.log([part.factor for part in parts if not part.outlier])
    scatter = float(np.std(factors, ddof=1)) if len(factors) > 1 else 0.0
    k = tolerance_factor(len(factors))
    curve = Curve(group[0].mode, q, mean, sound[0].time)
    low, high = (mean * np.exp(side * k * scatter) for side in (-1.0, 1.0))
    return parts, BatchCurve(
        curve.mode, curve, np.minimum(low, high), np.maximum(low, high), len(inliers), scatter, k
    )


def _batch_part(recording: Recording, of_batch: Array) -> BatchPart:
    """Return a part with the factor that brings the force of the batch (n,) closest to its own."""
    factor = float(recording.force @ of_batch) / float(of_batch @ of_batch)
    residual = recording.force - factor * of_batch
    size = float(np.ptp(recording.force))
    noise = recording.force_noise
    return BatchPart(
        recording.name,
        recording.mode,
        recording,
        factor,
        noise / float(np.linalg.norm(of_batch)),
        100.0 * float(np.sqrt(np.mean(residual**2))) / size,
        100.0 * noise / size,
    )


def _simulate_others(
    mean: Case, material: Material, case: Case, others: Sequence[Recording], parts: Sequence[BatchPart]
) -> list[BatchPart]:
    """Simulate each part that ran another program, and compare its factor with those of the batch."""
    sources = {source.label: source for source in case.specimens}
    results = []
    for recording in others:
        single = replace(mean, recordings=(sources[recording.name],), load_cases=(), coupons=())
        response = predict(single, material, pictures=False)
        (channel,) = response.channels
        simulated = channel.curve.force
        if not channel.along:
            simulated = channel.curve.backbone().at(recording.displacement, tolerance=0.02)
        part = replace(_batch_part(recording, simulated), simulated=True)
        inliers = [other for other in parts if other.mode == recording.mode and not other.outlier]
        factors = np.log([other.factor for other in inliers])
        alarm = FALSE_ALARM / 2.0
        outside = part.factor <= 0.0 or is_foreign(float(np.log(part.factor)), factors, len(others), alarm)
        spread = float(np.std(factors, ddof=1)) if len(factors) > 1 else 0.0
        deviation = float(np.log(max(part.factor, 1e-9)) - factors.mean()) / spread if spread > 0.0 else 0.0
        faulty = any(fault.fatal and fault.channel == recording.name for fault in response.faults)
        out = ("data",) * faulty + ("stiffness",) * outside
        results.append(replace(part, deviation=deviation, outlier=out))
    return results


def _with_causes(
    part: BatchPart, faults: Sequence[DataFault], curves: Sequence[BatchCurve], parts: Sequence[BatchPart]
) -> BatchPart:
    """Return a part with the causes that its recording shows for being an outlier or for another program."""
    causes = [Cause(fault.kind, fault.where) for fault in faults if fault.channel == part.name]
    curve = next(curve for curve in curves if curve.mode == part.mode)
    if part.simulated:
        common = next(other.recording for other in parts if other.mode == part.mode and not other.simulated)
        causes.append(travel_cause(part.recording, common))
    elif part.outlier and not causes:
        own = part.factor * curve.mean.force
        usual = [other.rms_percent for other in parts if other.mode == part.mode and not other.outlier]
        rms = float(np.median(usual)) / 100.0 * float(np.ptp(own)) if usual else 0.0
        cause = effect_cause(part.recording, own, part.recording.force - own, rms)
        causes += [cause] if cause is not None and "shape" in part.outlier else []
    return replace(part, causes=tuple(causes))


def _common_remedies(faults: Sequence[DataFault], parts: int) -> set[str]:
    """Return the remedies of faults that most parts have."""
    remedies = [fault.remedy for fault in faults]
    return {remedy for remedy in remedies if 2 * remedies.count(remedy) > parts}


def _conditions(parts: Sequence[BatchPart], faults: Sequence[DataFault], fit: Fit) -> tuple[Condition, ...]:
    conditions = []
    common = _common_remedies(faults, len(parts))
    for remedy in sorted(common):
        alike = [fault for fault in faults if fault.remedy == remedy]
        told = f"{len(alike)} of {len(parts)} parts have this fault, such as {alike[0].channel}: {alike[0].where}"
        conditions.append(replace(fault_condition(alike[0]), message=told))
    for fault in faults:
        if fault.remedy in common:
            continue
        source = next(part.recording.source for part in parts if part.name == fault.channel)
        remedy = fault.remedy
        # It corrects the part alone.
        if source is not None and (fault.fatal or fault.is_doubtful):
            table = f'table of its own, file = ".../{source.name}", which goes before a pattern'
            remedy = f"give {fault.channel} a [[specimens]] {table}; in it, {fault.remedy}"
        conditions.append(fault_condition(replace(fault, remedy=remedy)))
    by_mode = {
        mode: sum(part.mode == mode and not part.simulated for part in parts)
        for mode in {part.mode for part in parts}
    }
    few = [f"{mode} ({count})" for mode, count in by_mode.items() if count < FEWEST]
    if few:
        what = f"too few parts ran one program to tell outliers: {', '.join(few)}, of at least {FEWEST}"
        conditions.append(Condition("few_parts", what, "record more parts with the same program"))
    # The mean has the faults of most of its parts.
    of_mean = {fault_condition(fault) for fault in fit.faults}
    return (*conditions, *(condition for condition in fit.conditions if condition not in of_mean))
