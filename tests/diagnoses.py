"""Diagnoses made by hand from closed-form curves: no mesh, no march. Only the misfit is located by the tool's code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bushcli.case import Material
from bushcli.diagnosis.result import (
    DiagnosedChannel,
    DiagnosedEffect,
    Diagnosis,
    FormError,
    Group,
    NextTest,
    Quantity,
    RankedModel,
)
from bushcli.faults import DataFault
from bushcli.likelihood.noise import Compared, NoiseModel
from bushcli.mismatch.maps import LocalMap, Missing, MissingProfile
from bushcli.mismatch.record import locate
from bushcli.recording import Recording
from bushcli.runtime.condition import Condition
from bushcli.selection.search_extent import SearchExtent, TriedModel

NAN = float("nan")
CASE = """\
title = "a bushing"
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "yeoh"
[[recordings]]
mode = "axial"
file = "axial.csv"
"""
YEOH = Material("yeoh", 2000.0, {"C10": 0.5, "C20": -0.05, "C30": 0.01})


def program(peaks, rate, per_way=24):
    """Time and displacement through 0, peak, 0, ...; equally many samples from each point to the next."""
    q, t = [0.0], [0.0]
    for target in [end for peak in peaks for end in (peak, 0.0)]:
        way = np.linspace(q[-1], target, per_way + 1)[1:]
        seconds = abs(target - q[-1]) / rate
        t += list(t[-1] + seconds * np.arange(1, per_way + 1) / per_way)
        q += list(way)
    return np.array(t), np.array(q)


def softened(q, stiffness, loss):
    """Force of a stiffening spring that loses a share below the largest earlier displacement, as rubber does."""
    virgin = stiffness * (q + 0.02 * q**3 / max(np.abs(q).max(), 1e-9))
    highest = np.maximum.accumulate(np.abs(q))
    depth = np.where(highest > 0, 1.0 - np.abs(q) / np.where(highest > 0, highest, 1.0), 0.0)
    return virgin * (1.0 - loss * np.tanh(3.0 * depth))


def channel(
    mode="axial", loss=0.25, reach=6.0, stiffness=110.0, noise=0.004, seed=1, explained=True, time=True
):
    """A channel whose rubber softens; before: fitted plain law, after: the truth (or again the plain law)."""
    t, q = program([reach / 2, reach / 2, reach / 2, reach, reach, reach], reach / 12.0)
    truth = softened(q, stiffness, loss)
    unit = noise * np.ptp(truth)
    measured = truth + np.random.default_rng(seed).normal(size=len(q)) * unit
    virgin = softened(q, stiffness, 0.0)
    before = virgin * (virgin @ measured) / (virgin @ virgin)
    after = truth if explained else before
    recording = Recording(mode, q, measured, t if time else None, name=mode)
    percent = 100.0 / np.ptp(measured)

    def rms(force):
        return float(percent * np.sqrt(np.mean((force - measured) ** 2)))

    return DiagnosedChannel(
        mode,
        mode,
        recording,
        before,
        after,
        rms(before),
        rms(after),
        percent * unit,
        False,
        q,
        np.zeros(len(q), dtype=bool),
    )


def located(channels, after=False):
    """Where the misfit is, found by the same function as in a diagnosis."""
    return locate(
        [
            Compared(
                one.recording,
                np.where(one.faulty, NAN, one.after if after else one.before),
                NoiseModel(one.noise_percent / 100 * float(np.ptp(one.recording.force))),
            )
            for one in channels
        ]
    )


def half_plane(across=8, along=20, names=("axial",)):
    """A map in tensor-product numbering on the section of a ring: the rubber at one end of the bond is too stiff."""
    r, z = np.linspace(9.0, 18.0, across + 1), np.linspace(-17.0, 17.0, along + 1)
    points = np.array([(a, b) for b in z for a in r])
    n = across + 1
    cells = np.array(
        [
            (j * n + i, j * n + i + 1, (j + 1) * n + i, (j + 1) * n + i + 1)
            for j in range(along)
            for i in range(across)
        ]
    )
    middle = points[cells].mean(axis=1)
    factor = -0.3 * np.exp(-((middle[:, 0] - 9.0) ** 2 + (middle[:, 1] - 17.0) ** 2) / 30.0)
    text = "a local change takes away 71 % of the misfit, a uniform one 12 %: softer at the bond on the inner sleeve"
    return LocalMap(names, points, cells, factor, 0.71, 0.12, True, text)


def solid(around=24, across=4, along=8, names=("radial",), whole=False):
    """The same map in a solid body, half of it (y >= 0) or the whole."""
    r, z = np.linspace(9.0, 18.0, across + 1), np.linspace(-17.0, 17.0, along + 1)
    angles = np.linspace(0.0, (2 if whole else 1) * np.pi, around + 1)
    points = np.array([(a * np.cos(w), a * np.sin(w), b) for b in z for w in angles for a in r])
    m, n = around + 1, across + 1
    cells = np.array(
        [
            [(k + c) * m * n + (j + b) * n + i + a for c in (0, 1) for b in (0, 1) for a in (0, 1)]
            for k in range(along)
            for j in range(around)
            for i in range(across)
        ]
    )
    middle = points[cells].mean(axis=1)
    factor = 0.2 * middle[:, 0] / 18.0 * np.exp(-((middle[:, 2] - 17.0) ** 2) / 200.0)
    text = (
        "a local change takes away 30 % of the misfit, a uniform one 28 %: no part of the rubber stands out"
    )
    return LocalMap(names, points, cells, factor, 0.30, 0.28, False, text)


LEE = "Govindjee and Simo (1991), doi:10.1016/0022-5096(91)90032-J"
MULLINS = DiagnosedEffect(
    "mullins",
    "Mullins softening",
    "Reloading below the largest earlier deformation is softer than the first loading.",
    {
        "inverse_r": Quantity(
            0.312,
            0.008,
            "1",
            "largest share of the stress that is lost",
            0.296,
            0.328,
            {"r": (3.205, "1")},
            prior=(0.02, 0.6),
            prior_tail=0.62,
            prior_source=LEE,
        ),
        "m": Quantity(
            0.102,
            0.011,
            "MPa",
            "energy below W_max at which softening sets in",
            0.081,
            0.125,
            prior=(0.004, 2.2),
            prior_tail=0.81,
            prior_source=LEE,
        ),
        "beta": Quantity(
            0.02,
            0.03,
            "1",
            "growth of that energy with W_max",
            0.0,
            0.08,
            prior=(0.0, 0.4),
            prior_tail=0.9,
            prior_source=LEE,
        ),
    },
    0.994,
    412.0,
    True,
    "filled rubber loses 20 to 50 % of its stress after a first loading",
)
FRICTION = DiagnosedEffect(
    "friction",
    "Internal friction",
    "Rubber takes energy in every loop, whatever the rate.",
    {
        "g": Quantity(
            0.14, 0.02, "1", "share of the stiffness", 0.10, 0.18, prior=(0.005, 0.4), prior_tail=0.3
        ),
        "limit": Quantity(
            0.05, 0.01, "MPa", "stress of slip", 0.03, 0.07, prior=(0.002, 0.9), prior_tail=0.7
        ),
    },
    0.62,
    4.1,
    True,
)
LOOSE = DiagnosedEffect(
    "offset",
    "Zero offset",
    "Force or displacement is logged where there is none.",
    {
        "force": Quantity(
            -90.0, 4.0, "N", "logged without load", -98.0, -82.0, prior=(0.0, 60.0), prior_tail=0.0004
        ),
        # 1.146 degrees.
        "displacement": Quantity(
            0.02, 0.002, "mm", "logged at rest", 0.016, 0.024, prior=(0.0, 0.01), prior_tail=0.02
        ),
    },
    0.97,
    9.0,
    False,
    "few rigs log so large a force without load",
)
UNTESTABLE = {
    "batch_stiffness": "the law's own parameters do the same",
    "time_lag": "one rate only: a lag looks like friction",
}
# Probabilities of effects that are never present.
FEW = {
    "bump_stop": 1e-5,
    "compressibility": 3e-4,
    "cure_shrinkage": 6e-4,
    "debonding": 2e-4,
    "free_play": 1e-4,
    "misalignment": 1e-6,
    "permanent_set": 2e-3,
    "rig_compliance": 4e-3,
    "sleeve_compliance": 1e-5,
    "swaging": 8e-4,
}


def ranked(*models):
    """Models with their probabilities: the evidence is that for equal odds; misfit and form error are invented."""
    found = []
    for i, (law, effects, p) in enumerate(models):
        found.append(RankedModel(law, effects, p, float(np.log(p / 1e-40)), 1.4 + 0.1 * i, 0.08 + 0.02 * i))
    return tuple(found)


def searched(models, **changes):
    """A search that fitted these models and found one that cannot be solved."""
    trials = [TriedModel("yeoh", (), NAN, 0.0, 8.4)]
    trials += [
        TriedModel(one.law, one.effects, one.log_evidence - 3.0, one.log_evidence, one.misfit)
        for one in models
    ]
    trials.append(TriedModel("yeoh", ("swaging",), 4.0, NAN, NAN, "cannot be solved from any start"))
    given = {
        "complete": True,
        "left": 0.002,
        "ended": "nothing left",
        "trials": tuple(trials),
        "lost": ("Yeoh + swaging: the mesh folds at 0.8 mm",),
        "untestable": UNTESTABLE,
    }
    return SearchExtent(**(given | changes))


NEXT = NextTest(
    "axial, with a hold at the peak",
    "axial",
    (0.0, 6.0, 0.0, 6.0, 0.0),
    (0.5, 0.5, 5.0, 5.0),
    (0.0, 60.0, 0.0, 60.0, 0.0),
    8.0,
    0.83,
    1.05,
    (("friction", "viscoelasticity"),),
    "axial to 6 mm at 0.5 and 5 mm/s with a hold of 60 s at the peak (8 minutes) would tell internal friction from "
    "viscoelasticity",
)


def profiles(one):
    """Profiles of the missing force of a channel: largest in mid-travel on loading, falling with time and cycle."""
    along = []
    q = np.linspace(0.0, one.path.max(), 25)
    for branch, size in (("loading", 3.0), ("unloading", 1.2)):
        mean = size * np.sin(np.pi * q / q[-1]) ** 2
        along.append(MissingProfile(one.name, "displacement", branch, q, mean, 0.2 + 0.1 * q / q[-1]))
    if one.recording.time is not None:
        t = np.linspace(0.0, one.recording.time[-1], 60)
        along.append(
            MissingProfile(one.name, "time", "", t, 2.0 * np.exp(-3 * t / t[-1]) - 0.4, np.full(60, 0.3))
        )
    cycle = np.arange(1.0, 7.0)
    along.append(MissingProfile(one.name, "cycle", "", cycle, 2.2 / cycle - 0.5, np.full(6, 0.25)))
    if one.recording.time is not None:
        rate = np.array([0.25, 0.5])
        along.append(MissingProfile(one.name, "rate", "", rate, np.array([0.4, 0.6]), np.array([0.2, 0.3])))
    return along


def missing(channels, probability):
    """What the unknown effect looks like in some channels."""
    return Missing(
        probability,
        0.83,
        {one.name: 0.8 * (one.recording.force - one.after) for one in channels},
        tuple(profile for one in channels for profile in profiles(one)),
        (
            "the force falls with time, whatever the displacement",
            "on loading 3.0 % of the force range are missing in the middle of the travel, on unloading 1.2 %",
        ),
    )


def recorded_only(one):
    """A channel of faulty data, which is not simulated."""
    none = np.full(len(one.recording.force), np.nan)
    return replace(one, before=none, after=none, before_percent=np.nan, after_percent=np.nan)


def diagnosis(case, kind="missing_physics", channels=None, **changes):
    """A diagnosis with this verdict, which is nearly certain."""
    explained = kind in ("missing_physics", "law_too_poor")
    loss = 0.0 if kind == "explained" else 0.25
    used = channels or (channel(loss=loss, explained=explained),)
    if kind == "faulty_data":
        used = tuple(recorded_only(one) for one in used)
    effects = (MULLINS,) if kind == "missing_physics" else ()
    values = {
        "C10": Quantity(0.5, 0.002, "MPa", "coefficient of I1 - 3", 0.496, 0.504),
        "C20": Quantity(-0.05, 0.004, "MPa", "coefficient of (I1 - 3)^2", -0.058, -0.042),
        "C30": Quantity(0.01, 0.003, "MPa", "coefficient of (I1 - 3)^3", 0.004, 0.016),
    } | {f"{effect.name}.{name}": q for effect in effects for name, q in effect.parameters.items()}
    plain = Material("neo_hookean", 2000.0, {"C10": 0.5}) if kind == "law_too_poor" else YEOH
    models, probability = {
        "explained": (
            ranked(("yeoh", (), 0.968), ("yeoh", ("offset",), 0.02)),
            {"nothing": 0.968, "offset": 0.024},
        ),
        "missing_physics": (
            ranked(("yeoh", ("mullins",), 0.973), ("yeoh", ("mullins", "offset"), 0.021)),
            {"mullins": 0.994, "offset": 0.023, "nothing": 1e-9},
        ),
        "law_too_poor": (ranked(("yeoh", (), 0.985), ("ogden", (), 0.012)), {"nothing": 0.997}),
        "unexplained": (
            ranked(("yeoh", ("unknown",), 0.961), ("yeoh", ("mullins", "unknown"), 0.03)),
            {"unknown": 0.992, "mullins": 0.031, "nothing": 1e-7},
        ),
        "faulty_data": ((), {}),
    }[kind]
    others = dict.fromkeys(("mullins", "friction", "viscoelasticity", "offset", "unknown"), 0.001)
    unknown = missing(used, 0.992) if kind == "unexplained" else None
    form = {one.name: 0.4 for one in used}
    given = {
        "case": case,
        "verdict": kind,
        "asked": None,
        "law_from": "recordings",
        "law_fixed": False,
        "plain": plain,
        "material": YEOH,
        "parameters": {} if kind == "faulty_data" else values,
        "effects": effects,
        "probability": FEW | others | probability if probability else {},
        "models": models,
        "rivals": (),
        "groups": (),
        "form_error": FormError(0.083, form, 0.962) if explained else FormError(0.0, {}, 1.0),
        "missing": unknown,
        "searched": searched(models) if models else SearchExtent(False, 1.0, "faulty data", (), (), {}),
        "channels": used,
        "location": located(used) if models else locate(()),
        "remaining": located(used, after=True) if models else locate(()),
        "next_test": None,
        "maps": (half_plane(),) if kind not in ("explained", "faulty_data") else (),
        "faults": (fault(used[0]),) if kind == "faulty_data" else (),
        "conditions": (),
        "forward_solves": 140,
        "failed_solves": 2,
        "seconds": 171.0,
    }
    return Diagnosis(**(given | changes))


def fault(one, kind="sign", fatal=True, samples=()):
    """A fault in the data of a channel."""
    marked = np.zeros(len(one.path), dtype=bool)
    marked[list(samples)] = True
    where, remedy = {
        "sign": (
            "the force falls where the displacement grows, in all 6 cycles",
            "write force_factor = -1 in the case",
        ),
        "spikes": ("at 41.2, 66.0 and 88.7 s", "nothing: they are left out"),
    }[kind]
    return DataFault(one.name, kind, where, remedy, fatal, marked)


def rivalling(case):
    """Axial and radial; softening is certain, and so is dissipation, but not of which kind; all fields are filled."""
    axial = channel()
    radial = replace(channel("radial", loss=0.2, reach=2.0, stiffness=600.0, seed=2), held_out=True)
    spiked = np.zeros(len(axial.path), dtype=bool)
    spiked[[40, 90, 91]] = True
    force = axial.recording.force + np.where(spiked, 0.5 * np.ptp(axial.recording.force), 0.0)
    axial = replace(
        axial,
        faulty=spiked,
        recording=Recording("axial", axial.recording.displacement, force, axial.recording.time, name="axial"),
    )
    used = (axial, radial)
    models = ranked(
        ("yeoh", ("mullins", "friction"), 0.58),
        ("yeoh", ("mullins", "viscoelasticity"), 0.29),
        ("yeoh", ("mullins", "friction", "offset@radial"), 0.05),
        ("ogden", ("mullins", "friction"), 0.04),
        ("yeoh", ("mullins",), 0.012),
    )
    effects = (MULLINS, replace(FRICTION, probability=0.67))
    group = Group(
        "dissipation",
        ("friction", "viscoelasticity"),
        0.985,
        "dissipation: internal friction or viscoelasticity, which one rate cannot tell",
    )
    return diagnosis(
        case,
        channels=used,
        effects=effects,
        parameters={f"{one.name}.{name}": q for one in effects for name, q in one.parameters.items()},
        models=models,
        probability=FEW
        | {"mullins": 0.994, "friction": 0.67, "viscoelasticity": 0.31, "offset": 0.05}
        | {"unknown": 0.021, "nothing": 1e-9},
        rivals=(("mullins", "viscoelasticity"), ("mullins", "friction", "offset@radial")),
        groups=(group,),
        missing=missing(used, 0.021),
        searched=searched(models, complete=False, left=0.12, ended="budget"),
        next_test=NEXT,
        maps=(half_plane(names=("axial", "radial")),),
        faults=(fault(axial, "spikes", fatal=False, samples=(40, 90, 91)),),
        conditions=(Condition("coarse_noise", "the noise is known to 40 % only", "record more samples"),),
    )


def doubtful(case):
    """Either friction or viscoelasticity, which are not reported as a group: nothing is certain."""
    models = ranked(
        ("yeoh", ("friction",), 0.62),
        ("yeoh", ("viscoelasticity",), 0.30),
        ("yeoh", ("compressibility", "offset"), 0.05),
    )
    return diagnosis(
        case,
        effects=(FRICTION,),
        parameters={f"friction.{name}": q for name, q in FRICTION.parameters.items()},
        models=models,
        probability=FEW
        | {"friction": 0.62, "viscoelasticity": 0.30, "offset": 0.06, "compressibility": 0.05},
        rivals=(("viscoelasticity",), ("compressibility", "offset")),
        searched=searched(models),
        next_test=NEXT,
    )


def dissipating(case):
    """Like `doubtful`, but friction and viscoelasticity are reported as a group."""
    text = "dissipation: internal friction or viscoelasticity, which one rate cannot tell"
    group = Group("dissipation", ("friction", "viscoelasticity"), 0.97, text)
    models = ranked(("yeoh", ("friction",), 0.66), ("yeoh", ("viscoelasticity",), 0.31))
    return replace(
        doubtful(case),
        models=models,
        rivals=(("viscoelasticity",),),
        groups=(group,),
        searched=searched(models, complete=False, left=0.08, ended="budget"),
    )


def torsional(case):
    """A rotational channel with an offset that is a moment and an angle; without time."""
    one = channel("torsional", reach=0.4, stiffness=9000.0, time=False)
    values = {f"offset.{name}": q for name, q in LOOSE.parameters.items()}
    return diagnosis(
        case,
        channels=(one,),
        effects=(LOOSE,),
        models=ranked(("yeoh", ("offset",), 0.97)),
        probability={"offset": 0.97, "nothing": 0.02},
        parameters=values,
        missing=missing((one,), 0.04),
        maps=(),
    )
