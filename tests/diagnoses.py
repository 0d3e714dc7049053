"""Diagnoses made by hand from closed-form curves: no mesh, no march. What is located is located by the code itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bushcli.casefile import Material
from bushcli.condition import Condition
from bushcli.diagnosis.locate import locate
from bushcli.diagnosis.noise_model import Compared, NoiseModel
from bushcli.diagnosis.result import (
    DiagnosedChannel,
    Diagnosis,
    Hypothesis,
    LocalMap,
    Named,
    NextTest,
    Quantity,
    Stage,
)
from bushcli.recording import Recording

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
    """Time and displacement through 0, peak, 0, ...; equal samples on every way."""
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
    """A channel whose rubber softens; the plain law is the mean of it, the final model the truth (or the law again)."""
    t, q = program([reach / 2, reach / 2, reach / 2, reach, reach, reach], reach / 12.0)
    truth = softened(q, stiffness, loss)
    unit = noise * np.ptp(truth)
    measured = truth + np.random.default_rng(seed).normal(size=len(q)) * unit
    virgin = softened(q, stiffness, 0.0)
    before = virgin * (virgin @ measured) / (virgin @ virgin)
    after = truth if explained else before
    recording = Recording(mode, q, measured, t if time else None, name=mode)
    held = np.zeros(len(q), dtype=bool)
    held[-48:] = True
    percent = 100.0 / np.ptp(measured)

    def rms(force, where):
        return float(percent * np.sqrt(np.mean((force - measured)[where] ** 2)))

    return DiagnosedChannel(
        mode,
        mode,
        recording,
        before,
        after,
        rms(before, ~held | held),
        rms(after, ~held | held),
        percent * unit,
        held,
        "cycle 6",
        rms(before, held),
        rms(after, held),
        q,
    )


def located(channels, after=False):
    """Where the misfit is, by the code that says so in a diagnosis."""
    return locate(
        [
            Compared(
                one.recording,
                one.after if after else one.before,
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
    """The same in a solid, half of it (y >= 0) or all."""
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


MULLINS = Named(
    "mullins",
    "Reloading below the largest earlier deformation is softer than the first loading.",
    {
        "inverse_r": Quantity(
            0.312, 0.008, "1", "largest share of the stress that is lost", 0.296, 0.328, {"r": (3.205, "1")}
        ),
        "m": Quantity(0.102, 0.011, "MPa", "energy below W_max at which softening sets in", 0.081, 0.125),
        "beta": Quantity(0.0, 0.03, "1", "growth of that energy with W_max", 0.0, 0.06),
    },
    412.0,
    True,
    "filled rubber loses 20 to 50 % of its stress after a first loading",
)
LOOSE = Named(
    "offset",
    "Force or displacement is logged where there is none.",
    {
        "force": Quantity(90.0, 4.0, "N", "logged without load", 82.0, 98.0),
        # 1.146 degrees.
        "displacement": Quantity(0.02, 0.002, "mm", "logged at rest", 0.016, 0.024),
    },
    9.0,
    False,
    "",
)


def hypotheses(chosen=("mullins",)):
    """What was thought of: some refitted, some only scored, some that cannot be tested."""
    return (
        Hypothesis(
            "mullins",
            True,
            "",
            880.0,
            29.4,
            1e-180,
            {"inverse_r": 0.28},
            True,
            -412.0,
            1.02,
            "mullins" in chosen,
        ),
        Hypothesis(
            "friction",
            True,
            "",
            510.0,
            22.1,
            1e-90,
            {"g": 0.14},
            True,
            -201.0,
            1.61,
            "friction" in chosen,
        ),
        Hypothesis("viscoelasticity", True, "", 333.0, 17.9, 1e-60, {"g1": 0.11}, True, -122.0, 1.80),
        Hypothesis("law: gent", True, "", 8.0, 2.1, 0.03, {}, True, 3.0, 2.21),
        Hypothesis("offset", True, "", 0.4, 0.6, 0.27, {"force": 0.2}),
        Hypothesis("batch_stiffness", False, "the law's own parameters do the same", NAN, NAN, NAN, {}),
        Hypothesis("time_lag", False, "one rate only: a lag looks like friction", NAN, NAN, NAN, {}),
    )


NEXT = NextTest(
    "axial, with a hold at the peak",
    "axial",
    (0.0, 6.0, 0.0, 6.0, 0.0),
    (0.5, 0.5, 5.0, 5.0),
    (0.0, 60.0, 0.0, 60.0, 0.0),
    8.0,
    (("mullins", "friction"), ("mullins", "viscoelasticity")),
    9.3,
    "axial to 6 mm at 0.5 and 5 mm/s with a hold of 60 s at the peak (8 minutes) would set mullins and friction 9 "
    "standard errors apart",
)


def diagnosis(case, kind="missing_physics", channels=None, **changes):
    """A diagnosis with this verdict."""
    explained = kind in ("missing_physics", "law_too_poor")
    loss = 0.0 if kind == "explained" else 0.25
    used = channels or (channel(loss=loss, explained=explained),)
    effects = (MULLINS,) if kind == "missing_physics" else ()
    names = tuple(effect.name for effect in effects)
    values = {
        "C10": Quantity(0.5, 0.002, "MPa", "coefficient of I1 - 3", 0.496, 0.504),
        "C20": Quantity(-0.05, 0.004, "MPa", "coefficient of (I1 - 3)^2", -0.058, -0.042),
        "C30": Quantity(0.01, 0.003, "MPa", "coefficient of (I1 - 3)^3", 0.004, 0.016),
    } | {f"{effect.name}.{name}": q for effect in effects for name, q in effect.parameters.items()}
    path = [Stage("fit", (), "yeoh", 2210.0, 2.4, 2.9, "the plain law, fitted to all channels")]
    if effects:
        path += [
            Stage(
                "add", names, "yeoh", 1798.0, 1.02, 1.05, "mullins has the largest score and predicts cycle 6"
            ),
            Stage(
                "refuse",
                (*names, "friction"),
                "yeoh",
                1803.0,
                1.01,
                1.06,
                "friction beside it makes BIC worse",
            ),
        ]
    path.append(
        Stage("stop", names, "yeoh", 1798.0 if effects else 2210.0, 1.02, 1.05, "the noise is reached")
    )
    plain = Material("neo_hookean", 2000.0, {"C10": 0.5}) if kind == "law_too_poor" else YEOH
    given = {
        "case": case,
        "verdict": kind,
        "asked": None,
        "law_from": "recordings",
        "law_fixed": False,
        "plain": plain,
        "material": YEOH,
        "parameters": values,
        "effects": effects,
        "hypotheses": hypotheses(names),
        "path": tuple(path),
        "channels": used,
        "location": located(used),
        "remaining": located(used, after=True),
        "rivals": (),
        "next_test": None,
        "maps": (half_plane(),) if kind != "explained" else (),
        "conditions": (),
        "forward_solves": 140,
        "failed_solves": 2,
        "seconds": 171.0,
    }
    return Diagnosis(**(given | changes))


def rivalling(case):
    """Axial and radial, rivals, a next test, a map of both, a condition; nothing held out of the radial channel."""
    radial = channel("radial", loss=0.2, reach=2.0, stiffness=600.0, seed=2)
    radial = replace(
        radial,
        held_out=np.zeros_like(radial.held_out),
        held_out_text="",
        held_out_before=NAN,
        held_out_after=NAN,
    )
    return diagnosis(
        case,
        channels=(channel(), radial),
        rivals=(("mullins",), ("friction", "viscoelasticity")),
        next_test=NEXT,
        maps=(half_plane(names=("axial", "radial")),),
        conditions=(Condition("coarse_noise", "the noise is known to 40 % only", "record more samples"),),
    )


def torsional(case):
    """A rotational channel with an offset that is a moment and an angle; without time."""
    one = channel("torsional", reach=0.4, stiffness=9000.0, time=False)
    values = {f"offset.{name}": q for name, q in LOOSE.parameters.items()}
    return diagnosis(case, channels=(one,), effects=(LOOSE,), parameters=values, maps=())
