"""A deck of dynamic tables with concealed physics, and how often `bushcli diagnose` is right about them.

Each entry is a bushing with a relaxing rubber, one or two tables of dynamic stiffness, and up to two effects of a
dynamic rig, of amplitude (`payne`) or of temperature; the last third has a slow curve beside the tables. The rubber of
every fourth entry relaxes by another formula than the tool's: a spring-pot beside a spring, a Cole-Cole element, or a
Cole-Cole element that the local amplitude thins. Truth has a finer mesh than the diagnosis, calibration factors and
noise. Truths are drawn and saved before anything is diagnosed.

Usage: ``setup/enter python -m benchmarks.dynamic_deck draw|run|score [DECK] [FIRST] [LAST]``; decks are "dev" (seeds
for trying), "frozen", and "second" to "fourth", each drawn when those before it had been used. Results are in
``benchmarks/dynamic_deck/``.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from benchmarks.decks.score import calibration_error, reliability
from bushcli.case import load_case
from bushcli.diagnosis.diagnose import diagnose
from bushcli.effects.library import payne
from bushcli.effects.names import effect_name
from bushcli.simulate.dynamic import DynamicCurve, vibrate
from bushcli.simulate.predict import predict
from cases.dynamic.reduction import Sweep
from cases.feature import Values
from cases.sine import ThinnedSpectrum
from forms.branches.maxwell import PACED
from forms.branches.payne import BRANCH
from forms.potential import Attached

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FOLDER = Path(__file__).parent / "dynamic_deck"
SEEDS = {"dev": 7000, "frozen": 91000, "second": 92000, "third": 93000, "fourth": 94000}
TABLES, STATIC = 40, 20
MODES = (("axial",), ("torsional",), ("axial",), ("radial",), ("axial", "torsional"))
RIGS = ("fixture_mass", "rig_resonance", "time_lag", "rig_compliance")
SURE = 0.95
# Odds of an effect of the rig when the decks were diagnosed.
ODDS_OF_THE_DAY = {"dev": 0.01, "frozen": 0.01, "second": 0.01, "third": 0.03, "fourth": 0.03}
# Relaxation time of a thinned Cole-Cole element at rest, s.
ELEMENT = 0.05
# Kelvins, kJ/mol: gas constant.
ZERO, GAS = 273.15, 8.314462618e-3


@dataclass(frozen=True)
class Truth:
    """An entry: sizes in mm, N, MPa, s, degrees."""

    name: str
    modes: tuple[str, ...]
    shape: tuple[float, float, float]
    C10: float
    formula: str
    relaxation: dict[str, float]
    effects: dict[str, dict[str, float]]
    on: str
    frequency: tuple[float, float, int]
    preload: tuple[float, ...]
    amplitude: tuple[float, ...]
    temperature: tuple[float, ...]
    noise: tuple[float, float]
    calibration: tuple[float, ...]
    static: bool

    @property
    def right(self) -> frozenset[str]:
        """Names of the effects that are there."""
        relaxing = "payne" if "payne" in self.formula else "viscoelasticity"
        return frozenset({relaxing, *self.effects})


def draw_truth(deck: str, number: int) -> Truth:
    """Return the truth of a number."""
    rng = np.random.default_rng([SEEDS[deck], number])
    modes, foreign = MODES[number % len(MODES)], number % 4 == 3
    inner = float(rng.uniform(8, 14))
    wall = float(rng.uniform(7, 12))
    length = float(rng.uniform(30, 50))
    low, high = float(10 ** rng.uniform(-0.3, 0.5)), float(10 ** rng.uniform(1.9, 2.4))
    kind = ("plain", "plain", "temperature", "amplitude", "plain")[int(rng.integers(5))]
    temperature = (10.0, 30.0, 60.0) if kind == "temperature" else ()
    amplitude = (
        tuple(float(a) for a in np.round(wall * np.array([0.002, 0.01, 0.05]), 4))
        if kind == "amplitude"
        else ()
    )
    thinned = kind == "amplitude" and rng.random() < 0.75
    points = {"plain": 20, "temperature": 10, "amplitude": 8}[kind]
    preload = (
        tuple(float(q) for q in np.round(wall * np.array([0.0, 0.1, 0.2]), 2)) if kind == "plain" else (0.0,)
    )
    if thinned:
        formula = "payne cole-cole" if foreign else "payne"
        relaxation = {
            "g": float(rng.uniform(0.5, 1.5)),
            "tau": float(10 ** rng.uniform(0.0, 2.0)),
            "decades": float(rng.uniform(4, 6)),
            "slope": 0.0,
            "path": float(10 ** rng.uniform(2.0, 3.5)),
            "exponent": float(rng.uniform(1.0, 1.6)),
            "beta": float(rng.uniform(0.2, 0.35)),
            "strain": float(10 ** rng.uniform(-2.3, -1.7)),
            "power": float(rng.uniform(1.5, 3.0)),
        }
    elif foreign:
        formula = ("spring-pot", "cole-cole")[int(rng.integers(2))]
        relaxation = {
            "g": float(rng.uniform(0.1, 0.4)) if formula == "spring-pot" else float(rng.uniform(0.3, 1.0)),
            "tau": float(10 ** rng.uniform(-3, -2)),
            "beta": float(rng.uniform(0.2, 0.5)),
        }
    else:
        formula, count = "maxwell", int(rng.integers(1, 3))
        edge = np.log10([1 / (2 * np.pi * high), 1 / (2 * np.pi * low)])
        times = np.sort(
            10 ** (edge[0] + (edge[1] - edge[0]) * (np.arange(count) + rng.uniform(0.2, 0.8, count)) / count)
        )
        relaxation = {f"g{i + 1}": float(g) for i, g in enumerate(rng.uniform(0.08, 0.4, count))}
        relaxation |= {f"tau{i + 1}": float(t) for i, t in enumerate(times)}
    effects: dict[str, dict[str, float]] = {}
    if temperature:
        effects["temperature"] = {"E": float(rng.uniform(20, 90)), "exponent": float(rng.uniform(-0.5, 1.5))}
    rigs = ["fixture_mass", "rig_resonance", "time_lag"] + ["rig_compliance"] * (
        modes == ("axial", "torsional")
    )
    for name in rng.permutation(rigs)[
        : int(rng.choice([0, 1, 1, 2]) if kind == "plain" else rng.integers(2))
    ]:
        # Relative to the stiffness at the highest frequency: `rig`. A late displacement is left out: it is what a fast
        # branch of the rubber does.
        span = {
            "fixture_mass": (0.06, 0.4),
            "rig_resonance": (0.2, 0.6),
            "time_lag": (0.8, 3.5),
            "rig_compliance": (0.08, 0.3),
        }
        size = float(rng.uniform(*span[str(name)]))
        effects[str(name)] = {"size": size}
    return Truth(
        f"{number:03d}",
        modes,
        (round(inner, 2), round(inner + wall, 2), round(length, 2)),
        float(rng.uniform(0.35, 0.9)),
        formula,
        relaxation,
        effects,
        modes[0],
        (low, high, points),
        preload,
        amplitude,
        temperature,
        (float(10 ** rng.uniform(-2.5, -1.9)), float(10 ** rng.uniform(-1.0, -0.4))),
        tuple(float(c) for c in 1 + 0.004 * rng.standard_normal(3)),
        number >= TABLES,
    )


def case_text(truth: Truth, finer: int) -> str:
    """Return geometry and law of a case."""
    a, b, length = truth.shape
    return f"""
