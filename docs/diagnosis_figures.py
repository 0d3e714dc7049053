"""The picture that the README opens with, from what a diagnosis wrote.

``make demo && setup/enter python docs/diagnosis_figures.py out/diagnosis``
"""

from __future__ import annotations

import csv
import io
import json
import sys
import textwrap
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from bushcli.effects.titles import within
from bushcli.report.drawing import looks
from bushcli.report.views.diagnosis.words import law_title

PICTURE = Path(__file__).with_name("pictures") / "diagnosis.png"
# As in the report.
BLACK, BLUE, ORANGE, GREY = (colours[0] for colours in (looks.INK, looks.BLUE, looks.AMBER, looks.GREY))
SENSES = {"too_soft": (looks.SOFT[0], -1.0), "too_stiff": (looks.STIFF[0], 1.0)}
Columns = dict[str, np.ndarray]


def read(folder: Path) -> tuple[dict[str, Any], str, Columns]:
    """Return the result, the name of its first channel, and that channel's curves by column."""
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    channel = next(iter(result["misfit"]["before"]))
    with (folder / f"{channel}-diagnosis.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return result, channel, {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def main(folder: Path) -> None:
    """Draw recording, plain law and most probable model; below, the misfit of both along the recording."""
    result, channel, data = read(folder)
    plt.rcParams.update({"font.size": 9.5, "axes.spines.top": False, "axes.spines.right": False})
    figure = plt.figure(figsize=(9.2, 6.4), layout="constrained")
    left, right, below = figure.subplot_mosaic(
        [["before", "after"], ["misfit", "misfit"]], height_ratios=(2.4, 1)
    ).values()
    before, after, noise = (result["misfit"][key][channel] for key in ("before", "after", "noise"))
    named = " + ".join(within(effect["title"]) for effect in result["effects"])
    alone = f"the {law_title(result['plain']['law'])} law alone"
    _curve(left, data, "plain_force_N", ORANGE, f"Before: {alone}, {before:.1f} % off")
    _curve(
        right, data, "final_force_N", BLUE, f"After: with {named}, {after:.2f} % off (noise {noise:.2f} %)"
    )
    left.set_ylabel("force, kN")
    right.tick_params(labelleft=False)
    _where(left, data, result)
    right.text(
        0.97, 0.05, _parameters(result), transform=right.transAxes, ha="right", va="bottom", color=BLUE
    )
    _misfit(below, data, noise, (alone, f"with {named}"))
    figure.suptitle(result["headline"] + "\n", x=0.01, ha="left", fontsize=14, fontweight="bold")
    summary = " ".join(effect["summary"] for effect in result["effects"])
    # In the line that the title leaves empty.
    figure.text(0.011, 0.955, summary, va="top", fontsize=10.5).set_in_layout(False)
    _save(figure)


def _save(figure: Figure) -> None:
    """As PNG of few colours, a third of the size."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=150, metadata={"Software": None})
    Image.open(buffer).convert("RGB").quantize(96, dither=Image.Dither.NONE).save(PICTURE, optimize=True)


def _curve(axes: Axes, data: Columns, column: str, colour: str, title: str) -> None:
    q = data["displacement_mm"]
    axes.plot(q, data["recorded_force_N"] / 1e3, ".", color=BLACK, ms=3.5, label="recorded", zorder=3)
    axes.plot(q, data[column] / 1e3, color=colour, lw=1.8, label="simulated", zorder=2)
    for line in (axes.axhline, axes.axvline):
        line(0.0, color="0.85", lw=0.8, zorder=0)
    axes.set_xlabel("displacement, mm")
    axes.set_title(title, fontsize=11, color=colour if colour == BLUE else "#a86f00", loc="left")
    axes.legend(frameon=False, loc="upper left")


def _where(axes: Axes, data: Columns, result: dict[str, Any]) -> None:
    """Shade what lies between recording and plain law, and say the largest mismatch of each sense."""
    q, recorded, plain = (data[key] for key in ("displacement_mm", "recorded_force_N", "plain_force_N"))
    too_large = (plain - recorded) * np.sign(q)
    for colour, sense in SENSES.values():
        for i in np.flatnonzero(sense * too_large > 0):
            part = slice(i, i + 2)
            axes.fill_between(
                q[part], recorded[part] / 1e3, plain[part] / 1e3, color=colour, alpha=0.25, lw=0, zorder=1
            )
    for sign, place in (("too_soft", (0.24, 0.70)), ("too_stiff", (0.52, 0.12))):
        found = next((one for one in result["mismatch"] if one["sign"] == sign), None)
        if found is None or found["relative"] is None:
            continue
        colour, sense = SENSES[sign]
        worst = int(np.argmax(sense * too_large))
        said = f"{abs(100 * found['relative']):.0f} % {sign.replace('_', ' ')}: {_branch(found)}"
        axes.annotate(
            "\n".join(textwrap.wrap(said, 22)),
            (float(q[worst]), float((recorded[worst] + plain[worst]) / 2e3)),
            xytext=place,
            textcoords="axes fraction",
            color=colour,
            fontweight="bold",
            ha="left",
            va="bottom",
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 1.2},
            zorder=5,
        )


def _branch(found: dict[str, Any]) -> str:
    first, last = found["cycle"]
    return (
        f"{found['branch']}, cycles {first} to {last}"
        if first != last
        else f"{found['branch']}, cycle {first}"
    )


def _parameters(result: dict[str, Any]) -> str:
    """The effects' parameters with their 95 % intervals."""
    lines = []
    for effect in result["effects"]:
        lines.append(f"{effect['title']}, with 95 % intervals:")
        for name, one in effect["parameters"].items():
            if isinstance(one["value"], str):
                lines.append(f"{name}: {one['value'].replace('_', ' ')}")
                continue
            unit = "" if one["unit"] == "1" else f" {one['unit']}"
            half = (one["upper"] - one["lower"]) / 2
            digits = max(0, 1 - int(np.floor(np.log10(half))))
            lines.append(f"{name} = {one['value']:.{digits}f} ± {half:.{digits}f}{unit}")
    return "\n".join(lines)


def _misfit(axes: Axes, data: Columns, noise: float, labels: tuple[str, str]) -> None:
    """Simulated minus recorded force before and after, sample by sample, on the band of the noise."""
    recorded = data["recorded_force_N"]
    per = 100.0 / np.ptp(recorded)
    x = np.arange(len(recorded))
    axes.axhspan(-2 * noise, 2 * noise, color="#dfe3e8", lw=0, label="noise")
    plain = per * (data["plain_force_N"] - recorded)
    away = np.sign(data["displacement_mm"]) * plain
    for colour, sense in SENSES.values():
        axes.fill_between(x, plain, where=sense * away > 2 * noise, color=colour, alpha=0.25, lw=0)
    for column, colour, label in zip(("plain_force_N", "final_force_N"), (ORANGE, BLUE), labels, strict=True):
        axes.plot(x, per * (data[column] - recorded), color=colour, lw=1.6, label=label)
    axes.set_xlabel("sample of the recording, in the order of time")
    axes.set_ylabel("misfit, % of range")
    axes.margins(x=0.01)
    axes.legend(frameon=False, loc="lower right", ncols=3)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
