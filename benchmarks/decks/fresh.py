"""Scores of the new decks together, each diagnosed by code that had been developed without it.

One deck of seventy recordings cannot tell a calibration error of 0.05 from that of a perfect posterior, which chance
alone takes to 0.04 (and to 0.06 in one deck of twenty).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from benchmarks.concealed.report import count_text, table
from benchmarks.concealed.score import Count
from benchmarks.decks import score
from benchmarks.decks.answer import UNKNOWN, Names
from benchmarks.decks.odds import frequencies, independent_odds, reweigh, tool_odds
from benchmarks.decks.score import Item

Statements = Callable[[Item], Iterable[tuple[float, bool]]]

# Decks, the label of their first run, and the prior odds of that revision.
RUNS: Sequence[tuple[str, str, Callable[[Names], float]]] = (
    ("second", "82dfdac", independent_odds),
    ("third", "a48e417", tool_odds),
    ("fourth", "23cba668", tool_odds),
    ("fifth", "531e5d4a", tool_odds),
)
# Ranges of the probability of the most probable set.
RANGES = (0.0, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99, 1.0)
# Draws of the truths from the answers, and the quantiles that are stated.
DRAWS, QUANTILES = 400, (0.5, 0.05, 0.95)
# Parts of the decks whose effects are in the catalogue.
PARTS = {"own": "own formulas", "foreign": "foreign formulas"}
TEXT = """## The new decks together

*Second* (82dfdac), *third* (a48e417), *fourth* (23cba668, its first twelve 9921d07f) and *fifth* (531e5d4a): each as
it was first diagnosed, before anything was changed on its account. The frequencies are those of the other decks.
"""
CHANCE = f"""In brackets, what chance leaves of a posterior whose probabilities are exactly right: median, 5 and 95 % of
{DRAWS} draws of each recording's truth from its own answer.

How often the most probable set is right, by its probability, at the tool's odds:
"""


def section(
    read: Callable[[str, str], Sequence[Item]],
    scores: Mapping[str, Callable[[Sequence[Item]], Count]],
    kinds: Mapping[str, Statements],
) -> str:
    """Return the section of the page.

    Parameters
    ----------
    read : callable
        Returns the diagnosed recordings of a deck under a label.
    scores : mapping of str to callable
        Scores of a part of the decks, by what they count.
    kinds : mapping of str to callable
        What is said with a probability: its statements about a recording.
    """
    diagnosed = {deck: read(deck, label) for deck, label, _ in RUNS}
    answers: tuple[list[Item], list[Item]] = ([], [])
    for deck, _, before in RUNS:
        others = frequencies([item for other, items in diagnosed.items() if other != deck for item in items])
        for column, odds in zip(answers, (before, others.of), strict=True):
            column += [reweigh(item, odds, before) for item in diagnosed[deck]]
    rows = []
    for part, title in PARTS.items():
        for what, count in scores.items():
            both = [count([item for item in column if item.entry.part == part]) for column in answers]
            rows.append([title, what, *map(count_text, both)])
    for what, of in kinds.items():
        rows.append(
            ["all", f"expected calibration error, {what}", *(_measured_and_chance(c, of) for c in answers)]
        )
    scored = table(["recordings", "score", "the tool's odds", "frequencies of the decks"], rows)
    first = table(["probability", *PARTS.values(), "all recordings"], list(_first_sets(answers[0])))
    return "\n".join([TEXT, scored, CHANCE, first])


def _measured_and_chance(items: Sequence[Item], of: Statements) -> str:
    middle, low, high = np.quantile(_by_chance(items, of), QUANTILES)
    return f"{_error(items, of):.3f} ({middle:.3f}, {low:.3f} to {high:.3f})"


def _error(items: Sequence[Item], of: Statements) -> float:
    return score.calibration_error(score.reliability([one for item in items for one in of(item)]))


def _by_chance(items: Sequence[Item], of: Statements) -> list[float]:
    """Calibration errors if the truths are drawn from the answers."""
    chance = np.random.default_rng(0)
    answered = [item for item in items if item.answer.sets]
    errors = []
    for _ in range(DRAWS):
        drawn = []
        for item in answered:
            weights = np.array([p for _, p in item.answer.sets])
            names = item.answer.sets[chance.choice(len(weights), p=weights / weights.sum())][0]
            drawn.append(_with_truth(item, names))
        errors.append(_error(drawn, of))
    return errors


def _with_truth(item: Item, names: Names) -> Item:
    """Return a recording for which this set of effects is right and no other, not even without its weak effects."""
    outside = names == UNKNOWN
    truth = () if outside else tuple(sorted(names))
    return replace(item, entry=replace(item.entry, truth=truth, outside=outside, also_right=(), strength={}))


def _first_sets(items: Sequence[Item]) -> Iterator[list[str]]:
    """Rows of the table: for each range the mean probability of the most probable set, and how often it is right."""
    groups = [
        [item for item in items if item.entry.part == part and item.entry.truth and not item.entry.outside]
        for part in PARTS
    ]
    groups.append(list(items))
    for low, high in pairwise(RANGES):
        row = [f"{low:g} to {high:g}"]
        for group in groups:
            first = [(item.answer.sets[0][1], score.first(item)) for item in group if item.answer.sets]
            inside = [(p, is_right) for p, is_right in first if low <= p < high or p == high == 1.0]
            right = Count(sum(is_right for _, is_right in inside), len(inside))
            mean = float(np.mean([p for p, _ in inside])) if inside else 0.0
            row.append(f"{mean:.2f}: {count_text(right)}" if inside else "")
        yield row