[geometry]
shape = "plain"
inner_radius = {a}
outer_radius = {b}
length = {length}
[mesh]
elements_across = {3 + finer}
elements_along = {5 + finer}
elements_around = {8 + 2 * finer}
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
density = 1100.0
[material.parameters]
C10 = {truth.C10 if finer else 0.5}
"""


def modulus(truth: Truth, frequency: Array) -> Complex:
    """Return the complex modulus of the relaxation over the law's, of small amplitudes, at the reference."""
    values, turned = truth.relaxation, 2j * np.pi * frequency
    if truth.formula == "spring-pot":
        return np.asarray(values["g"] * (turned * values["tau"]) ** values["beta"])
    if truth.formula == "cole-cole":
        w = (turned * values["tau"]) ** values["beta"]
        return np.asarray(values["g"] * w / (1 + w))
    branches = [(values[f"g{i}"], turned * values[f"tau{i}"]) for i in (1, 2) if f"g{i}" in values]
    return np.asarray(sum(g * x / (1 + x) for g, x in branches))


class ThinnedColeCole(ThinnedSpectrum):
    """A Cole-Cole element whose time the local amplitude of shear shortens, in place of the tool's spectrum."""

    def harmonics(
        self, amplitude: Array, frequency: Array | float, third: bool = True
    ) -> tuple[Complex, ...]:
        """Return the first harmonic of the stress over the strain's; the third is zero."""
        strain, power, beta, tau = self.constants
        w = (2j * np.pi * frequency * tau / (1 + (amplitude / strain) ** power)) ** beta
        return (self.path * w / (1 + w), 0 * w)[: 1 + third]


