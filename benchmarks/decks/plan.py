"""Contents of each deck: how many of which kind, in a random order. Used once, when a deck is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.concealed import draw
from benchmarks.decks.manifest import Kind, Part
from bushcli.effects.effect import effects

SEEDS = {
    "dev": 70_001,
    "own": 71_001,
    "foreign": 72_001,
    "nothing": 73_001,
    "poor": 74_001,
    "second": 75_001,
    "third": 76_001,
    "fourth": 77_001,
    "fifth": 78_001,
}
# Decks that test a calculation finished before they were drawn, with each foreign formula once.
FRESH = ("second", "third", "fourth", "fifth")
# Sets of effects that fillers cause together, from the third deck on.
TOGETHER = (
    ("viscoelasticity", "mullins"),
    ("friction", "mullins"),
    ("viscoelasticity", "permanent_set"),
    ("viscoelasticity", "mullins", "permanent_set"),
    ("friction", "mullins", "permanent_set"),
    ("viscoelasticity", "mullins", "permanent_set"),
)
# Effects of the catalogue on the day on which the decks were drawn.
EFFECTS = (
    *(
        "batch_stiffness",
        "bump_stop",
        "compressibility",
        "cure_shrinkage",
        "debonding",
        "free_play",
        "friction",
    ),
    *("misalignment", "mullins", "offset", "permanent_set", "rig_compliance", "sleeve_compliance", "swaging"),
    *("time_lag", "viscoelasticity"),
)
# Share of poor programs among the own deck's single effects that need only one channel; a quarter of all.
POOR = 0.3

# Formulas of the foreign deck and their numbers. Each is an entry of `foreign.formulas`; the manifest holds the truth.
FOREIGN: dict[str, int] = {
    "bergstroem_boyce": 4,
    "simo": 3,
    "holzapfel": 3,
    "power_law": 3,
    "dorfmann_ogden": 3,
    "damage": 3,
    "morph": 3,
    "berg": 3,
    "bouc_wen": 3,
    "endochronic": 3,
    "iwan": 1,
    "set_saturating": 2,
    "set_power": 2,
    "debonded_outer": 3,
    "debonded_bottom": 2,
    "swaged_unevenly": 2,
    "shrunk_unevenly": 1,
    "other_volume": 1,
    "compliance_hardening": 2,
    "compliance_softening": 2,
    "stop_quadratic": 2,
    "stop_ramp": 2,
    "play_edges": 2,
    "low_pass": 1,
    "tilted": 1,
    "power_law_bouc_wen": 2,
    "damage_simo": 1,
}
FOREIGN_DEV = (
    *("bergstroem_boyce", "simo", "holzapfel", "power_law", "dorfmann_ogden", "damage", "morph", "berg"),
    *("bouc_wen", "endochronic", "iwan", "set_saturating", "set_power", "debonded_outer", "swaged_unevenly"),
    *("debonded_bottom", "compliance_hardening", "stop_quadratic", "stop_ramp", "play_edges", "low_pass"),
    *("power_law_bouc_wen", "other_volume", "compliance_softening"),
)
OUTSIDE: dict[str, int] = {
    "warming": 4,
    "gain": 4,
    "dimension": 4,
    "step": 3,
    "drift": 1,
    "tear": 1,
    "detent": 1,
    "transducer": 1,
    "quadratic_damping": 1,
}
OUTSIDE_DEV = ("warming", "warming", "gain", "dimension", "step", "tear")
# Of the second development deck, all on poor programs.
FOREIGN_POOR = (
    *("bergstroem_boyce", "simo", "power_law", "dorfmann_ogden", "damage", "berg", "bouc_wen", "endochronic"),
    *("set_saturating", "compliance_hardening", "stop_quadratic", "play_edges"),
)
OUTSIDE_POOR = ("detent", "transducer", "quadratic_damping", "drift", "warming", "tear")


@dataclass(frozen=True)
class Card:
    """A recording to be drawn.

    Attributes
    ----------
    part, kind
    names : tuple of str
        Effects (own deck), or formulas (foreign, outside).
    program : str
    channels : tuple of str
        Empty where the formula decides.
    coupons : bool
    seed : tuple of int
    """

    part: Part
    kind: Kind
    names: tuple[str, ...]
    program: str
    channels: tuple[str, ...]
    coupons: bool
    seed: tuple[int, ...]


def cards(deck: str) -> dict[str, Card]:
    """Recordings of a deck by name."""
    seed = SEEDS[deck]
    deck_cards: list[Card] = []
    if deck in ("own", "dev", *FRESH):
        deck_cards += _own(seed, *((5, 10, 10) if deck == "own" else (1, 4, 4)))
    if deck == "foreign":
        deck_cards += _foreign(seed, [name for name, times in FOREIGN.items() for _ in range(times)])
    if deck == "dev":
        deck_cards += _foreign(seed, list(FOREIGN_DEV))
    if deck in FRESH:
        deck_cards += _foreign(seed, list(FOREIGN))
    if deck == "nothing":
        deck_cards += _nothing(seed, 20, [name for name, times in OUTSIDE.items() for _ in range(times)])
    if deck in ("dev", *FRESH):
        deck_cards += _nothing(seed, 6, list(OUTSIDE_DEV))
    if deck == "poor":
        deck_cards += _poor(seed)
    if deck in FRESH[1:]:
        channels = (("axial",), ("axial", "torsional"))
        deck_cards += [
            Card("own", "pair", names, "rich", channels[i % 2], False, (seed, 5, i))
            for i, names in enumerate(TOGETHER)
        ]
    order = np.random.default_rng([seed, 99]).permutation(len(deck_cards))
    return {f"{i:03d}": deck_cards[k] for i, k in enumerate(order)}


def _own(seed: int, times: int, pairs: int, nothings: int) -> list[Card]:
    rng = np.random.default_rng([seed, 1])
    deck_cards: list[Card] = []

    def add(
        kind: Kind, names: tuple[str, ...], program: str, channels: tuple[str, ...], coupons: bool
    ) -> None:
        deck_cards.append(Card("own", kind, names, program, channels, coupons, (seed, 1, len(deck_cards))))

    for name in EFFECTS:
        for _ in range(times):
            channels = draw._channels(rng, (name,))
            poor = name != "batch_stiffness" and rng.random() < POOR
            if poor:
                channel = "axial" if effects()[name].acts_on("axial") else "radial"
                add("single", (name,), str(rng.choice(["ramp", "loop"])), (channel,), False)
            else:
                add("single", (name,), "rich", channels, name == "batch_stiffness")
    drawn: set[tuple[str, ...]] = set()
    while len(drawn) < pairs:
        plan = draw._pair(rng)
        if plan.names not in drawn:
            drawn.add(plan.names)
            add("pair", plan.names, "rich", plan.channels, False)
    for i in range(nothings):
        poor = i % 4 == 3
        channels = ("axial",) if poor else draw.ANY[rng.integers(len(draw.ANY))]
        program = str(rng.choice(["ramp", "loop"])) if poor else "rich"
        add("none", (), program, channels, not poor and bool(rng.random() < 0.2))
    return deck_cards


def _poor(seed: int) -> list[Card]:
    """Recordings of one axial ramp or loop: own effects on each, foreign formulas, nothing, outside physics."""
    deck_cards: list[Card] = []

    def add(part: Part, kind: Kind, names: tuple[str, ...], program: str) -> None:
        channels = () if part == "foreign" else ("axial",)
        deck_cards.append(Card(part, kind, names, program, channels, False, (seed, 4, len(deck_cards))))

    for name in EFFECTS:
        if effects()[name].acts_on("axial") and name != "batch_stiffness":
            for program in ("ramp", "loop"):
                add("own", "single", (name,), program)
    for name in FOREIGN_POOR:
        add("foreign", "single", (name,), "loop")
    for program in ("ramp", "loop", "ramp", "loop"):
        add("own", "none", (), program)
        add("nothing", "none", (), program)
    for name in OUTSIDE_POOR:
        add("nothing", "outside", (name,), "loop")
    return deck_cards


def _foreign(seed: int, names: list[str]) -> list[Card]:
    """Cards with the formula's channels; a fifth of the programs is poor."""
    rng = np.random.default_rng([seed, 2])
    deck_cards = []
    for i, name in enumerate(names):
        program = str(rng.choice(["rich", "loop"], p=[0.8, 0.2]))
        deck_cards.append(Card("foreign", "single", (name,), program, (), False, (seed, 2, i)))
    return deck_cards


def _nothing(seed: int, nothings: int, outside: list[str]) -> list[Card]:
    rng = np.random.default_rng([seed, 3])
    deck_cards: list[Card] = []
    for i in range(nothings):
        channels = draw.ANY[rng.integers(len(draw.ANY))]
        program = "loop" if i % 5 == 4 else "rich"
        channels = ("axial",) if program == "loop" else channels
        deck_cards.append(Card("nothing", "none", (), program, channels, False, (seed, 3, i)))
    for i, name in enumerate(outside):
        channels = ("axial",)
        if name in ("gain", "dimension", "transducer"):
            channels = ("axial", "torsional") if i % 2 else ("axial", "radial")
        deck_cards.append(
            Card("nothing", "outside", (name,), "rich", channels, False, (seed, 3, nothings + i))
        )
    return deck_cards
