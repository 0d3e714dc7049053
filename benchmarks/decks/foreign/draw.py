"""Draw a foreign recording: a bushing, a formula, and a size by its share of the curves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.simulate import Channel, force
from benchmarks.concealed.strength import beside_a_factor, rest_beside
from benchmarks.concealed.truth import Specimen
from benchmarks.decks.drawing import CALIBRATION, Unsuitable, channel_programs, sensors, specimen
from benchmarks.decks.foreign.external import Failed
from benchmarks.decks.foreign.forces import concealed_forces, elastic, with_fewer_samples
from benchmarks.decks.foreign.formulas import FORMULAS, Situation, law_of
from benchmarks.decks.foreign.halfplane import NotSolved
from benchmarks.decks.manifest import Entry
from benchmarks.decks.plan import Card
from cases.march import NotConverged
from cases.mode import modes

Array = NDArray[np.float64]

# As in the own deck: percent of the range; standard errors below which a rich program is drawn again; attempts.
SHARE, SEEN, ATTEMPTS = (0.5, 15.0), 4.0, 8
LAWS = ("yeoh", "mooney_rivlin", "gent")
# Number of samples with which a size is sought.
THIN = 100
# Largest share of the travel that a rig in series may take: a larger one would be obvious.
GIVES = 0.2
# Steps of the fit of a law to a MORPH rubber.
STEPS = 6
# Weight of the drawn constants: a constant at twice its drawn value counts like a misfit of this share of the range.
TETHER = 0.01


def draw_recording(card: Card) -> Entry:
    """Draw a recording.

    Raises
    ------
    Unsuitable
    """
    reasons = []
    for attempt in range(ATTEMPTS):
        try:
            return _attempt(card, (*card.seed, attempt))
        except (Unsuitable, NotConverged, NotSolved, Failed) as failure:
            reasons.append(f"{type(failure).__name__}: {failure}")
    raise Unsuitable("; ".join(reasons))


def _attempt(card: Card, seed: tuple[int, ...]) -> Entry:
    rng = np.random.default_rng(seed)
    (name,) = card.names
    formula = FORMULAS[name]
    channels = formula.menu[int(rng.integers(len(formula.menu)))]
    program = card.program if len(channels) == 1 else "rich"
    body = specimen(rng, channels, ("yeoh",) if formula.base in ("solid", "morph") else LAWS)
    body = replace(body, bulk_modulus=float(rng.choice([2000.0, 4000.0])))
    programs, fast = channel_programs(rng, program, channels)
    felt = sensors(rng, seed, channels)
    wanted = float(np.exp(rng.uniform(*np.log(SHARE))))
    values = formula.values(rng, situation(body, fast, program))
    entry = Entry(
        name="",
        part="foreign",
        kind="single" if len(formula.truth) == 1 else "pair",
        program=program,
        seed=seed,
        specimen=body,
        programs=programs,
        sensors=felt,
        formulas=({"name": name, **values},),
        truth=formula.truth,
        also_right=formula.also_right,
    )
    thin = with_fewer_samples(entry, THIN)
    if "knee" in values or "more" in values:
        # The joint's reference force: the largest one in a translation.
        largest = max(
            float(np.abs(f).max())
            for f, c in zip(elastic(entry, thin), thin, strict=True)
            if c.name != "torsional"
        )
        values["largest"] = float(f"{largest:.5g}")
        entry = with_values(entry, values)
    if formula.base == "morph":
        entry = _with_nearest_law(entry, thin)
        shown, share = change_beside_law(entry, thin, concealed_forces(entry, thin))
    else:
        usual, size = values["amplitude"], 1.0
        most = min(formula.most, rig_gives(values, entry) / usual)
        shown, share = change_beside_law(entry, thin, concealed_forces(entry, thin))
        for _ in range(2):
            best = float(np.clip(size * wanted / max(share, 1e-9), formula.least, most))
            if abs(np.log(best / size)) < 0.15:
                break
            size = best
            values["amplitude"] = float(f"{usual * size:.5g}")
            entry = with_values(entry, values)
            shown, share = change_beside_law(entry, thin, concealed_forces(entry, thin))
    # Scale the standard errors to the final number of samples.
    shown *= float(np.sqrt(sum(p.samples for p in programs) / sum(len(c.time) for c in thin)))
    if program == "rich" and shown < SEEN:
        raise Unsuitable(f"{name} shows by {shown:.1f} standard errors")
    return replace(entry, strength={name: round(shown, 2)}, share=round(share, 3))


def with_values(entry: Entry, values: dict[str, Any]) -> Entry:
    """Return the recording with other values of its formula."""
    (formula,) = entry.formulas
    return replace(entry, formulas=({"name": formula["name"], **values},))


def rig_gives(values: dict[str, Any], entry: Entry) -> float:
    """Largest amplitude of a rig in series that takes at most the share GIVES of the travel; infinite for others."""
    if "largest" not in values:
        return np.inf
    travel = min(a for c, a in entry.specimen.amplitude.items() if c != "torsional")
    unit = np.tanh(1 / values["knee"]) + values["rest"] if "knee" in values else 1 + values["more"]
    return GIVES * travel / float(unit)


def situation(body: Specimen, fast: float, program: str) -> Situation:
    """Return the quantities on which usual values depend."""
    d = body.dimensions
    thickness = d["outer_radius"] - d["inner_radius"]
    first = next(iter(body.amplitude))
    a, b = d["inner_radius"], d["outer_radius"]
    lever = 2 * b**2 / (b**2 - a**2) if first == "torsional" else 1 / thickness
    return Situation(
        thickness=thickness,
        length=d.get("length", d.get("inner_length", 0.0)),
        fast=fast,
        duration=12 * fast,
        shear=law_of(body).shear,
        strain=body.amplitude[first] * lever,
    )


def change_beside_law(entry: Entry, channels: list[Channel], exact: list[Array]) -> tuple[float, float]:
    """Standard errors, and percent of the range, of the change of the forces that a law cannot imitate."""
    body = entry.specimen
    rows, slopes, scale = [], [], []
    for c, sensor, f, plain in zip(channels, entry.sensors, exact, elastic(entry, channels), strict=True):
        own, slope = force(body, c, finer=False, names=tuple(body.parameters))
        span = float(np.ptp(f))
        sigma = sensor.noise / 100 * span
        spread = CALIBRATION[modes()[c.name].section is None]
        rows.append(beside_a_factor((f - plain) / sigma, own / sigma, spread))
        slopes.append(beside_a_factor(slope / sigma, own / sigma, spread))
        scale.append(np.full(len(f), sigma / span))
    rest = rest_beside(np.concatenate(rows), [np.vstack(slopes)])
    return float(np.linalg.norm(rest)), 100 * float(np.sqrt(np.mean((rest * np.concatenate(scale)) ** 2)))


def _with_nearest_law(entry: Entry, channels: list[Channel]) -> Entry:
    """Return the recording with the law that is nearest to a MORPH rubber."""
    exact = concealed_forces(entry, channels)
    body = entry.specimen
    names = tuple(body.parameters)
    for _ in range(STEPS):
        rows, slopes = [], []
        for c, f in zip(channels, exact, strict=True):
            own, slope = force(body, c, finer=False, names=names)
            rows.append((f - own) / float(np.ptp(f)))
            slopes.append(slope / float(np.ptp(f)))
        J, d = np.vstack(slopes), np.concatenate(rows)
        # Where the curve does not determine the law, it keeps the shape of the drawn law, so that it stays stable.
        now = np.array([body.parameters[n] for n in names])
        drawn_ = np.array([entry.specimen.parameters[n] for n in names])
        held = TETHER * np.sqrt(len(d)) * np.diag(1 / np.abs(drawn_)) * np.array([0.0, 1.0, 1.0])
        away = held @ (now[0] / drawn_[0] * drawn_ - now)
        step = np.linalg.lstsq(np.vstack([J, held]), np.concatenate([d, away]), rcond=1e-10)[0]
        values = {n: float(f"{x + s:.5g}") for n, x, s in zip(names, now, step, strict=True)}
        if values["C10"] <= 0 or values["C30"] <= 0:
            raise Unsuitable("no stable law is near")
        body = replace(body, parameters=values)
    return replace(entry, specimen=body)