def foreign_thinned(truth: Truth, like: ThinnedSpectrum) -> ThinnedColeCole:
    """Return the thinned Cole-Cole element of a truth."""
    values = truth.relaxation
    element = ThinnedColeCole(like.moduli, like.times, values["g"], like.offset, like.exponent)
    object.__setattr__(element, "constants", (values["strain"], values["power"], values["beta"], ELEMENT))
    return element


def rig(truth: Truth, mode: str, frequency: Array, K: Complex, stiffest: float) -> Complex:
    """Return K* as the rig measures it."""
    omega, top = 2 * np.pi * frequency, 2 * np.pi * truth.frequency[1]
    for name, values in truth.effects.items():
        size = values.get("size", 0.0)
        if name == "rig_compliance" and mode == "axial":
            K = 1 / (1 / K + size / stiffest)
        elif name == "fixture_mass" and mode == truth.on:
            K = K - size * stiffest * (omega / top) ** 2
        elif name == "rig_resonance" and mode == truth.on:
            K = K / (1 - (size * frequency / truth.frequency[1]) ** 2)
        elif name == "time_lag":
            K = K * np.exp(-1j * np.radians(size) * omega / top)
    return K


def tables(truth: Truth, folder: Path, rng: np.random.Generator) -> None:
    """Write the tables of an entry, and its slow curve."""
    low, high, points = truth.frequency
    frequency = np.round(np.geomspace(low, high, points), 3)
    thinned = "payne" in truth.formula
    names = ("g", "tau", "decades", "slope", "path", "exponent")
    loads = ""
    for mode in truth.modes:
        per = 1.0 if mode != "torsional" else np.degrees(1.0) / truth.shape[0]
        amplitude = [float(per * a) for a in truth.amplitude]
        loads += f'\n[[load_cases]]\nmode = "{mode}"\n[load_cases.dynamic]\n'
        preload = [float(round(per * q, 4)) for q in truth.preload]
        loads += f"preload = {preload}\nfrequency = {frequency.tolist()}\n"
        loads += f"amplitude = {amplitude}\n" if thinned else ""
    own = (
        {name: truth.relaxation[name] for name in names}
        if thinned
        else {"g1": 0.5, "tau1": 0.01, "g2": 0.5, "tau2": 0.001}
    )
    given = ", ".join(f"{k} = {v}" for k, v in own.items())
    effect = (
        f'\n[[effects]]\nname = "{"payne" if thinned else "viscoelasticity"}"\nparameters = {{ {given} }}\n'
    )
    (folder / "truth.toml").write_text(case_text(truth, 1) + effect + loads)
    response = vibrate(load_case(folder / "truth.toml"))
    for mode, factor in zip(truth.modes, truth.calibration, strict=False):
        curves = [curve for curve in response.curves if curve.mode == mode]
        stiffest = max(float(np.abs(curve.stiffness).max()) for curve in curves)
        rows = [row for curve in curves for row in _rows(truth, curve, frequency, stiffest)]
        per, unit, length = (
            (1.0, "N_per_mm", "mm") if mode != "torsional" else (np.radians(1.0), "Nmm_per_deg", "deg")
        )
        head = f"frequency_Hz,preload_{length},stiffness_{unit},loss_angle_deg"
        head += f",amplitude_{length}" if truth.amplitude else ""
        head += ",temperature_C" if truth.temperature else ""
        lines = [head]
        for f, q, K, a, T in rows:
            size = factor * abs(K) * per * (1 + truth.noise[0] * rng.standard_normal())
            # A rig's software gives no negative one.
            angle = max(np.degrees(np.angle(K)) + truth.noise[1] * rng.standard_normal(), 0.0)
            shown = [f"{f:g}", f"{q / per if mode == 'torsional' else q:.4g}", f"{size:.5g}", f"{angle:.3f}"]
            shown += [f"{a / per if mode == 'torsional' else a:.5g}"] if truth.amplitude else []
            shown += [f"{T:g}"] if truth.temperature else []
            lines.append(",".join(shown))
        (folder / f"{mode}.csv").write_text("\n".join(lines) + "\n")


