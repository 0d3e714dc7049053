"""The decks that were diagnosed once, after they had been drawn: scored together.

One deck of seventy recordings cannot tell a calibration error of 0.05 from a perfect posterior, which chance alone
takes to 0.04; three together can.
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

# Decks, the label of their run, and the prior odds of that revision.
RUNS: Sequence[tuple[str, str, Callable[[Names], float]]] = (
    ("second", "0e8e176", independent_odds),
    ("third", "a48e417", tool_odds),
    ("fourth", "23cba668", tool_odds),
)
# Ranges of the probability of the most probable set.
RANGES = (0.0, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99, 1.0)
# Draws of the truths from the answers, and the quantiles that are stated.
DRAWS, QUANTILES = 400, (0.5, 0.05, 0.95)
# Parts of the decks whose effects are in the catalogue.
PARTS = ("own", "foreign")
TEXT = """## The new decks together

*Second*, *third* and *fourth*, each as it was diagnosed after its drawing: recordings that the code of their day did
not know.
"""
PERFECT = f"""The last column is what chance leaves of a posterior whose probabilities are exactly right: the truth of
each recording was drawn from its own answer, {DRAWS} times.
"""
FIRST = """How often the most probable set is right, by its probability, at the tool's odds (recordings with effects of
the catalogue). *Named outright* are nearly all from 0.95 on. So the answers that are not outright are as uncertain as
they say: other odds would state more and be wrong more often. Only formulas that err less, and with them a smaller
error of form, or richer recordings can name more.
"""


def section(
    read: Callable[[str, str], Sequence[Item]],
    scores: Mapping[str, Callable[[Sequence[Item]], Count]],
    kinds: Mapping[str, Callable[[Item], Iterable[tuple[float, bool]]]],
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
    diagnosed = [(item, before) for deck, label, before in RUNS for item in read(deck, label)]
    items = [item for item, _ in diagnosed]
    known = frequencies(items)
    at_odds = [reweigh(item, known.of, before) for item, before in diagnosed]
    rows = []
    for what, of in kinds.items():
        measured = [f"{_error(answers, of):.3f}" for answers in (items, at_odds)]
        middle, low, high = np.quantile(_by_chance(at_odds, of), QUANTILES)
        rows.append([what, *measured, f"{middle:.3f} ({low:.3f} to {high:.3f})"])
    head = [
        f"expected calibration error, {len(items)} recordings",
        "the tool's odds",
        "frequencies of these decks",
        "a perfect posterior's: median (5 to 95 %)",
    ]
    counts = []
    for part in PARTS:
        for what, count in scores.items():
            both = [count([i for i in answers if i.entry.part == part]) for answers in (items, at_odds)]
            counts.append([part, what, *map(count_text, both)])
    parts = [TEXT, table(["recordings", "score", "the tool's odds", "frequencies of these decks"], counts)]
    parts += [table(head, rows), PERFECT, FIRST]
    return "\n".join([*parts, table(["probability", *PARTS], list(_first_sets(items)))])


def _error(items: Sequence[Item], of: Callable[[Item], Iterable[tuple[float, bool]]]) -> float:
    return score.calibration_error(score.reliability([one for item in items for one in of(item)]))


def _by_chance(items: Sequence[Item], of: Callable[[Item], Iterable[tuple[float, bool]]]) -> list[float]:
    """Calibration errors if the truths are drawn from the answers."""
    chance = np.random.default_rng(0)
    answered = [item for item in items if item.answer.sets]
    errors = []
    for _ in range(DRAWS):
        drawn = []
        for item in answered:
            weights = np.array([p for _, p in item.answer.sets])
            names = item.answer.sets[chance.choice(len(weights), p=weights / weights.sum())][0]
            truth = tuple(sorted(names - UNKNOWN))
            entry = replace(item.entry, truth=truth, outside=bool(names & UNKNOWN), also_right=())
            drawn.append(replace(item, entry=entry))
        errors.append(_error(drawn, of))
    return errors


def _first_sets(items: Sequence[Item]) -> Iterator[list[str]]:
    """Rows of the table: for each range the mean probability of the most probable set, and how often it is right."""
    concealed = [item for item in items if item.entry.truth and not item.entry.outside and item.answer.sets]
    for low, high in pairwise(RANGES):
        row = [f"{low:g} to {high:g}"]
        for part in PARTS:
            inside = [
                item
                for item in concealed
                if item.entry.part == part
                and low <= item.answer.sets[0][1]
                and (item.answer.sets[0][1] < high or high == 1.0)
            ]
            mean = np.mean([item.answer.sets[0][1] for item in inside]) if inside else 0.0
            right = Count(sum(map(score.first, inside)), len(inside))
            row.append(f"{mean:.2f}: {count_text(right)}" if inside else "")
        yield row
