"""Plots of the certainty of a diagnosis: probabilities as bars, and each value with its posterior and its prior."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bushcli.diagnosis.result import SMALL, Diagnosis
from bushcli.effects.names import effect_name
from bushcli.effects.titles import NOTHING, UNKNOWN, phrase, title
from bushcli.report.document import Note, Panels, Plot, Region, Series, Stripe
from bushcli.report.plots.direct import bar
from bushcli.report.views.diagnosis.values import ShownQuantity, reciprocals_text, shown_quantity
from bushcli.report.views.diagnosis.words import ranked_effects, short_chance, unlikely

# A prior that spans more than this factor is drawn on a logarithmic axis.
_DECADES = 20.0


def probability_panels(diagnosis: Diagnosis) -> Panels:
    """Return a bar per effect, the most probable on top; those of the most probable model in full colour."""
    ranked = ranked_effects(diagnosis)
    drawn = [(name, p) for name, p in ranked if p >= SMALL] or ranked[:1]
    chosen = {effect_name(effect.name) for effect in diagnosis.effects}
    regions, notes = [], []
    for i, (name, p) in enumerate(drawn):
        key = {UNKNOWN: "bar_bad", NOTHING: "bar_good"}.get(name, "bar" if name in chosen else "bar_pale")
        regions += [Region("bar_ground", "", [bar(i, 0.0, 100.0)]), Region(key, "", [bar(i, 0.0, 100 * p)])]
        notes.append(Note(short_chance(p), (100.0, i)))
    heading = "Probability of each effect"
    plot = Plot(
        "probabilities",
        ("", ""),
        x=(0.0, 112.0),
        y=(len(drawn) - 0.5, -0.5),
        regions=regions,
        bands=[Stripe("level", x=(95.0, 95.0))],
        notes=notes,
        height=50.0 + 36.0 * len(drawn),
        x_names=[(v, f"{v} %" if v == 95 else f"{v}") for v in (0, 25, 50, 75, 95)],
        y_names=[(i, title(name)) for i, (name, _) in enumerate(drawn)],
    )
    names = {name for name, _ in drawn}
    small = (
        ("Less than 1 %", unlikely(diagnosis)),
        ("Not detectable in these recordings", list(diagnosis.searched.untestable)),
    )
    rest = [(words, [phrase(name) for name in effects if name not in names]) for words, effects in small]
    note = " ".join(f"{words}: {', '.join(effects)}." for words, effects in rest if effects)
    return Panels("probabilities", "probabilities", heading, [[plot]], note=note)


def prior_panels(diagnosis: Diagnosis) -> Panels | None:
    """Return a line per parameter with the intervals of its prior and its posterior; None without such parameters."""
    rows: list[list[Plot]] = []
    for effect in diagnosis.effects:
        for name, quantity in effect.parameters.items():
            value = shown_quantity(f"{effect.name}.{name}", quantity, diagnosis.channels)
            if value.prior is None or value.word or not math.isfinite(value.value):
                continue
            also = reciprocals_text(quantity)
            heading = f"{effect.label}: {name} = {value.text}{f' ({also})' if also else ''}"
            rows.append([interval_plot(value, f"value-{len(rows)}", heading, labelled=not rows)])
    title = "Values with 95 % intervals: posterior and prior"
    return Panels("priors", "priors", title, rows) if rows else None


def interval_plot(value: ShownQuantity, name: str, heading: str, labelled: bool) -> Plot:
    """Return prior and posterior intervals of one value as bars, with a dot at its most probable value."""
    assert value.prior is not None
    low, high = value.prior
    logarithmic = low > 0 and value.value > 0 and value.lower > 0 and high > _DECADES * low
    # A prior of the absolute value permits both signs.
    bands = [(low, high), (-high, -low)] if low >= 0 and min(value.value, value.lower) < 0 else [(low, high)]
    lower, upper = (end if math.isfinite(end) else value.value for end in (value.lower, value.upper))
    labels = ("95 % before the recordings", "95 % with the recordings", "most probable")
    labels = labels if labelled else ("", "", "")
    regions = [
        Region("shaded", labels[0], [bar(0.0, *ends, 0.9) for ends in bands]),
        Region("bar", labels[1], [bar(0.0, lower, upper, 0.5)]),
    ]
    dot = Series("significant", labels[2], np.array([value.value]), np.zeros(1), "dots")
    plot = Plot(name, ("", ""), [dot], regions, y=(-0.6, 0.6), heading=heading, height=66.0)
    return replace(plot, log="x" if logarithmic else "", y_names=[(9.0, "")])