def _rows(
    truth: Truth, curve: DynamicCurve, frequency: Array, stiffest: float
) -> list[tuple[float, float, complex, float, float]]:
    rows = []
    thinned = "payne" in truth.formula
    amplitudes = truth.amplitude or (float("nan"),)
    if thinned:
        assert curve.amplitude is not None
        assert curve.uneven is not None
        K = curve.stiffness
        if truth.formula == "payne cole-cole":
            other = curve.uneven.of(foreign_thinned(truth, curve.uneven._thinned), ())
            K = np.array(
                [
                    balance.stiffness
                    for balance in other.balances(np.full(len(frequency), curve.amplitude), frequency)
                ]
            )
        K = rig(truth, curve.mode, frequency, K, stiffest)
        return [
            (float(f), curve.preload, complex(k), curve.amplitude, np.nan)
            for f, k in zip(frequency, K, strict=True)
        ]
    for T in truth.temperature or (float("nan"),):
        slower, stiffer = 1.0, 1.0
        if truth.temperature:
            values, Tr = truth.effects["temperature"], 30.0 + ZERO
            slower = float(np.exp(values["E"] / GAS * (1 / (T + ZERO) - 1 / Tr)))
            stiffer = ((T + ZERO) / Tr) ** values["exponent"]
        s = modulus(truth, slower * frequency)
        at = Sweep(s, (2 * np.pi * frequency) ** 2)
        K = stiffer * curve.model._entry_of_motion(np.array(curve.model.reduced.stiffness(at)))
        K = rig(truth, curve.mode, frequency, K, stiffest)
        per = 1.0 if curve.mode != "torsional" else 1.0 / truth.shape[0]
        rows += [
            (float(f), curve.preload, complex(k), per * a, T)
            for a in amplitudes
            for f, k in zip(frequency, K, strict=True)
        ]
    return rows


def thinned_branches(truth: Truth, values: Values) -> list[Attached]:
    """Return the branches of a thinned Cole-Cole element along time, in place of those of `payne`."""
    own = truth.relaxation
    # Faster branches have relaxed in any step of the slow curve, slower ones are springs in it: they count in the last.
    x = np.log(np.geomspace(1e-2, 1e6, 24) / ELEMENT)
    inside = (x[1:] + x[:-1]) / 2
    # The integral of the spectrum of Cole and Cole, 1 / (1 + (i omega tau)^-beta).
    below = 0.5 + np.arctan(np.tan(np.pi * own["beta"] / 2) * np.tanh(own["beta"] * inside / 2)) / (
        np.pi * own["beta"]
    )
    moduli = own["g"] * np.diff(below, append=1.0)
    clock = {"path": 0.0, "offset": 1e-9, "exponent": own["power"], "fading": 0.0}
    clock["pace"] = own["strain"] ** -own["power"]
    branches = [
        Attached(PACED, {"g": float(g), "tau": float(ELEMENT * np.exp(at))})
        for g, at in zip(moduli, x[1:], strict=True)
    ]
    return [Attached(BRANCH, clock), *branches]


