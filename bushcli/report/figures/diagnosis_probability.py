"""Pictures of the certainty of a diagnosis: probabilities as bars, and each value with its posterior and its prior."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from bushcli.diagnosis.result import Diagnosis
from bushcli.effects.names import effect_name
from bushcli.effects.titles import NOTHING, UNKNOWN, phrase, title
from bushcli.report.figures.picture import (
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    RED,
    literal,
    log_ticks,
    new_figure,
    style,
)
from bushcli.report.views.diagnosis.values import ShownQuantity, derived_text, shown
from bushcli.report.views.diagnosis.words import short_chance, undetectable, unlikely

# Effects that are less probable than this are named in a line under the bars.
_SMALL = 0.01
# Characters in a line of those names.
_LINE = 125
# A prior that spans more than this factor is drawn on a logarithmic axis.
_DECADES = 20.0
# An axis that spans less than this factor has numbers between the powers of ten.
_FEW_DECADES = 300.0
_PALE = "#9fc5de"


@dataclass(frozen=True)
class Strip:
    """A parameter of an effect with its prior.

    Attributes
    ----------
    effect, parameter : str
        In words; the effect is named with its first parameter only.
    also : str
        The value under its reciprocal name.
    shown : ShownQuantity
    """

    effect: str
    parameter: str
    also: str
    shown: ShownQuantity


def probability_figure(found: Diagnosis) -> Figure:
    """Draw a bar per effect, the most probable on top; those of the most probable model in full colour."""
    ranked = sorted(found.probability.items(), key=lambda one: -one[1])
    drawn = [(name, p) for name, p in ranked if p >= _SMALL] or ranked[:1]
    chosen = {effect_name(one.name) for one in found.effects}
    note = "\n".join(_notes(found, {name for name, _ in drawn}))
    with style():
        lines = note.count("\n") + bool(note)
        figure = new_figure(8.6, 0.6 + 0.34 * len(drawn) + 0.19 * lines)
        axes = figure.add_subplot()
        axes.grid(False)
        at = np.arange(len(drawn))
        axes.barh(at, 100.0, color="#f1f2f4", height=0.62)
        for i, (name, p) in enumerate(drawn):
            colour = {UNKNOWN: RED, NOTHING: GREEN}.get(name, BLUE if name in chosen else _PALE)
            axes.barh(i, 100 * p, color=colour, height=0.62)
            axes.annotate(
                short_chance(p),
                (100.0, i),
                (6, 0),
                textcoords="offset points",
                va="center",
                annotation_clip=False,
            )
        axes.set_yticks(at, [literal(title(name)) for name, _ in drawn])
        axes.set_ylim(len(drawn) - 0.5, -0.5)
        axes.set_xlim(0, 100)
        axes.set_xticks([0, 25, 50, 75, 95], ["0", "25", "50", "75", "95 %"])
        axes.axvline(95, color=GREY, lw=0.8, ls=":", zorder=3)
        axes.tick_params(axis="y", length=0)
        for spine in axes.spines.values():
            spine.set_visible(False)
        if note:
            figure.supxlabel(literal(note), fontsize=8.5, color=GREY, x=0.01, ha="left")
        return figure


def _notes(found: Diagnosis, drawn: Collection[str]) -> list[str]:
    """Return lines with the effects that have no bar: excluded ones, and those that the recordings cannot show."""
    parts = {
        "less than 1 %": unlikely(found, _SMALL),
        "not detectable in these recordings": undetectable(found, _SMALL),
    }
    without = {words: [phrase(name) for name in names if name not in drawn] for words, names in parts.items()}
    return [fill(f"{words}: {', '.join(names)}", _LINE) for words, names in without.items() if names]


def strips(found: Diagnosis) -> list[Strip]:
    """Return the parameters of the most probable model that are numbers with a prior."""
    rows = []
    for effect in found.effects:
        label = effect.label
        for name, quantity in effect.parameters.items():
            value = shown(f"{effect.name}.{name}", quantity, found.channels)
            if value.prior is None or value.word or not math.isfinite(value.value):
                continue
            rows.append(Strip(label, name, derived_text(quantity), value))
            label = ""
    return rows


def prior_figure(found: Diagnosis) -> Figure:
    """Draw a line per parameter with the intervals of its prior and its posterior."""
    rows = strips(found)
    with style():
        figure = new_figure(8.6, 0.55 + 0.72 * len(rows))
        panels = figure.subplots(len(rows), 1, squeeze=False).ravel()
        for axes, row in zip(panels, rows, strict=True):
            _strip(axes, row)
        handles, labels = panels[0].get_legend_handles_labels()
        # The point is the last entry, because it is drawn on the bars.
        figure.legend(
            [*handles[1:], handles[0]],
            [*labels[1:], labels[0]],
            loc="outside upper center",
            ncols=3,
            frameon=False,
            fontsize=9,
        )
        return figure


def _strip(axes: Axes, row: Strip) -> None:
    one = row.shown
    assert one.prior is not None
    low, high = one.prior
    logarithmic = low > 0 and one.value > 0 and one.lower > 0 and high > _DECADES * low
    bands = [(low, high)]
    # A prior of the absolute value permits both signs.
    if low >= 0 and min(one.value, one.lower) < 0:
        bands.append((-high, -low))
    for i, (a, b) in enumerate(bands):
        axes.barh(
            0, b - a, left=a, height=0.8, color=LIGHT, label="95 % before the recordings" if i == 0 else None
        )
    lower, upper = (end if math.isfinite(end) else one.value for end in (one.lower, one.upper))
    axes.barh(0, upper - lower, left=lower, height=0.34, color=BLUE, label="95 % with the recordings")
    axes.plot(one.value, 0, "o", color="white", mec=BLUE, mew=1.6, ms=6, label="most probable", zorder=3)
    ends = [v for band in bands for v in band] + [lower, upper, one.value]
    if logarithmic:
        axes.set_xscale("log")
        axes.set_xlim(min(ends) / 1.6, max(ends) * 1.6)
        log_ticks(axes.xaxis, *axes.get_xlim())
        if max(ends) < _FEW_DECADES * min(ends):
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    else:
        margin = 0.06 * (max(ends) - min(ends)) or 1.0
        axes.set_xlim(min(ends) - margin, max(ends) + margin)
        axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.set_ylim(-0.6, 0.6)
    axes.grid(False)
    name = f"{row.effect}\n{row.parameter}" if row.effect else row.parameter
    axes.set_yticks([0], [literal(name)])
    axes.tick_params(axis="y", length=0)
    axes.tick_params(axis="x", labelsize=8.5)
    also = f"\n({row.also})" if row.also else ""
    axes.annotate(
        literal(f"{one.text}{also}"),
        (1.0, 0.5),
        (8, 0),
        xycoords="axes fraction",
        textcoords="offset points",
        va="center",
        fontsize=9.5,
        annotation_clip=False,
    )
    for side in ("left", "top", "right"):
        axes.spines[side].set_visible(False)
