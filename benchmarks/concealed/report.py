"""Scores -> docs/concealed.md."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from benchmarks.concealed.score import (
    Count,
    Item,
    Target,
    intervals,
    named_effects,
    outcome,
    ratio,
    rivals,
    targets,
)
from benchmarks.concealed.truth import CLEAR, FAINT, LARGE, Truth

RULES = """\
# Concealed effects

What `bushcli diagnose` finds in recordings with a concealed effect. Everything here is computed by

```sh
{command}
```

`make` draws a bushing, a stable law, a program, a noise level and an effect from the seed, computes the recording
with third-order elements on another mesh and with other steps than the tool takes, adds noise to force and
displacement, and writes the case file that a user would have. `run` starts `bushcli diagnose` on it, in a process that
has the case and nothing else. `score` reads both, afterwards, and writes this page. A run that was killed
continues where it stopped.

## What is concealed

Every 25 seeds conceal, in random order, each of the 16 effects of the catalogue once alone, five times
nothing, three pairs, and once a fall of the stiffness after the third cycle, which is in no catalogue. Rich programs
have cycles of growing amplitude to both sides, a hold and two rates, and the channels that the effect asks for
(`bushcli list effects`); poor ones load once, or load and unload once, in one channel. Noise is 0.1 to 1 % of
the recorded force range, more where the default mesh alone is off by more than two standard errors.

An effect's *strength* is the change of the noise-free curves, in units of the noise, that is left when the law's
parameters (and the other effect of a pair) have been refitted, and a factor of each channel's forces that calibration
and mesh leave open (0.5 %, in three dimensions 1 %): chi square falls by its square. On rich programs the law is
really refitted, elsewhere to first order. Sizes are drawn between a strength of {faint:g} and 120, to
first order, as far as the effect's typical range allows: *faint* below {clear:g}, *clear* below {large:g}, *large*
above. On rich programs an effect that cannot be seen is drawn again; on poor ones the law imitates much, and an
effect of typical size may stay *hidden*: then the right answer lists it among the rivals.
*Look-alikes* are the other effects that, at their best, stay within four standard errors of the noise-free recording:
no method can tell them from the truth. Each is tried with one typical size, scaled, and one set of shape parameters;
effects with memory are not tried in radial channels.

## Rules

- *Right*: the set of effects that is named is the one that was concealed, no more and no less, or that set is among
  `rivals`.
- *Named outright*: exactly that set is named. The target applies to rich programs without look-alikes; scores of all
  rich programs are given below.
- *False alarm*: nothing was concealed and the verdict is anything but `explained`.
- *Misfit after*: of the worst channel, over the noise that was added, wherever the truth is in the catalogue.
- *Held out*: the sum of squares over the noise, in data that took no part in the fits, after against before; where
  effects are named, right or wrong.
- *Intervals*: of all parameters of the effects, shape parameters too, where exactly the concealed effects are named.
- *Outside the catalogue*: the verdict is `unexplained`, and more than half of the misfit that is located is "too
  soft" in cycles before the fall or "too stiff" in cycles after it.
