"""Make the page of tables and the picture of reliability diagrams from manifests and ledgers."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from benchmarks.concealed.report import count_text, table
from benchmarks.concealed.score import Count
from benchmarks.decks import fresh, ledger, manifest, score, why
from benchmarks.decks.answer import answer_of
from benchmarks.decks.manifest import Entry
from benchmarks.decks.odds import frequencies, independent_odds, reweigh
from benchmarks.decks.score import Item

ABOUT = Path(__file__).parent / "about.md"
ODDS = ABOUT.with_name("odds.md")
RUNS = ABOUT.with_name("runs.md")
SCORES = (
    "## Scores\n\nOf the recordings that were diagnosed under each label. What was wanted was fixed together with\n"
    "the decks, before any run.\n\n"
)
# The diagnosed recordings by label.
Runs = Mapping[str, Sequence[Item]]


def items(deck: str, label: str) -> list[Item]:
    """Recordings of a deck that were diagnosed under a label."""
    lines = ledger.read(deck, label)
    return [
        Item(entry, answer_of(lines[name])) for name, entry in manifest.read(deck).items() if name in lines
    ]


def _catalogue(answers: Sequence[Item]) -> list[Item]:
    return [i for i in answers if i.entry.truth and not i.entry.outside]


def _tellable(answers: Sequence[Item]) -> list[Item]:
    return [i for i in _catalogue(answers) if i.entry.tellable]


def _nothing(answers: Sequence[Item]) -> list[Item]:
    return [i for i in answers if i.entry.kind == "none"]


def _outside(answers: Sequence[Item]) -> list[Item]:
    return [i for i in answers if i.entry.outside]


def _right(answers: Sequence[Item]) -> Count:
    return score.count(_catalogue(answers), score.in_set)


def _outright(answers: Sequence[Item]) -> Count:
    return score.count(_tellable(answers), score.is_outright)


def _wrong(answers: Sequence[Item]) -> Count:
    return score.count(answers, lambda i: bool(score.wrong_effects(i)))


def _inside(answers: Sequence[Item]) -> Count:
    holds = [interval.holds for i in answers for interval in score.intervals(i)]
    return Count(sum(holds), len(holds))


def _verdicts(answers: Sequence[Item]) -> Count:
    right = [score.outside_right(i) if i.entry.outside else score.is_explained(i) for i in answers]
    return Count(sum(right), len(right))


# Deck, score, what was wanted of it, and how it is counted.
WANTED: Sequence[tuple[str, str, str, Callable[[Sequence[Item]], Count]]] = (
    ("own", "right set in the credible set", "97 % or more", _right),
    ("own", "named outright, where it can be told", "95 % or more", _outright),
    ("own", "recordings with an absent effect stated", "2 % or less", _wrong),
    ("own", "95 % intervals that hold the true value", "92 % or more", _inside),
    ("foreign", "right set in the credible set", "95 % or more", _right),
    ("foreign", "named outright, where it can be told", "85 % or more", _outright),
    ("foreign", "recordings with an absent effect stated", "3 % or less", _wrong),
    ("nothing", "`explained`, or unexplained in the right place", "90 % or more", _verdicts),
    ("nothing", "recordings with an absent effect stated", "3 % or less", _wrong),
)
# What is said with a probability.
KINDS: Mapping[str, Callable[[Item], Iterable[tuple[float, bool]]]] = {
    "effects": score.statements,
    "sets of effects": score.models,
}


def document(labels: Sequence[str], decks: Sequence[str], output: Path | None = None) -> str:
    """Return the whole page; with `output`, write the picture beside it."""
    by_deck = {deck: {label: items(deck, label) for label in labels} for deck in decks}
    together = {label: [item for deck in decks for item in by_deck[deck][label]] for label in labels}
    parts = [ABOUT.read_text(encoding="utf-8"), SCORES + scores(by_deck)]
    parts.append(_with_other_odds({deck: runs[labels[-1]] for deck, runs in by_deck.items()}))
    for deck, runs in by_deck.items():
        parts.append(_deck(deck, runs))
    parts.append(
        _reliability(together, None if output is None else output.with_name(f"{output.stem}-reliability.svg"))
    )
    parts += [_misses(deck, runs) for deck, runs in by_deck.items()]
    parts += [why.section(decks, labels), RUNS.read_text(encoding="utf-8")]
    parts.append(fresh.section(items, {what: of for deck, what, _, of in WANTED if deck == "foreign"}, KINDS))
    return "\n".join(parts)


def scores(by_deck: Mapping[str, Runs]) -> str:
    """Return the table of scores, of all that was diagnosed under each label, beside what was wanted.

    Parameters
    ----------
    by_deck : mapping of str to mapping of str to list of Item
        Recordings by deck and label.
    """
    together: dict[str, list[Item]] = {}
    for runs in by_deck.values():
        for label, diagnosed in runs.items():
            together.setdefault(label, []).extend(diagnosed)
    rows = [
        [deck, what, wanted, *(count_text(of(runs)) for runs in by_deck[deck].values())]
        for deck, what, wanted, of in WANTED
        if deck in by_deck
    ]
    for what, statements in KINDS.items():
        errors = [score.calibration_error(_bins(diagnosed, statements)) for diagnosed in together.values()]
        rows.append(["all", f"expected calibration error, {what}", "0.05 or less", *map(finite, errors)])
    return table(["deck", "score", "wanted", *together], rows)


def _with_other_odds(by_deck: Runs) -> str:
    """Scores of the same answers if the prior odds were the frequencies in the decks."""
    every = [item for items_ in by_deck.values() for item in items_]
    if not every:
        return ""
    known = frequencies(every)
    other = {
        deck: [reweigh(item, known.of, independent_odds) for item in items_]
        for deck, items_ in by_deck.items()
    }
    rows = [
        [deck, what, wanted, count_text(of(by_deck[deck])), count_text(of(other[deck]))]
        for deck, what, wanted, of in WANTED
        if deck in by_deck and of is not _inside
    ]
    together = [every, [item for items_ in other.values() for item in items_]]
    for what, statements in KINDS.items():
        for deck, pair in (*((d, [by_deck[d], other[d]]) for d in by_deck), ("all", together)):
            errors = [finite(score.calibration_error(_bins(runs, statements))) for runs in pair]
            wanted = "0.05 or less" if deck == "all" else ""
            rows.append([deck, f"expected calibration error, {what}", wanted, *errors])
    return ODDS.read_text(encoding="utf-8") + table(
        ["deck", "score", "wanted", "the tool's odds", "frequencies of the decks"], rows
    )


def _deck(deck: str, runs: Runs) -> str:
    entries = manifest.read(deck)
    head = ["", *(f"{label} ({len(answers)} of {len(entries)})" for label, answers in runs.items())]
    common = (
        set.intersection(*({i.entry.name for i in answers} for answers in runs.values())) if runs else set()
    )
    rows = _rows(runs)
    text = f"## Deck {deck}\n\n" + table(head, rows)
    if len(runs) > 1 and any(len(answers) != len(common) for answers in runs.values()) and common:
        same = {label: [i for i in answers if i.entry.name in common] for label, answers in runs.items()}
        head = ["", *(f"{label} ({len(common)} alike)" for label in runs)]
        text += "\nThe recordings that were diagnosed under all labels:\n\n" + table(head, _rows(same))
    return "\n".join([text, _by_truth(runs), _times(runs)])


def _rows(runs: Runs) -> list[list[str]]:
    def of(choose: Callable[[Sequence[Item]], list[Item]], good: Callable[[Item], bool]) -> list[str]:
        return [count_text(score.count(choose(answers), good)) for answers in runs.values()]

    def wrong(answers: Sequence[Item]) -> str:
        return f"{sum(len(score.wrong_effects(i)) for i in answers)} in {count_text(_wrong(answers))}"

    def logs(answers: Sequence[Item]) -> str:
        return f"{statistics.mean(map(score.log_score, answers)):.2f}" if answers else ""

    rows = [
        ["right set in the credible set", *(count_text(_right(answers)) for answers in runs.values())],
        ["right set the most probable", *of(_catalogue, score.first)],
        [
            "named outright, where it can be told",
            *(count_text(_outright(answers)) for answers in runs.values()),
        ],
        ["named outright, all", *of(_catalogue, score.is_outright)],
        ["called unexplained, though in the catalogue", *of(_catalogue, score.is_unexplained)],
        ["nothing concealed: `explained`", *of(_nothing, score.is_explained)],
        ["nothing concealed: nothing in the credible set", *of(_nothing, score.in_set)],
        ["outside: unexplained in the right place, or its later name", *of(_outside, score.outside_right)],
        ["outside: `unexplained`", *of(_outside, score.is_unexplained)],
        ["absent effects stated with 95 % or more", *map(wrong, runs.values())],
        [
            "95 % intervals that hold the true value",
            *(count_text(_inside(answers)) for answers in runs.values()),
        ],
        ["`faulty_data`, which is never right here", *of(list, lambda i: i.answer.verdict == "faulty_data")],
        ["spikes reported where there are some", *of(_with_spikes, lambda i: "spikes" in i.answer.faults)],
        ["a data fault reported where there is none", *of(_clean, lambda i: bool(i.answer.faults))],
        ["no result (failed, out of time)", *of(list, lambda i: i.answer.verdict == "no result")],
        ["log score, mean (nats)", *map(logs, runs.values())],
    ]
    return [row for row in rows if any(cell not in ("none", "") for cell in row[1:])]


def _with_spikes(answers: Sequence[Item]) -> list[Item]:
    return [i for i in answers if "spikes" in i.entry.faults]


def _clean(answers: Sequence[Item]) -> list[Item]:
    return [i for i in answers if not i.entry.faults]


def truth_of(entry: Entry) -> str:
    """The truth in words."""
    if entry.kind == "none":
        return "nothing"
    if entry.outside:
        return str(entry.formulas[0]["name"])
    names = " + ".join(entry.truth)
    return f"{names} ({entry.formulas[0]['name']})" if entry.part == "foreign" else names


def _by_truth(runs: Runs) -> str:
    groups: dict[str, None] = {}
    for answers in runs.values():
        for i in sorted(answers, key=lambda i: truth_of(i.entry)):
            groups.setdefault(
                "a pair" if i.entry.part == "own" and i.entry.kind == "pair" else truth_of(i.entry)
            )
    rows = []
    for group in sorted(groups):
        row = [group]
        for answers in runs.values():
            of = [
                i
                for i in answers
                if truth_of(i.entry) == group
                or (group == "a pair" and i.entry.part == "own" and i.entry.kind == "pair")
            ]
            if not of:
                row += ["", "", ""]
                continue
            row += [
                f"{sum(map(_good, of))} of {len(of)}",
                str(sum(map(score.is_outright, of))),
                str(sum(bool(score.wrong_effects(i)) for i in of)),
            ]
        rows.append(row)
    head = ["truth"]
    for label in runs:
        head += [f"{label}: right", "outright", "wrong effect stated"]
    return "### By truth\n\n" + table(head, rows)


def _good(item: Item) -> bool:
    return score.outside_right(item) if item.entry.outside else score.in_set(item)


def _times(runs: Runs) -> str:
    kinds = sorted({", ".join(i.entry.channels) for answers in runs.values() for i in answers})
    rows = []
    for kind in kinds:
        row = [kind]
        for answers in runs.values():
            s = [_seconds(i) for i in answers if ", ".join(i.entry.channels) == kind]
            row.append(f"{len(s)}: {statistics.median(s):.0f}, {max(s):.0f}" if s else "")
        rows.append(row)
    head = ["channels", *(f"{label}: recordings: median, longest (s)" for label in runs)]
    return "### Seconds\n\nProcessor time where it was measured, else wall clock.\n\n" + table(head, rows)


def _seconds(item: Item) -> float:
    line = item.answer.line
    return float(line.get("processor_seconds", line["seconds"]))


def _bins(answers: Sequence[Item], of: Callable[[Item], Iterable[tuple[float, bool]]]) -> list[score.Bin]:
    return score.reliability([statement for i in answers for statement in of(i)])


def _reliability(runs: Runs, picture: Path | None) -> str:
    text = (
        "## Reliability\n\nThe share of statements that are true, by ranges of the stated probability; all decks. "
        "Old answers have no probability: 1 over the number of sets is used.\n\n"
    )
    drawn = {}
    for what, of in KINDS.items():
        bins = {label: _bins(answers, of) for label, answers in runs.items()}
        drawn[what] = bins
        rows = []
        for low, high in zip(score.BINS[:-1], score.BINS[1:], strict=True):
            row = [f"{low:g} to {high:g}"]
            for own in bins.values():
                (match,) = [b for b in own if b.low == low] or [None]
                row.append("" if match is None else f"{match.mean:.2f}: {count_text(match.true)}")
            rows.append(row)
        rows.append(
            ["expected calibration error", *(finite(score.calibration_error(own)) for own in bins.values())]
        )
        head = [what, *(f"{label}: mean stated: true" for label in runs)]
        text += table(head, rows) + "\n"
    if picture is not None and any(any(bins.values()) for bins in drawn.values()):
        draw(drawn, picture)
        text += f"![Reliability diagrams]({picture.name})\n"
    return text


def draw(kinds: Mapping[str, Mapping[str, Sequence[score.Bin]]], file: Path) -> None:
    """Draw reliability diagrams side by side: stated probability against true share, with 95 % intervals."""
    import matplotlib

    matplotlib.use("Agg")
    # The picture is kept in git, so that the same numbers must give the same file.
    matplotlib.rcParams["svg.hashsalt"] = "decks"
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, len(kinds), figsize=(4.2 * len(kinds), 4.2), squeeze=False)
    for axis, (what, bins) in zip(axes[0], kinds.items(), strict=True):
        axis.plot([0, 1], [0, 1], color="0.7", linewidth=1)
        for k, (label, own) in enumerate(bins.items()):
            x = [b.mean + 0.006 * k for b in own]
            y = [b.true.share for b in own]
            ends = [b.true.wilson() for b in own]
            low = [max(0.0, s - e[0]) for s, e in zip(y, ends, strict=True)]
            high = [max(0.0, e[1] - s) for s, e in zip(y, ends, strict=True)]
            axis.errorbar(x, y, [low, high], marker="o", markersize=4, linewidth=1, capsize=2, label=label)
        axis.set(xlabel="stated", ylabel="true", title=what, xlim=(-0.02, 1.04), ylim=(-0.02, 1.02))
        axis.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else None)
    pyplot.close(figure)


def _misses(deck: str, runs: Runs) -> str:
    text = f"## Misses of deck {deck}\n"
    for label, answers in runs.items():
        rows = []
        for i in answers:
            if _good(i) and not score.wrong_effects(i):
                continue
            credible = " or ".join(" + ".join(sorted(names)) or "nothing" for names in i.answer.credible[:5])
            more = f" or {len(i.answer.credible) - 5} more" if len(i.answer.credible) > 5 else ""
            entry = i.entry
            what = f"{truth_of(entry)}, {entry.share:.1f} %, {entry.program}, {', '.join(entry.channels)}"
            alike = ", ".join(entry.look_alikes or ())
            verdict = i.answer.verdict.replace("_", " ")
            rows.append(
                [
                    entry.name,
                    what,
                    alike,
                    verdict,
                    credible + more,
                    _wrong_effects(i),
                    *_probability_and_misfits(i),
                ]
            )
        head = [
            "name",
            "truth",
            "look-alikes",
            "verdict",
            "credible set",
            "wrongly stated",
            "right",
            "misfits",
        ]
        text += f"\n### {label}\n\n" + (table(head, rows) if rows else "None.\n")
    return text


def _probability_and_misfits(item: Item) -> tuple[str, str]:
    """Probability of the right sets, and misfits of their best fit and of the first set's, in units of the noise."""
    first = [names for names, _ in item.answer.sets[:1]]
    pair = (item.answer.misfit(item.right), item.answer.misfit(first))
    misfits = ", ".join("not fitted" if value is None else f"{value:.2f}" for value in pair)
    return f"{item.answer.of(item.right):.4f}" if item.answer.sets else "", misfits if any(pair) else ""


def _wrong_effects(item: Item) -> str:
    return ", ".join(sorted(score.wrong_effects(item)))


def finite(value: float) -> str:
    """A number as text; empty if it is not finite."""
    return f"{value:.3f}" if math.isfinite(value) else ""
