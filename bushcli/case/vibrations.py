"""Load cases with ``[load_cases.dynamic]``: small vibrations about preloads."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from bushcli.case import checks, motion_path
from bushcli.case.finding import Finding, Keys, dotted_key, wrong_key, wrong_value
from bushcli.case.loads import DynamicTest, PosedTest
from bushcli.case.schema import FrequenciesTable, LoadCaseTable
from bushcli.recording.dynamic.source import HIGHEST
from cases.mode import modes
from cases.six import MOTIONS
from geometry.shape import Shape


def dynamic_test(
    table: LoadCaseTable, keys: Keys, shape: Shape | None, validated: Callable[..., Any]
) -> tuple[DynamicTest | None, list[Finding]]:
    """Return a dynamic test, and what is wrong with it."""
    dynamic, keys_of_dynamic = table.dynamic, (*keys, "dynamic")
    assert dynamic is not None
    posed = modes()[table.mode].follow is not None
    findings = list(_meaningless_keys(table, keys, posed))
    frequency = _frequencies(dynamic.frequency, (*keys_of_dynamic, "frequency"), validated, findings)
    path, motion = None, 0
    if posed:
        pose, pose_findings = motion_path.load_case(table, keys, shape, validated)
        findings += pose_findings
        path = None if pose is None else pose.six
        if dynamic.motion is not None:
            motion = MOTIONS.index(dynamic.motion)
        elif path is not None:
            # The one that goes furthest, a degree counted as a mm.
            motion = int(np.argmax(np.abs(path.motion[-1]) * np.repeat([1.0, math.degrees(1.0)], 3)))
        if path is not None and motion in path.free:
            what = f": {MOTIONS[motion]} is free of force"
            expected = "one of the motions that the path prescribes"
            findings.append(wrong_key((*keys_of_dynamic, "motion"), what, expected))
    rotational = motion >= 3 if posed else modes()[table.mode].rotational
    unit = math.radians(1.0) if rotational else 1.0
    name = "preload" if dynamic.preload_force is None else "preload_force"
    values = getattr(dynamic, name) or (0.0,)
    preload = values if dynamic.preload_force is not None else tuple(unit * q for q in values)
    if dynamic.preload is not None and dynamic.preload_force is not None:
        what = f"{dotted_key(keys_of_dynamic)} has preload and preload_force"
        findings.append(Finding((*keys_of_dynamic, name), what, expected="give one of the two"))
    if len(set(preload)) < len(preload):
        at = (*keys_of_dynamic, name)
        findings.append(wrong_value(at, list(values), "has a value twice", "each preload once"))
    amplitude = dynamic.amplitude or ()
    if len(set(amplitude)) < len(amplitude) or any(value <= 0.0 for value in amplitude):
        expected = "peaks above 0, each once; without amplitude the vibration is small"
        findings.append(wrong_value((*keys_of_dynamic, "amplitude"), list(amplitude), "", expected))
    for q in preload if dynamic.preload_force is None else ():
        if shape is not None and q:
            findings += checks.travel((*keys_of_dynamic, "preload"), table.mode, (0.0, q), shape)
    if findings or (posed and path is None):
        return None, findings
    peaks = tuple(unit * peak for peak in amplitude)
    by_force, transfer = dynamic.preload_force is not None, dynamic.point == "transfer"
    if path is None:
        return DynamicTest(table.mode, frequency, preload, by_force, peaks, transfer, steps=table.steps), []
    # All six motions are possible in a vibration, also where the path keeps a plane of symmetry.
    return PosedTest(
        table.mode, frequency, (0.0,), False, peaks, transfer, motion, steps=table.steps, six=path.whole_body
    ), []


def _meaningless_keys(table: LoadCaseTable, keys: Keys, posed: bool) -> list[Finding]:
    """Return findings for keys that a dynamic test does not take."""
    dynamic = table.dynamic
    assert dynamic is not None
    unused = LoadCaseTable.model_fields.keys() - {"mode", "steps", "dynamic", "temperature"}
    unused -= {"path"} if posed else set()
    expected = "the vibration and its preload are in [load_cases.dynamic]: frequency, amplitude, preload"
    findings = [
        wrong_key((*keys, name), "has no meaning in a dynamic test", expected)
        for name in sorted(unused & table.model_fields_set)
    ]
    for name in ("preload", "preload_force") if posed else ("motion",):
        if getattr(dynamic, name) is not None:
            at = (*keys, "dynamic", name)
            of_path = "the end of [load_cases.path] is the preload"
            meaning = of_path if posed else "only mode path has six motions"
            findings.append(wrong_key(at, f"has no meaning for mode {table.mode}", meaning))
    return findings


def _frequencies(
    raw: object, keys: Keys, validated: Callable[..., Any], findings: list[Finding]
) -> tuple[float, ...]:
    """Return frequencies in Hz, in the order in which they were given."""
    if isinstance(raw, dict):
        table = validated(raw, keys, FrequenciesTable, "frequency = {from = 1, to = 200, points = 50}")
        if table is None:
            # What is wrong has been recorded.
            return ()
        wide = max(table.first, table.last) > 10.0 * min(table.first, table.last)
        spacing = table.spacing or ("logarithmic" if wide else "linear")
        spaced = np.geomspace if spacing == "logarithmic" else np.linspace
        values = tuple(float(f"{value:.12g}") for value in spaced(table.first, table.last, table.points))
    else:
        values = cast(tuple[float, ...], raw)
    for value in values:
        if not 0.0 < value <= HIGHEST:
            expected = f"frequencies above 0, at most {HIGHEST:g} Hz; the static rate is in `bushcli direct`"
            findings.append(wrong_key(keys, f"has {value:g} Hz", expected))
            break
    if len(set(values)) < len(values):
        findings.append(wrong_key(keys, "has a frequency twice", "each frequency once"))
    return values