- No result (failed, out of time) is wrong everywhere. Intervals in brackets are Wilson's, 95 %.
"""

PAGE, ABOUT = "docs/concealed.md", "benchmarks/concealed/about.md"

WORDS = {
    "named": "named",
    "rival": "among the rivals",
    "extra": "named, with more beside it",
    "part": "a part of it",
    "other": "another effect",
    "missed": "missed: explained",
    "law_too_poor": "law too poor",
    "unexplained": "unexplained",
    "explained": "explained",
    "false_alarm": "false alarm",
    "located": "unexplained, located",
    "not_located": "not unexplained, or not located",
    "no_result": "no result",
}


def document(items: Sequence[Item], waiting: Sequence[Truth] = ()) -> str:
    """The whole page, from diagnosed recordings and those that wait for their diagnosis."""
    sets = _sets([item.truth.seed for item in items] + [truth.seed for truth in waiting])
    command = "\n".join(
        f"setup/enter python -m benchmarks.concealed {rest}"
        for rest in (
            *(f"make --count {len(seeds)} --seed {seeds[0]} DIR" for seeds in sets),
            "run DIR",
            f"score DIR -o {PAGE} --about {ABOUT}",
        )
    )
    parts = [
        RULES.format(command=command, faint=FAINT, clear=CLEAR, large=LARGE),
        _scores(items, sets, waiting),
        _by(items, "By effect", "effect", _effect_of),
        _by(items, "By size", "strength", lambda t: [t.size] if t.size and t.kind != "outside" else []),
        _by(items, "By program", "program", lambda t: [f"{t.program}, {', '.join(t.specimen.amplitude)}"]),
        _confusion(items),
        _intervals(items),
        _failures(items),
        _times(items),
    ]
    return "\n".join(parts)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def count_text(count: Count) -> str:
    """A count with its share and interval."""
    if not count.all:
        return "none"
    low, high = count.wilson()
    return f"{count.good} of {count.all}: {100 * count.share:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _sets(seeds: Sequence[int]) -> list[range]:
    """Ranges of consecutive seeds, each made by one command."""
    sets: list[range] = []
    for seed in sorted(seeds):
        if sets and sets[-1].stop == seed:
            sets[-1] = range(sets[-1].start, seed + 1)
        else:
            sets.append(range(seed, seed + 1))
    return sets


def _scores(items: Sequence[Item], sets: Sequence[range], waiting: Sequence[Truth]) -> str:
    """All targets, for all seeds and for each set of seeds."""

    def goal(target: Target) -> str:
        if target.least is not None:
            return f"at least {100 * target.least:.0f} %"
        return "" if target.most is None else f"at most {100 * target.most:.0f} %"

    reached = {True: "yes", False: "**no**", None: ""}
    names = [f"{seeds[0]} to {seeds[-1]}" for seeds in sets]
    each = [targets([item for item in items if item.truth.seed in seeds]) for seeds in sets]
    rows = [
        [t.text, count_text(t.count), goal(t), reached[t.is_reached]]
        + [f"{of[i].count.good} of {of[i].count.all}" for of in each if len(each) > 1]
        for i, t in enumerate(targets(items))
    ]
    title = f"## Scores\n\n{len(items)} recordings, seeds {' and '.join(names)}.\n"
    if waiting:
        # Without this remark the scores would seem to be those of all seeds.
        solid = sum("radial" in truth.specimen.amplitude for truth in waiting)
        title += (
            f"**{len(waiting)} more of these seeds were made and not diagnosed; {solid} of them have a radial "
            "channel, which takes longest.**\n"
        )
    title += "\n"
    return title + table(["score", "", "target", "reached", *(names if len(names) > 1 else ())], rows)


def _effect_of(truth: Truth) -> list[str]:
    if truth.kind == "single":
        return [f"`{name}`" for name in truth.effects]
    return {"none": ["nothing"], "pair": ["a pair"], "outside": ["outside the catalogue"]}[truth.kind]


def _by(items: Sequence[Item], title: str, head: str, keys: Callable[[Truth], Sequence[str]]) -> str:
    """Right answers by a property of the truth; a recording with several keys counts several times."""
    groups: dict[str, list[Item]] = {}
    for item in items:
        for key in keys(item.truth):
            groups.setdefault(key, []).append(item)
    rows = []
    for key, group in sorted(groups.items()):
        outcomes = Counter(outcome(item) for item in group)
        outright = outcomes["named"] + outcomes["explained"] + outcomes["located"]
        ratios = [r for r in map(ratio, group) if r is not None]
        rest = ", ".join(
            f"{n} {WORDS[o]}"
            for o, n in outcomes.most_common()
            if o not in ("named", "rival", "explained", "located")
        )
        typical = f"{statistics.median(ratios):.2f}" if ratios else ""
        rows.append([key, str(len(group)), str(outright), str(outcomes["rival"]), rest, typical])
    columns = [
        head,
        "recordings",
        "right outright",
        "among the rivals",
        "otherwise",
        "misfit / noise, median",
    ]
    return f"## {title}\n\n" + table(columns, rows)


def _answer(item: Item) -> str:
    if item.result is None:
        return "no result"
    if item.result["verdict"] == "unexplained":
        # An effect named in addition is only the nearest one of the catalogue.
        return "unexplained"
    names = named_effects(item.result)
    return " + ".join(sorted(names)) if names else item.result["verdict"].replace("_", " ")


def _confusion(items: Sequence[Item]) -> str:
    """Truths with the answers that occurred, as lists, because a matrix would be mostly zeros."""
    rows = []
    truths = sorted({_secret(i.truth) for i in items})
    for truth in truths:
        answers = Counter(_answer(i) for i in items if _secret(i.truth) == truth)
        said = ", ".join(
            f"{'**' * (a == truth)}{a}{'**' * (a == truth)} {n}" for a, n in answers.most_common()
        )
        rows.append([truth, str(sum(answers.values())), said])
    return "## Concealed effects and answers\n\nRight answers in bold.\n\n" + table(
        ["concealed", "", "named"], rows
    )


def _secret(truth: Truth) -> str:
    """The truth in the words of `_answer`."""
    if truth.kind == "none":
        return "explained"
    return " + ".join(sorted(truth.effects)) if truth.effects else "unexplained"


def _intervals(items: Sequence[Item]) -> str:
    groups: dict[str, list[bool]] = {}
    for item in items:
        for interval in intervals(item):
            groups.setdefault(interval.parameter, []).append(interval.holds)
    rows = [[f"`{name}`", f"{sum(holds)} of {len(holds)}"] for name, holds in sorted(groups.items())]
    return "## Intervals that hold the truth\n\n" + table(["parameter", ""], rows)


def _failures(items: Sequence[Item]) -> str:
    good = ("named", "rival", "explained", "located")
    rows = [
        [
            item.truth.name,
            _effects_with_strength(item.truth),
            _answer(item),
            WORDS[outcome(item)],
            _reason(item),
        ]
        for item in items
        if outcome(item) not in good
    ]
    title = "## Misses\n\nEach is made again by its seed alone: `make --count 1 --seed SEED DIR`.\n\n"
    if not rows:
        return title + "None.\n"
    return title + table(["seed", "concealed (strength)", "said", "outcome", "what else is known"], rows)


def _effects_with_strength(truth: Truth) -> str:
    parts = [f"{name} ({strength:.0f})" for name, strength in truth.strength.items()]
    return ", ".join(parts) or "nothing"


def _reason(item: Item) -> str:
    """Describe a miss from truth and result."""
    truth, result, parts = item.truth, item.result, []
    parts.append(f"{truth.program}, {', '.join(truth.specimen.amplitude)}, {truth.specimen.law}")
    if truth.look_alikes:
        parts.append(f"look-alikes {', '.join(truth.look_alikes)}")
    if truth.mesh > 1:
        parts.append(f"default mesh off by {truth.mesh:.1f}")
    if result is None:
        run = item.run
        ended = "not run" if run is None else run.how
        last = run.stderr.strip().splitlines()[-1:] if run else []
        return "; ".join([*parts, ended, *(line.replace("|", "/")[:120] for line in last)])
    after = ratio(item)
    if after is not None and math.isfinite(after):
        parts.append(f"misfit {after:.2f} of the noise")
    for hypothesis in result.get("hypotheses") or []:
        if hypothesis["name"] in truth.effects:
            parts.append(
                f"score test of {hypothesis['name']}: z {hypothesis['z']:.0f}"
                if hypothesis["testable"]
                else f"{hypothesis['name']}: {hypothesis['reason']}"
            )
    if rivals(result):
        parts.append("rivals " + " or ".join(" + ".join(sorted(r)) or "none" for r in rivals(result)))
    return "; ".join(parts)


def _times(items: Sequence[Item]) -> str:
    groups: dict[str, list[float]] = {}
    for item in items:
        if item.run is not None:
            groups.setdefault(", ".join(item.truth.specimen.amplitude), []).append(item.run.seconds)
    rows = [
        [key, str(len(s)), f"{statistics.median(s):.0f}", f"{max(s):.0f}", f"{sum(s) / 3600:.2f}"]
        for key, s in sorted(groups.items())
    ]
    making = sum(item.truth.seconds for item in items) / 3600
    total = sum(sum(s) for s in groups.values()) / 3600
    note = f"\nHours of one process: {making:.2f} to make all of them, {total:.2f} to diagnose them.\n"
    columns = ["channels", "recordings", "median, s", "longest, s", "together, h"]
    return "## Time per diagnosis\n\n" + table(columns, rows) + note
