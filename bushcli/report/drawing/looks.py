"""Colours and widths of everything that is drawn, by its role, in light and dark; both drawings take them from here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.colors import LinearSegmentedColormap

# Okabe and Ito's palette, distinguishable with any colour vision (https://jfly.uni-koeln.de/color/), for light paper
# and for dark screens. Orange is kept for "too stiff" and purple for "too soft", as in ColorBrewer's scale PuOr.
INK = ("#1a1a1a", "#e4e7eb")
BLUE = ("#0072B2", "#56b4e9")
AMBER = ("#E69F00", "#e6a817")
STIFF = ("#C4590A", "#e8772e")
SOFT = ("#6A4C9C", "#a78bda")
GREEN = ("#009E73", "#1fae85")
RED = ("#B3001B", "#ff6b6b")
GREY = ("#5f6670", "#9aa3ad")
PALE = ("#e3e6ea", "#2f363f")
FAULT = ("#f6d9de", "#4a2028")
METAL = "#b9c0c8"


@dataclass(frozen=True)
class Look:
    """How a role looks."""

    colours: tuple[str, str]  # on light and on dark ground
    width: float = 1.6  # of a line, points; a dot is 2.5 times as wide
    dash: Sequence[float] = ()  # lengths of strokes and gaps, points
    opacity: float = 1.0  # of an area, as a share


LOOKS = {
    # Wide and pale below, so that a dense recording hides no model and is seen beside one that agrees with it.
    "recorded": Look(("#949ca5", "#7d8691"), 2.8),
    # One of many parts: thin, so that the band of all is seen between them.
    "part": Look(GREY, 0.6),
    "before": Look(AMBER, 1.5),
    "after": Look(BLUE, 1.5),
    "tolerance": Look(PALE),
    "noise": Look(PALE),
    "zero": Look(GREY, 0.8),
    "limit": Look(RED, 1.2, (5, 3)),
    "level": Look(INK, 0.9, (1, 2)),
    "shaded": Look(PALE),
    "unstable": Look(RED, opacity=0.14),
    "faulty": Look(FAULT),
    "left_out": Look(RED, 1.4),
    "stopped": Look(RED, 2.4),
    "stiff": Look(STIFF, opacity=0.3),
    "soft": Look(SOFT, opacity=0.3),
    "all": Look(INK, 1.6, opacity=0.15),
    "loading": Look(BLUE, 1.6, opacity=0.18),
    "unloading": Look(AMBER, 1.6, opacity=0.22),
    "hold": Look(GREEN, 1.6, opacity=0.18),
    "bar": Look(BLUE),
    "bar_pale": Look(("#9fc5de", "#2d5a78")),
    "bar_second": Look(AMBER),
    "bar_grey": Look(GREY),
    "bar_bad": Look(RED),
    "bar_good": Look(GREEN),
    "bar_ground": Look(("#f1f2f4", "#22272e")),
    "range": Look(BLUE, opacity=0.35),
    "dot": Look(BLUE, 1.2),
    "significant": Look(INK, 1.0),
    "faint": Look(GREY, 0.8, (1, 2)),
    **{
        f"line-{i}": Look(colours)
        for i, colours in enumerate(
            (BLUE, STIFF, INK, GREEN, SOFT, AMBER, RED, ("#56B4E9", "#9fd4f5"), GREY, ("#CC79A7", "#e3a0c6"))
        )
    },
}

#: Colours of a signed misfit or change: purple where the model is too soft, orange where it is too stiff.
DIVERGING = LinearSegmentedColormap.from_list("soft-stiff", ["#9079b5", "#ffffff", "#d38347"])


def style_sheet() -> str:
    """Return CSS with the colour (`--look`), width and opacity of each role, class "as-ROLE", in light and dark."""
    rules = []
    for key, look in LOOKS.items():
        dash = f"stroke-dasharray:{','.join(f'{v:g}' for v in look.dash)};" if look.dash else ""
        rules.append(
            f".as-{key}{{--look:{look.colours[0]};--wide:{look.width:g};--opacity:{look.opacity:g};{dash}}}"
        )
    rules.append(f":root{{--too-soft:{SOFT[0]};--too-stiff:{STIFF[0]}}}")
    dark = f":root{{--too-soft:{SOFT[1]};--too-stiff:{STIFF[1]}}}" + "".join(
        f".as-{key}{{--look:{look.colours[1]}}}" for key, look in LOOKS.items()
    )
    return "\n".join([*rules, f"@media screen and (prefers-color-scheme: dark){{{dark}}}"])
