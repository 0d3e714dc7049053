"""Make the page of tables and the picture of reliability diagrams from manifests and ledgers."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from benchmarks.concealed.report import shown, table
from benchmarks.concealed.score import Count
from benchmarks.decks import ledger, manifest, score, why
from benchmarks.decks.manifest import Entry
from benchmarks.decks.odds import frequencies, reweighed
from benchmarks.decks.said import said
from benchmarks.decks.score import Item

ABOUT = Path(__file__).parent / "about.md"
ODDS = Path(__file__).parent / "odds.md"
SCORES = (
    "## Scores\n\nOf the recordings that were diagnosed under each label. What was wanted was fixed together with\n"
    "the decks, before any run.\n\n"
)
# The diagnosed recordings by label.
Runs = Mapping[str, Sequence[Item]]


def items(deck: str, label: str) -> list[Item]:
    """Recordings of a deck that were diagnosed under a label."""
    lines = ledger.read(deck, label)
    return [Item(one, said(lines[name])) for name, one in manifest.read(deck).items() if name in lines]


def _catalogue(found: Sequence[Item]) -> list[Item]:
    return [i for i in found if i.entry.truth and not i.entry.outside]


def _tellable(found: Sequence[Item]) -> list[Item]:
    return [i for i in _catalogue(found) if i.entry.tellable]


def _nothing(found: Sequence[Item]) -> list[Item]:
    return [i for i in found if i.entry.kind == "none"]


def _outside(found: Sequence[Item]) -> list[Item]:
    return [i for i in found if i.entry.outside]


def _right(found: Sequence[Item]) -> Count:
    return score.count(_catalogue(found), score.in_set)


def _outright(found: Sequence[Item]) -> Count:
    return score.count(_tellable(found), score.outright)


def _wrong(found: Sequence[Item]) -> Count:
    return score.count(found, lambda i: bool(score.wrongly(i)))


def _inside(found: Sequence[Item]) -> Count:
    holds = [one.holds for i in found for one in score.intervals(i)]
    return Count(sum(holds), len(holds))


def _verdicts(found: Sequence[Item]) -> Count:
    right = [score.outside_right(i) if i.entry.outside else score.explained(i) for i in found]
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
    found = {deck: {label: items(deck, label) for label in labels} for deck in decks}
    together = {label: [one for deck in decks for one in found[deck][label]] for label in labels}
    parts = [ABOUT.read_text(encoding="utf-8"), SCORES + scores(found)]
    parts.append(_with_other_odds({deck: runs[labels[-1]] for deck, runs in found.items()}))
    for deck, runs in found.items():
        parts.append(_deck(deck, runs))
    parts.append(
        _reliability(together, None if output is None else output.with_name(f"{output.stem}-reliability.svg"))
    )
    parts += [_misses(deck, runs) for deck, runs in found.items()]
    parts.append(why.section(decks, labels[-1]))
    return "\n".join(parts)


def scores(found: Mapping[str, Runs]) -> str:
    """Return the table of scores, of all that was diagnosed under each label, beside what was wanted.

    Parameters
    ----------
    found : mapping of str to mapping of str to list of Item
        Recordings by deck and label.
    """
    together: dict[str, list[Item]] = {}
    for runs in found.values():
        for label, diagnosed in runs.items():
            together.setdefault(label, []).extend(diagnosed)
    rows = [
        [deck, what, wanted, *(shown(of(runs)) for runs in found[deck].values())]
        for deck, what, wanted, of in WANTED
        if deck in found
    ]
    for what, said_ in KINDS.items():
        errors = [score.calibration_error(_bins(diagnosed, said_)) for diagnosed in together.values()]
        rows.append(["all", f"expected calibration error, {what}", "0.05 or less", *map(finite, errors)])
    return table(["deck", "score", "wanted", *together], rows)


def _with_other_odds(found: Runs) -> str:
    """Scores of the same answers if the prior odds were the frequencies in the decks."""
    every = [one for items_ in found.values() for one in items_]
    if not every:
        return ""
    known = frequencies(every)
    other = {deck: [reweighed(one, known.of) for one in items_] for deck, items_ in found.items()}
    rows = [
        [deck, what, wanted, shown(of(found[deck])), shown(of(other[deck]))]
        for deck, what, wanted, of in WANTED
        if deck in found and of is not _inside
    ]
    together = [every, [one for items_ in other.values() for one in items_]]
    for what, said_ in KINDS.items():
        for deck, pair in (*((d, [found[d], other[d]]) for d in found), ("all", together)):
            errors = [finite(score.calibration_error(_bins(runs, said_))) for runs in pair]
            wanted = "0.05 or less" if deck == "all" else ""
            rows.append([deck, f"expected calibration error, {what}", wanted, *errors])
    return ODDS.read_text(encoding="utf-8") + table(
        ["deck", "score", "wanted", "the tool's odds", "frequencies of the decks"], rows
    )


def _deck(deck: str, runs: Runs) -> str:
    entries = manifest.read(deck)
    head = ["", *(f"{label} ({len(found)} of {len(entries)})" for label, found in runs.items())]
    common = set.intersection(*({i.entry.name for i in found} for found in runs.values())) if runs else set()
    rows = _rows(runs)
    text = f"## Deck {deck}\n\n" + table(head, rows)
    if len(runs) > 1 and any(len(found) != len(common) for found in runs.values()) and common:
        same = {label: [i for i in found if i.entry.name in common] for label, found in runs.items()}
        head = ["", *(f"{label} ({len(common)} alike)" for label in runs)]
        text += "\nThe recordings that were diagnosed under all labels:\n\n" + table(head, _rows(same))
    return "\n".join([text, _by_truth(runs), _times(runs)])


def _rows(runs: Runs) -> list[list[str]]:
    def of(choose: Callable[[Sequence[Item]], list[Item]], good: Callable[[Item], bool]) -> list[str]:
        return [shown(score.count(choose(found), good)) for found in runs.values()]

    def wrong(found: Sequence[Item]) -> str:
        return f"{sum(len(score.wrongly(i)) for i in found)} in {shown(_wrong(found))}"

    def logs(found: Sequence[Item]) -> str:
        return f"{statistics.mean(map(score.log_score, found)):.2f}" if found else ""

    rows = [
        ["right set in the credible set", *(shown(_right(found)) for found in runs.values())],
        ["right set the most probable", *of(_catalogue, score.first)],
        ["named outright, where it can be told", *(shown(_outright(found)) for found in runs.values())],
        ["named outright, all", *of(_catalogue, score.outright)],
        ["called unexplained, though in the catalogue", *of(_catalogue, score.unexplained)],
        ["nothing concealed: `explained`", *of(_nothing, score.explained)],
        ["nothing concealed: nothing in the credible set", *of(_nothing, score.in_set)],
        ["outside: unexplained in the right place, or its later name", *of(_outside, score.outside_right)],
        ["outside: `unexplained`", *of(_outside, score.unexplained)],
        ["absent effects stated with 95 % or more", *map(wrong, runs.values())],
        ["95 % intervals that hold the true value", *(shown(_inside(found)) for found in runs.values())],
        ["`faulty_data`, which is never right here", *of(list, lambda i: i.said.verdict == "faulty_data")],
        ["spikes reported where there are some", *of(_with_spikes, lambda i: "spikes" in i.said.faults)],
        ["a data fault reported where there is none", *of(_clean, lambda i: bool(i.said.faults))],
        ["no result (failed, out of time)", *of(list, lambda i: i.said.verdict == "no result")],
        ["log score, mean (nats)", *map(logs, runs.values())],
    ]
    return [row for row in rows if any(cell not in ("none", "") for cell in row[1:])]


def _with_spikes(found: Sequence[Item]) -> list[Item]:
    return [i for i in found if "spikes" in i.entry.faults]


def _clean(found: Sequence[Item]) -> list[Item]:
    return [i for i in found if not i.entry.faults]


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
    for found in runs.values():
        for i in sorted(found, key=lambda i: truth_of(i.entry)):
            groups.setdefault(
                "a pair" if i.entry.part == "own" and i.entry.kind == "pair" else truth_of(i.entry)
            )
    rows = []
    for group in sorted(groups):
        row = [group]
        for found in runs.values():
            of = [
                i
                for i in found
                if truth_of(i.entry) == group
                or (group == "a pair" and i.entry.part == "own" and i.entry.kind == "pair")
            ]
            if not of:
                row += ["", "", ""]
                continue
            row += [
                f"{sum(map(_good, of))} of {len(of)}",
                str(sum(map(score.outright, of))),
                str(sum(bool(score.wrongly(i)) for i in of)),
            ]
        rows.append(row)
    head = ["truth"]
    for label in runs:
        head += [f"{label}: right", "outright", "wrong effect stated"]
    return "### By truth\n\n" + table(head, rows)


def _good(item: Item) -> bool:
    return score.outside_right(item) if item.entry.outside else score.in_set(item)


def _times(runs: Runs) -> str:
    kinds = sorted({", ".join(i.entry.channels) for found in runs.values() for i in found})
    rows = []
    for kind in kinds:
        row = [kind]
        for found in runs.values():
            s = [_seconds(i) for i in found if ", ".join(i.entry.channels) == kind]
            row.append(f"{len(s)}: {statistics.median(s):.0f}, {max(s):.0f}" if s else "")
        rows.append(row)
    head = ["channels", *(f"{label}: recordings: median, longest (s)" for label in runs)]
    return "### Seconds\n\nProcessor time where it was measured, else wall clock.\n\n" + table(head, rows)


def _seconds(item: Item) -> float:
    line = item.said.line
    return float(line.get("processor_seconds", line["seconds"]))


def _bins(found: Sequence[Item], of: Callable[[Item], Iterable[tuple[float, bool]]]) -> list[score.Bin]:
    return score.reliability([one for i in found for one in of(i)])


def _reliability(runs: Runs, picture: Path | None) -> str:
    text = (
        "## Reliability\n\nThe share of statements that are true, by ranges of the stated probability; all decks. "
        "Old answers have no probability: 1 over the number of sets is used.\n\n"
    )
    drawn = {}
    for what, of in KINDS.items():
        bins = {label: _bins(found, of) for label, found in runs.items()}
        drawn[what] = bins
        rows = []
        for low, high in zip(score.BINS[:-1], score.BINS[1:], strict=True):
            row = [f"{low:g} to {high:g}"]
            for own in bins.values():
                (one,) = [b for b in own if b.low == low] or [None]
                row.append("" if one is None else f"{one.mean:.2f}: {shown(one.true)}")
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
            x = [one.mean + 0.006 * k for one in own]
            y = [one.true.share for one in own]
            ends = [one.true.wilson() for one in own]
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
    for label, found in runs.items():
        rows = []
        for i in found:
            if _good(i) and not score.wrongly(i):
                continue
            credible = " or ".join(" + ".join(sorted(names)) or "nothing" for names in i.said.credible[:5])
            more = f" or {len(i.said.credible) - 5} more" if len(i.said.credible) > 5 else ""
            entry = i.entry
            what = f"{truth_of(entry)}, {entry.share:.1f} %, {entry.program}, {', '.join(entry.channels)}"
            alike = ", ".join(entry.look_alikes or ())
            verdict = i.said.verdict.replace("_", " ")
            rows.append([entry.name, what, alike, verdict, credible + more, _stated(i), *_compared(i)])
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


def _compared(item: Item) -> tuple[str, str]:
    """Probability of the right sets, and misfits of their best fit and of the first set's, in units of the noise."""
    first = [names for names, _ in item.said.sets[:1]]
    found = (item.said.misfit(item.right), item.said.misfit(first))
    misfits = ", ".join("not fitted" if value is None else f"{value:.2f}" for value in found)
    return f"{item.said.of(item.right):.4f}" if item.said.sets else "", misfits if any(found) else ""


def _stated(item: Item) -> str:
    return ", ".join(sorted(score.wrongly(item)))


def finite(value: float) -> str:
    """A number as text; empty if it is not finite."""
    return f"{value:.3f}" if math.isfinite(value) else ""
