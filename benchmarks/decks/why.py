"""Why the right set of effects of a recording is not named outright: what its weight lacks against the other answers.

The weight of a model is its prior odds times its evidence; the evidence is its largest likelihood times the share of
the prior's volume in which the likelihood is about as large. For each recording whose right set was not named outright,
the effects of the right sets and of the three most probable wrong ones are diagnosed again, and the best right model is
compared with the best wrong one, in nats:

- *data*: logarithm of the likelihood. Where it is negative, the wrong model fits better, or is granted a larger error
  of form.
- *values*: how probable the prior holds the values, and how sharply the recording determines them.
- *odds*: prior odds of the effects.

Errors of form that resemble an effect (`bushcli.diagnosis.resemblance`) are not counted here: where the right model has
far more weight than the wrong one, they are what keeps it from being named outright, or many small rivals are.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.concealed.report import table
from benchmarks.decks import ledger, manifest, score
from benchmarks.decks.answer import Names, answer_of, bases
from benchmarks.decks.score import Item
from bushcli.case import load_case
from bushcli.diagnosis.diagnose import question
from bushcli.diagnosis.question import pose_problem
from bushcli.likelihood.form import Judged
from bushcli.runtime.workers import Workers
from bushcli.selection.model_cache import ModelCache
from bushcli.selection.plain import first_plain_fit as begin_plain
from bushcli.selection.queue import Search

REASONED = Path(__file__).parent / "why.md"
# Most wrong sets whose effects are diagnosed again.
WRONG = 3
# Most models of a right set (places, branches, laws) that are fitted although the search has not fitted them.
FORCED = 2
# Advantage in nats with which a model has 95 % beside one rival.
OUTRIGHT = math.log(0.95 / 0.05)
# What keeps the right answer from being named outright, and how it is called on the page.
REASONS = {
    "data": "the other model fits better, or is granted a larger error of form",
    "values": "the prior holds the right values to be improbable, or the right model determines them more sharply",
    "odds": "the right effects have the smaller prior odds",
    "rivals": "neither: errors of form that resemble an effect, or several small rivals",
    "not fitted": "no right model could be fitted",
}
# Difference of the logarithms of the likelihoods in nats up to which the recordings hardly tell two models apart: the
# evidence that changes odds by a factor of 20 (Kass and Raftery, 1995, doi:10.1080/01621459.1995.10476572: "strong").
ALIKE = 3.0
# Why a right answer is not in the credible set, by that difference.
MISSES = {
    "alike": f"the recording hardly shows it: both fit alike, within {ALIKE:g} nats",
    "worse": "the right formulas fit worse",
    "better": "the right formulas fit better, but the prior holds their values or effects to be improbable",
}


@dataclass(frozen=True)
class Terms:
    """The logarithm of a model's weight, in parts (nats).

    Attributes
    ----------
    names : frozenset of str
        Its effects; "unknown" is one.
    data, values, odds : float
        Largest likelihood; evidence over that; prior odds.
    misfit : float
        In standard deviations of the noise.
    """

    names: Names
    data: float
    values: float
    odds: float
    misfit: float

    @property
    def weight(self) -> float:
        """Logarithm of the weight."""
        return self.data + self.values + self.odds


def items_to_explain(deck: str, label: str) -> Iterator[Item]:
    """Yield the recordings whose right answer is not given outright.

    Parameters
    ----------
    deck, label : str
    """
    lines = ledger.read(deck, label)
    for name, entry in manifest.read(deck).items():
        if name in lines:
            item = Item(entry, answer_of(lines[name]))
            if entry.outside:
                right = score.outside_right(item)
            else:
                right = score.is_outright(item) if entry.truth else score.is_explained(item)
            if not right:
                yield item


def terms(folder: Path, item: Item) -> list[Terms]:
    """Diagnose a recording with the effects of the right and the most probable wrong sets only.

    Parameters
    ----------
    folder : Path
        Of the deck.
    item : Item
    """
    wrong = [names for names, _ in item.answer.sets if names not in item.right][:WRONG]
    names = frozenset().union(*item.right, *wrong) - {"unknown"}
    cache = ModelCache(None)
    asked = question(
        load_case(folder / "cases" / item.entry.name / "case.toml"), None, sorted(names), (), cache.tables
    )
    with Workers(1, None, None, cache).open() as crew:
        rough = crew.run(begin_plain, [(asked.bare, asked.plain, asked.used)])[0]
        problem, state = pose_problem(asked.bare, rough, asked.recordings, asked.used, crew, cache)
        search = Search(problem, crew, state, asked.effects, False, float("inf"), lambda *_: None)
        search.run()
        _fit_right(search, item)
    return list(_terms(search))


def _fit_right(search: Search, item: Item) -> None:
    """Fit right sets that the search did not fit, because their fits were predicted to change nothing."""
    known = {bases(state.model.identities) for state in search.states.values()}
    for names in item.right - known:
        models = [queued for queued in search.waiting.values() if bases(queued.model.identities) == names]
        for queued in sorted(models, key=lambda queued: -queued.predicted)[:FORCED]:
            search.fit_anyway(queued)


def _terms(search: Search) -> Iterator[Terms]:
    for state in search.states.values():
        evidence, names = state.evidence, bases(state.model.identities)
        kinds: Sequence[tuple[bool, Judged, float]] = (
            (False, evidence.judgement, evidence.log),
            (True, evidence.unknown_judgement, evidence.log_unknown),
        )
        for unknown, judged, log in kinds:
            odds = search.odds(state.model, unknown=unknown)
            yield Terms(
                names | ({"unknown"} if unknown else frozenset()),
                judged.log,
                log - judged.log,
                odds,
                state.misfit_over_noise,
            )


def compare(folder: Path, item: Item) -> dict[str, Any] | None:
    """Compare the best right model with the best wrong one; None if no right one could be fitted.

    Parameters
    ----------
    folder : Path
        Of the deck.
    item : Item
    """
    every = terms(folder, item)
    right = max(
        (term for term in every if term.names in item.right), key=lambda term: term.weight, default=None
    )
    if right is None:
        return None
    # The unknown effect beside a right model is a wrong answer that always exists.
    wrong = max((term for term in every if term.names not in item.right), key=lambda term: term.weight)
    return {
        "name": item.entry.name,
        "in_set": score.in_set(item),
        "right": sorted(right.names),
        "wrong": sorted(wrong.names),
        "probability": round(item.answer.of(item.right), 4),
        "data": round(right.data - wrong.data, 2),
        "values": round(right.values - wrong.values, 2),
        "odds": round(right.odds - wrong.odds, 2),
        "misfit": [round(right.misfit, 3), round(wrong.misfit, 3)],
    }


def why(deck: str, folder: Path, label: str, names: Sequence[str] = ()) -> Iterator[str]:
    """Compare the recordings that are not in the results yet; write a line of JSON for each, and yield a text.

    Parameters
    ----------
    deck : str
    folder : Path
        Of the deck's data.
    label : str
        Ledger whose answers are explained.
    names : sequence of str
        These recordings only.
    """
    done = ledger.read(deck, f"why-{label}")
    for item in items_to_explain(deck, label):
        if item.entry.name in done or (names and item.entry.name not in names):
            continue
        line = compare(folder, item) or {"name": item.entry.name, "right": None}
        ledger.append(deck, f"why-{label}", line)
        yield json.dumps(line)


def reason(line: Mapping[str, Any]) -> str:
    """Return which part of the weight keeps the right answer from being named outright, a key of `REASONS`.

    Parameters
    ----------
    line : mapping
        Line of the results.
    """
    if line["right"] is None:
        return "not fitted"
    parts = {key: float(line[key]) for key in ("data", "values", "odds")}
    if sum(parts.values()) > OUTRIGHT:
        return "rivals"
    return min(parts, key=lambda key: parts[key])


def miss(line: Mapping[str, Any]) -> str:
    """Return why the right answer is not in the credible set, a key of `MISSES`.

    Parameters
    ----------
    line : mapping
        Line of the results, of a recording whose right model could be fitted.
    """
    if abs(line["data"]) <= ALIKE:
        return "alike"
    return "better" if line["data"] > 0.0 else "worse"


def _missed_table(by_deck: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """The right answers that are not in the credible set, by reason and deck."""
    names: dict[tuple[str, str], list[str]] = {}
    for deck, lines in by_deck.items():
        for line in sorted(lines.values(), key=lambda row: row["name"]):
            if line["right"] is not None and not line["in_set"]:
                names.setdefault((miss(line), deck), []).append(line["name"])
    rows = [
        [text, *(", ".join(names.get((key, deck), ["none"])) for deck in by_deck)]
        for key, text in MISSES.items()
    ]
    return table(["not in the credible set, because", *by_deck], rows)


def section(decks: Sequence[str], labels: Sequence[str], folder: Path = ledger.FOLDER) -> str:
    """Return the part of the page about reasons; empty where none were calculated.

    Parameters
    ----------
    decks : sequence of str
    labels : sequence of str
        Ledgers. The answers of the last one of which the reasons were calculated are explained.
    folder : Path
        Of the ledgers.
    """
    by_label = {
        label: {deck: lines for deck in decks if (lines := ledger.read(deck, f"why-{label}", folder))}
        for label in labels
    }
    label = next((label for label in reversed(labels) if by_label[label]), None)
    if label is None:
        return ""
    by_deck = by_label[label]
    counts = {deck: Counter(map(reason, lines.values())) for deck, lines in by_deck.items()}
    rows = [[text, *(str(counts[deck][key]) for deck in by_deck)] for key, text in REASONS.items()]
    parts = [
        REASONED.read_text("utf-8").format(label=label),
        table(["what the right model lacks most", *by_deck], rows),
        "",
        _missed_table(by_deck),
    ]
    for deck, lines in by_deck.items():
        parts += [f"\n### Deck {deck}: right against the best wrong model, in nats\n"]
        head = ["recording", "right", "wrong", "data", "values", "odds", "misfits", "lacks most"]
        parts.append(
            table(head, [_row(line) for line in sorted(lines.values(), key=lambda row: row["name"])])
        )
    return "\n".join(parts)


def _row(line: Mapping[str, Any]) -> list[str]:
    if line["right"] is None:
        return [line["name"], "", "", "", "", "", "", reason(line)]
    sets = [", ".join(line[key]) or "nothing" for key in ("right", "wrong")]
    nats = [f"{line[key]:+.1f}" for key in ("data", "values", "odds")]
    misfits = ", ".join(f"{misfit:.2f}" for misfit in line["misfit"])
    return [line["name"], *sets, *nats, misfits, reason(line)]
