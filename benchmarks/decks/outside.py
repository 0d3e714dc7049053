"""The deck without effects and with physics outside the catalogue: elastic curves, and physics of no known effect.

All are made from the elastic curve by third-order elements; nothing is computed by the diagnosis' `Simulation`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.simulate import Channel, force
from benchmarks.concealed.strength import beside_a_factor, rest_beside
from benchmarks.concealed.truth import Specimen
from benchmarks.decks.drawing import (
    CALIBRATION,
    Unsuitable,
    channel,
    channel_programs,
    channels_of,
    sensors,
    specimen,
    with_fault,
)
from benchmarks.decks.elastic import elastic
from benchmarks.decks.manifest import Entry
from benchmarks.decks.plan import Card
from bushcli.curve.segment import excursions
from cases.march import NotConverged
from cases.mode import modes

Array = NDArray[np.float64]
Formula = Mapping[str, Any]

LAWS = ("yeoh", "mooney_rivlin", "gent")
# Faults of the recordings with nothing concealed, in turn; recordings without one have only noise and calibration.
FAULTS = ("", "drift", "hum", "", "quantum", "lost", "", "spikes", "coarse", "")
# Names under which the catalogue later got these effects; the others have none.
NAMES = {"warming": "warming", "gain": "gain", "dimension": "dimension", "drift": "drift"}
# First cycle (from 1) of the second half of a rich program.
STEP_CYCLE = 4
ATTEMPTS = 6
# Least standard errors of outside physics; of a gain, which is only several standard deviations of calibration.
SEEN, GAIN_SEEN = 12.0, 2.5


def draw_recording(card: Card) -> Entry:
    """Draw a recording."""
    reasons = []
    for attempt in range(ATTEMPTS):
        try:
            return _attempt(card, (*card.seed, attempt))
        except (Unsuitable, NotConverged) as failure:
            reasons.append(f"{type(failure).__name__}: {failure}")
    raise Unsuitable("; ".join(reasons))


def _attempt(card: Card, seed: tuple[int, ...]) -> Entry:
    rng = np.random.default_rng(seed)
    body = specimen(rng, card.channels, LAWS)
    programs, _ = channel_programs(rng, card.program, card.channels)
    felt = sensors(rng, seed, card.channels)
    entry = Entry("", "nothing", card.kind, card.program, seed, body, programs, felt)
    if card.kind == "none":
        return _nothing(rng, entry, card.seed[-1])
    name = card.names[0]
    formula, where = DRAWN[name](rng, entry)
    truth = (NAMES.get(name, ""),) if name in NAMES else ()
    entry = replace(entry, formulas=({"name": name, **formula},), truth=truth, outside=True, where=where)
    if name == "dimension":
        entry = replace(entry, said=dict(formula), formulas=({"name": name},))
    shown, share = _change_beside_law(entry)
    if shown < (GAIN_SEEN if name in ("gain", "dimension") else SEEN):
        raise Unsuitable(f"{name} shows by {shown:.1f} standard errors")
    return replace(entry, strength={name: round(shown, 2)}, share=round(share, 3))


def _nothing(rng: np.random.Generator, entry: Entry, number: int) -> Entry:
    fault = FAULTS[number % len(FAULTS)]
    at = int(rng.integers(len(entry.sensors)))
    felt, programs = list(entry.sensors), list(entry.programs)
    if fault == "coarse":
        # A slow logger and a noisy load cell.
        programs = [replace(p, samples=max(60, p.samples // 4)) for p in programs]
        felt = [replace(s, noise=round(float(rng.uniform(0.8, 1.5)), 4)) for s in felt]
    elif fault:
        felt[at] = with_fault(rng, felt[at], fault)
    return replace(entry, programs=tuple(programs), sensors=tuple(felt))


def _change_beside_law(entry: Entry) -> tuple[float, float]:
    """Standard errors, and percent of the range (rms), beside the law to first order and the calibration factors."""
    said = specimen_of_case_file(entry)
    rows, slopes, scale = [], [], []
    for c, sensor, exact in zip(channels_of(entry), entry.sensors, forces(entry)[0], strict=True):
        plain, slope = force(said, c, finer=False, names=tuple(said.parameters))
        if entry.said:
            change = exact - plain
        else:
            change = exact - elastic_force(entry.specimen, c)
        span = float(np.ptp(exact))
        sigma = sensor.noise / 100 * span
        spread = CALIBRATION[modes()[c.name].section is None]
        rows.append(beside_a_factor(change / sigma, plain / sigma, spread))
        slopes.append(beside_a_factor(slope / sigma, plain / sigma, spread))
        scale.append(np.full(len(exact), sigma / span))
    rest = rest_beside(np.concatenate(rows), [np.vstack(slopes)])
    share = 100 * float(np.sqrt(np.mean((rest * np.concatenate(scale)) ** 2)))
    return float(np.linalg.norm(rest)), share


def specimen_of_case_file(entry: Entry) -> Specimen:
    """Return the bushing as its case file describes it."""
    return replace(entry.specimen, dimensions=dict(entry.specimen.dimensions) | dict(entry.said))


def elastic_force(body: Specimen, c: Channel) -> Array:
    """Elastic force at a channel's samples."""
    curve = elastic(body, c.name, float(c.displacement.min()), float(c.displacement.max()))
    return np.asarray(curve(c.displacement))