def slow_curve(truth: Truth, folder: Path, rng: np.random.Generator) -> None:
    """Write a slow axial way of an entry, whose rubber relaxes as in its tables."""
    travel = 0.3 * (truth.shape[1] - truth.shape[0])
    period = 40.0
    t = np.linspace(0, 1, 81)
    q = travel * np.interp(t, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    np.savetxt(
        folder / "drive.csv",
        np.column_stack([period * t, q]),
        delimiter=",",
        header="time_s,displacement_mm",
        comments="",
    )
    f = np.geomspace(1e-3, truth.frequency[1], 60)
    if "payne" in truth.formula:
        names = ("g", "tau", "decades", "slope", "path", "exponent")
        effect = (
            f'name = "payne"\nparameters = {{ {", ".join(f"{k} = {truth.relaxation[k]}" for k in names)} }}'
        )
    else:
        from scipy.optimize import nnls

        s, times = modulus(truth, f), 1 / (2 * np.pi * np.geomspace(1e-3, truth.frequency[1], 6))
        x = 2j * np.pi * f[:, None] * times
        design = x / (1 + x)
        g = nnls(np.vstack([design.real, design.imag]), np.concatenate([s.real, s.imag]))[0]
        given = ", ".join(
            f"g{i} = {a:.6g}, tau{i} = {b:.6g}" for i, (a, b) in enumerate(zip(g, times, strict=True), 1)
        )
        effect = f'name = "viscoelasticity"\nparameters = {{ {given} }}'
    load = '\n[[load_cases]]\nmode = "axial"\nfile = "drive.csv"\n'
    (folder / "slow.toml").write_text(case_text(truth, 1) + f"\n[[effects]]\n{effect}\n" + load)
    relaxing = partial(thinned_branches, truth) if truth.formula == "payne cole-cole" else payne._branches
    with patch.object(payne, "_branches", relaxing):
        (answer,) = predict(load_case(folder / "slow.toml")).channels
    curve = answer.curve
    force = truth.calibration[2] * np.interp(period * t, curve.time, curve.force)
    force = force + 0.002 * np.ptp(force) * rng.standard_normal(len(force))
    np.savetxt(
        folder / "slow.csv",
        np.column_stack([period * t, q, force]),
        delimiter=",",
        header="time_s,displacement_mm,force_N",
        comments="",
    )


def write_case(truth: Truth, deck: str, folder: Path) -> Path:
    """Write an entry's case and recordings; return the case."""
    rng = np.random.default_rng([SEEDS[deck], int(truth.name), 1])
    tables(truth, folder, rng)
    text = case_text(truth, 0)
    for mode in truth.modes:
        text += f'\n[[recordings]]\nmode = "{mode}"\nkind = "dynamic"\nname = "{mode}-table"\nfile = "{mode}.csv"\n'
        text += 'amplitude_is = "peak"\n' if truth.amplitude else ""
    if truth.static:
        slow_curve(truth, folder, rng)
        text += '\n[[recordings]]\nmode = "axial"\nname = "slow"\nfile = "slow.csv"\n'
        text += "temperature = 30.0\n" if truth.temperature else ""
    (folder / "case.toml").write_text(text)
    return folder / "case.toml"


def diagnose_entry(truth: Truth, deck: str) -> dict[str, Any]:
    """Diagnose an entry; return what is said."""
    with TemporaryDirectory() as name:
        case = write_case(truth, deck, Path(name))
        begin = time.perf_counter(), time.process_time()
        diagnosis = diagnose(load_case(case), maps=False, budget=1200.0)
        sets = (
            [
                sorted(set(map(effect_name, names)))
                for names in (diagnosis.models[0].effects, *diagnosis.rivals)
            ]
            if diagnosis.models
            else []
        )
        return {
            "name": truth.name,
            "verdict": diagnosis.verdict,
            "probability": {k: round(v, 4) for k, v in diagnosis.probability.items()},
            "sets": sets,
            "before": {
                channel.name: round(channel.before_percent, 3) for channel in diagnosis.measured_channels
            },
            "after": {
                channel.name: round(channel.after_percent, 3) for channel in diagnosis.measured_channels
            },
            "next_test": None if diagnosis.next_test is None else diagnosis.next_test.name,
            "seconds": round(time.perf_counter() - begin[0], 1),
            "cpu": round(time.process_time() - begin[1], 1),
        }


def at_deck_odds(truths: dict[str, Truth], deck: str, probability: dict[str, float]) -> dict[str, float]:
    """Return the probabilities of an answer with the frequencies of the deck in place of the tool's odds.

    A table of the deck has a given effect of the rig ten to thirty times as often as an engineer's. Answers have no
    probabilities of sets: effects of the rig that are not sure (95 %) are taken for alternatives, one of them or none.
    """
    often = {name: sum(name in t.right for t in truths.values()) / len(truths) for name in RIGS}
    open_ones = {name: probability.get(name, 0.0) for name in RIGS if probability.get(name, 0.0) < SURE}
    weights = {
        name: p * often[name] / (1.0 - often[name]) / ODDS_OF_THE_DAY[deck] for name, p in open_ones.items()
    }
    total = max(1.0 - sum(open_ones.values()), 0.0) + sum(weights.values())
    return probability | {name: weight / total for name, weight in weights.items() if total > 0.0}


def score_lines(truths: dict[str, Truth], deck: str, answers: dict[str, dict[str, Any]]) -> list[str]:
    """Return the lines of the score of a deck."""
    groups = {
        "tables": lambda t: not t.static,
        "static beside tables": lambda t: t.static,
        "foreign formulas": lambda t: t.formula not in ("maxwell", "payne"),
        "all": lambda t: True,
    }
    heads = "| | entries | right set in the credible set | named outright | absent effect stated "
    lines = [f"{heads}| calibration error, at the deck's odds | median, longest CPU s |"]
    lines.append("| --- | --- | --- | --- | --- | --- | --- |")
    for name, chosen in groups.items():
        own = [(truths[k], a) for k, a in answers.items() if chosen(truths[k])]
        if not own:
            continue
        inside = sum(t.right in [frozenset(names) for names in a["sets"]] for t, a in own)
        outright = sum([frozenset(names) for names in a["sets"]] == [t.right] for t, a in own)
        wrong = [
            f"{t.name} {n}"
            for t, a in own
            for n, p in a["probability"].items()
            if p > SURE and n not in t.right
        ]
        errors = []
        for convert in (dict, partial(at_deck_odds, truths, deck)):
            said = [
                (p, n in t.right)
                for t, a in own
                for n, p in convert(a["probability"]).items()
                if n not in ("nothing", "free_law")
            ]
            errors.append(f"{calibration_error(reliability(said)):.3f}")
        cpu = [a["cpu"] for _, a in own]
        spent = f"{np.median(cpu):.0f}, {max(cpu):.0f}"
        stated = f"{len(wrong)} ({', '.join(wrong)})" if wrong else "0"
        lines.append(
            f"| {name} | {len(own)} | {inside} | {outright} | {stated} | {', '.join(errors)} | {spent} |"
        )
    lines.append("")
    for k, a in answers.items():
        if truths[k].right not in [frozenset(names) for names in a["sets"]]:
            said = " or ".join("+".join(names) for names in a["sets"])
            lines.append(f"- {k}: {'+'.join(sorted(truths[k].right))} ({truths[k].formula}); said {said}")
    return lines


def main(what: str, deck: str = "dev", first: int = 0, last: int = TABLES + STATIC) -> None:
    """Draw, run or score."""
    FOLDER.mkdir(exist_ok=True)
    file, results = FOLDER / f"{deck}-truths.jsonl", FOLDER / f"{deck}-answers.jsonl"
    if what == "draw":
        lines = [json.dumps(asdict(draw_truth(deck, number))) for number in range(first, last)]
        file.write_text("\n".join(lines) + "\n")
        return
    truths = {}
    for line in file.read_text().splitlines():
        fields = json.loads(line)
        truths[fields["name"]] = Truth(
            **{k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
        )
    done = [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []
    answers = {answer["name"]: answer for answer in done}
    if what == "run":
        for number in range(first, last):
            name = f"{number:03d}"
            if name in answers:
                continue
            try:
                answer = diagnose_entry(truths[name], deck)
            except Exception as error:  # noqa: BLE001 - an entry that fails is counted
                answer = {
                    "name": name,
                    "verdict": f"{type(error).__name__}: {error}",
                    "probability": {},
                    "sets": [],
                    "cpu": 0.0,
                }
            with results.open("a") as stream:
                stream.write(json.dumps(answer) + "\n")
            sys.stdout.write(f"{name} {'+'.join(sorted(truths[name].right))}: {answer}\n")
            sys.stdout.flush()
        return
    sys.stdout.write("\n".join(score_lines(truths, deck, answers)) + "\n")


if __name__ == "__main__":
    arguments = sys.argv[1:]
    main(*arguments[:2], *map(int, arguments[2:]))
