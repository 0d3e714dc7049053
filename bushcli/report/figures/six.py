"""A path of six motions: motions of the inner sleeve and its reactions over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bushcli.report.figures.picture import BLACK, BLUE, GREY, RED, legend, literal, new_figure, style
from bushcli.report.quantity import largest_reactions, shown_motion
from bushcli.simulate.six import SixCurve
from cases.six import MOTIONS, REACTIONS

Array = NDArray[np.float64]

# Curves below this share of the largest one of the same kind are not drawn.
_NOTHING = 1e-3


def six_figure(name: str, six: SixCurve) -> Figure:
    """Draw motions and reactions, translations and forces on the left, rotations and moments on the right.

    Parameters
    ----------
    name : str
        Name of the channel, for the title.
    six : SixCurve
        Simulated motions and reactions.
    """
    motion, largest = shown_motion(six), largest_reactions(six.force)
    with style():
        figure = new_figure(9.0, 5.6)
        panels = figure.subplots(2, 2, sharex=True)
        for column, (kind, unit, force, force_unit) in enumerate(
            (("displacement", "mm", "force", "N"), ("rotation", "deg", "moment", "N mm"))
        ):
            part = range(3 * column, 3 * column + 3)
            moved = [k for k in part if k in six.free or motion[:, k].any()]
            _lines(panels[0, column], six.time, motion, moved, [_motion_label(six, k) for k in moved])
            panels[0, column].set(ylabel=f"{kind} [{unit}]")
            pushed = [k for k in part if np.abs(six.force[:, k]).max() > _NOTHING * largest[column]]
            _lines(panels[1, column], six.time, six.force, pushed, [REACTIONS[k] for k in pushed])
            panels[1, column].set(xlabel="time [s]", ylabel=f"{force} [{force_unit}]")
        figure.suptitle(literal(six_title(name)))
        figure.align_ylabels()
    return figure


def six_title(name: str) -> str:
    """Return the title of the picture of a channel."""
    return f"{name[:1].upper() + name[1:]}: motions of the inner sleeve, and the reactions"


def _motion_label(six: SixCurve, k: int) -> str:
    return MOTIONS[k] + (" (free)" if k in six.free else "")


def _lines(axes: Axes, time: Array, values: Array, chosen: Sequence[int], labels: Sequence[str]) -> None:
    axes.axhline(0, color=GREY, lw=0.8, zorder=1)
    for k, label in zip(chosen, labels, strict=True):
        color = (BLUE, RED, BLACK)[k % 3]
        axes.plot(time, values[:, k], color=color, marker="o", ms=2.5, lw=1.2, label=label)
    if chosen:
        legend(axes, loc="best")