def forces(entry: Entry) -> tuple[list[Array], list[Array]]:
    """Noise-free forces of the channels with the outside physics, and without it."""
    channels = channels_of(entry)
    plain = [elastic_force(entry.specimen, c) for c in channels]
    exact = plain
    for formula in entry.formulas:
        if formula["name"] in MADE:
            exact = [
                f if formula.get("channel", c.name) != c.name else MADE[formula["name"]](formula, c, f)
                for c, f in zip(channels, exact, strict=True)
            ]
    if entry.said:
        plain = [elastic_force(specimen_of_case_file(entry), c) for c in channels]
    return exact, plain


# -- physics outside the catalogue -------------------------------------------------------------------------------


def _uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return round(float(rng.uniform(low, high)), 5)


def _fast(entry: Entry) -> float:
    return entry.programs[0].slow / max(pace for _, pace in entry.programs[0].legs)


def _warming(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """The force falls as the rubber warms: with the work done, or with time next to a warm rig."""
    by = str(rng.choice(["work", "time"]))
    where = {"falls_with": "time"}
    return {"by": by, "loss": _uniform(rng, 0.03, 0.12), "reach": _uniform(rng, 0.2, 0.8)}, where


def warming(formula: Formula, c: Channel, force: Array) -> Array:
    """Multiply by 1 - loss (1 - exp(-x / reach)), x being the share of the work or of the time."""
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(c.displacement) * 0.5 * (force[1:] + force[:-1])))])
    x = way / way[-1] if formula["by"] == "work" else c.time / c.time[-1]
    return force * (1 - formula["loss"] * (1 - np.exp(-x / formula["reach"])))


def _gain(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """The amplifier of one channel is off by 3 to 6 %."""
    at = entry.channels[-1]
    factor = 1 + _uniform(rng, 0.03, 0.06) * float(rng.choice([-1.0, 1.0]))
    return {"channel": at, "factor": round(factor, 5)}, {"channel": at}


def gain(formula: Formula, c: Channel, force: Array) -> Array:
    """Multiply a channel by its factor."""
    return formula["factor"] * force


def _dimension(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """The case states another outer radius, or another length, than the bushing has."""
    shape = entry.specimen.dimensions
    sign = float(rng.choice([-1.0, 1.0]))
    if rng.random() < 0.6:
        return {"outer_radius": round(shape["outer_radius"] + sign * _uniform(rng, 0.3, 0.6), 3)}, {}
    key = "length" if "length" in shape else "inner_length"
    return {key: round(shape[key] * (1 + sign * _uniform(rng, 0.05, 0.12)), 3)}, {}


def _step(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """The stiffness falls or rises once."""
    factor = 1 - _uniform(rng, 0.03, 0.15) if rng.random() < 0.7 else 1 + _uniform(rng, 0.03, 0.1)
    return {"cycle": STEP_CYCLE, "factor": round(factor, 5)}, {"cycle": STEP_CYCLE, "softer": factor < 1}


def step(formula: Formula, c: Channel, force: Array) -> Array:
    """Multiply by the factor from this cycle on."""
    begin = next(b.start for b in excursions(c.displacement, c.time) if b.cycle >= formula["cycle"])
    return force * np.where(np.arange(len(force)) >= begin, formula["factor"], 1.0)


def _drift(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """The amplifier's zero creeps."""
    return {"percent": _uniform(rng, 1.5, 4.0) * float(rng.choice([-1.0, 1.0]))}, {"grows_with": "time"}


def drift(formula: Formula, c: Channel, force: Array) -> Array:
    """Add a force that grows with the square root of time."""
    return force + formula["percent"] / 100 * float(np.ptp(force)) * np.sqrt(c.time / c.time[-1])


def _tear(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """A crack opens at the first large excursion; from then on the bushing is softer in tension than in compression."""
    return {"loss": _uniform(rng, 0.08, 0.2), "at": _uniform(rng, 0.7, 0.9)}, {"sign": "+"}


def tear(formula: Formula, c: Channel, force: Array) -> Array:
    """Multiply positive forces once a share of the largest displacement has been reached."""
    q = c.displacement
    torn = np.maximum.accumulate(q) >= formula["at"] * q.max()
    return force * np.where(torn & (q > 0), 1 - formula["loss"], 1.0)


def _detent(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """A burr in the fixture: a bump of force over a band of displacement."""
    where = {"displacement": _uniform(rng, 0.25, 0.6)}
    return {
        "at": where["displacement"],
        "width": _uniform(rng, 0.04, 0.08),
        "percent": _uniform(rng, 1.5, 5.0),
    }, where


def detent(formula: Formula, c: Channel, force: Array) -> Array:
    """Add a bell-shaped force at a displacement."""
    x = c.displacement / float(np.abs(c.displacement).max())
    return force + formula["percent"] / 100 * float(np.ptp(force)) * np.exp(
        -0.5 * ((x - formula["at"]) / formula["width"]) ** 2
    )


def _transducer(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """The displacement transducer is not linear: a wave over its range, in one channel."""
    at = entry.channels[-1]
    return {"channel": at, "percent": _uniform(rng, 0.6, 1.5), "waves": _uniform(rng, 1.5, 2.5)}, {
        "channel": at
    }


def transducer(formula: Formula, c: Channel, force: Array) -> Array:
    """Return the force at the true displacement, which the transducer does not show."""
    reach = float(np.abs(c.displacement).max())
    q = c.displacement + formula["percent"] / 100 * reach * np.sin(
        math.pi * formula["waves"] * c.displacement / reach
    )
    order = np.argsort(c.displacement)
    x, first = np.unique(c.displacement[order], return_index=True)
    return np.interp(q, x, force[order][first])


def _quadratic_damping(rng: np.random.Generator, entry: Entry) -> tuple[Formula, Formula]:
    """A fluid in the fixture: a force with the square of the rate, which matters only on the fast legs."""
    return {"percent": _uniform(rng, 2.0, 6.0), "fast": _fast(entry)}, {"rate": "fast"}


def quadratic_damping(formula: Formula, c: Channel, force: Array) -> Array:
    """Add a force proportional to rate |rate|, relative to the fastest leg."""
    rate = np.gradient(c.displacement, c.time) * formula["fast"] / float(np.abs(c.displacement).max())
    return force + formula["percent"] / 100 * float(np.ptp(force)) * rate * np.abs(rate)


DRAWN: Mapping[str, Callable[[np.random.Generator, Entry], tuple[Formula, Formula]]] = {
    "warming": _warming,
    "gain": _gain,
    "dimension": _dimension,
    "step": _step,
    "drift": _drift,
    "tear": _tear,
    "detent": _detent,
    "transducer": _transducer,
    "quadratic_damping": _quadratic_damping,
}
MADE: Mapping[str, Callable[[Formula, Channel, Array], Array]] = {
    "warming": warming,
    "gain": gain,
    "step": step,
    "drift": drift,
    "tear": tear,
    "detent": detent,
    "transducer": transducer,
    "quadratic_damping": quadratic_damping,
}
__all__ = ["channel", "draw_recording", "forces"]
