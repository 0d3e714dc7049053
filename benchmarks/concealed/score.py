"""Compare the concealed effects with the answers; `report.RULES` states the rules in words."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from benchmarks.concealed.run import Run, read_run
from benchmarks.concealed.truth import Truth, read_truth

Outcome = Literal[
    "named",
    "rival",
    "extra",
    "part",
    "other",
    "missed",
    "law_too_poor",
    "unexplained",
    "explained",
    "false_alarm",
    "located",
    "not_located",
    "no_result",
]
Result = Mapping[str, Any]

REACHED, HALF = 1.3, 0.5
NORMAL = 1.959964


@dataclass(frozen=True)
class Item:
    """A recording: its truth, the result (None where there is none) and how the diagnosis went (None = not yet)."""

    truth: Truth
    result: Result | None
    run: Run | None


@dataclass(frozen=True)
class Count:
    """A number of successes among a number of trials."""

    good: int
    all: int

    @property
    def share(self) -> float:
        """Share of successes; NaN without trials."""
        return self.good / self.all if self.all else math.nan

    def wilson(self, z: float = NORMAL) -> tuple[float, float]:
        """95 % interval of the share.

        References
        ----------
        Wilson (1927), J. Am. Stat. Assoc. 22:209-212, doi:10.1080/01621459.1927.10502953.
        """
        if not self.all:
            return 0.0, 1.0
        n, p = self.all, self.share
        middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
        half = z / (1 + z**2 / n) * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
        return max(0.0, middle - half), min(1.0, middle + half)


def read(folder: Path) -> list[Item]:
    """All recordings of a folder whose diagnosis has ended, by name."""
    items = []
    for file in sorted((folder / "truth").glob("*.json")):
        results = folder / "results" / file.stem
        if not (results / "run.json").exists():
            continue
        result = results / "result.json"
        items.append(
            Item(
                read_truth(file),
                json.loads(result.read_text("utf-8")) if result.exists() else None,
                read_run(results / "run.json"),
            )
        )
    return items


def undiagnosed_truths(folder: Path) -> list[Truth]:
    """Truths of recordings that have been made and not diagnosed."""
    files = sorted((folder / "truth").glob("*.json"))
    return [read_truth(file) for file in files if not (folder / "results" / file.stem / "run.json").exists()]


def named_effects(result: Result) -> frozenset[str]:
    """Return the effects that a result names."""
    return frozenset(effect["name"] for effect in result["effects"])


def rivals(result: Result) -> list[frozenset[str]]:
    """Return the sets of effects that a result considers equally possible."""
    return [frozenset(names) for names in result.get("rivals") or []]


def outcome(item: Item) -> Outcome:
    """Return the outcome of a recording, in one word."""
    truth, result = item.truth, item.result
    if result is None:
        return "no_result"
    names, concealed = named_effects(result), frozenset(truth.effects)
    if truth.kind == "outside":
        return (
            "located" if result["verdict"] == "unexplained" and is_located(truth, result) else "not_located"
        )
    if truth.kind == "none":
        return "explained" if result["verdict"] == "explained" and not names else "false_alarm"
    if names == concealed:
        return "named"
    if concealed in rivals(result):
        return "rival"
    if result["verdict"] in ("law_too_poor", "unexplained"):
        return "law_too_poor" if result["verdict"] == "law_too_poor" else "unexplained"
    if not names:
        return "missed"
    if names > concealed:
        return "extra"
    return "part" if names & concealed else "other"


def is_located(truth: Truth, result: Result) -> bool:
    """Whether most of the located misfit lies where the step puts it.

    The stiffness falls at the cycle `step`: a law fitted to all cycles is too soft before it and too stiff afterwards.
    A part that extends across the step, or that is too high or too low, does not count as right.
    """
    step, right, total = int(truth.step["cycle"]), 0.0, 0.0
    for part in result["mismatch"]:
        first, last = part["cycle"]
        total += part["share"]
        before, after = last < step, first >= step
        if (before and part["sign"] == "too_soft") or (after and part["sign"] == "too_stiff"):
            right += part["share"]
    return total > 0 and right > HALF * total


def ratio(item: Item) -> float | None:
    """Largest misfit after the diagnosis, over all channels, relative to the added noise."""
    if item.result is None:
        return None
    after = item.result["misfit"]["after"]
    return max(float(after[name]) / noise for name, noise in item.truth.noise.items())


def held_out(item: Item) -> bool | None:
    """Whether held-out samples are met better than by the plain law; None where nothing was held out."""
    if item.result is None:
        return None
    misfit, noise = item.result["misfit"], item.truth.noise
    before, after = (
        [(misfit[key][n], noise[n]) for n in noise if misfit[key].get(n) is not None]
        for key in ("held_out_before", "held_out_after")
    )
    if not before or not after:
        return None
    return bool(sum((m / s) ** 2 for m, s in after) < sum((m / s) ** 2 for m, s in before))


@dataclass(frozen=True)
class Interval:
    """A true parameter and the interval stated for it."""

    recording: str
    parameter: str
    truth: float
    lower: float
    upper: float

    @property
    def holds(self) -> bool:
        """Whether the truth is inside."""
        return self.lower <= self.truth <= self.upper


def intervals(item: Item) -> list[Interval]:
    """Intervals of the effects' parameters, where exactly the true effects are named; fixed values are left out."""
    if item.result is None or outcome(item) != "named" or not item.truth.effects:
        return []
    effect_intervals = []
    for effect in item.result["effects"]:
        for name, truth in item.truth.effects[effect["name"]].items():
            parameter = effect["parameters"].get(name)
            if parameter is None or not parameter.get("std"):
                continue
            lower, upper = parameter.get("lower"), parameter.get("upper")
            lower = parameter["value"] - NORMAL * parameter["std"] if lower is None else lower
            upper = parameter["value"] + NORMAL * parameter["std"] if upper is None else upper
            effect_intervals.append(
                Interval(item.truth.name, f"{effect['name']}.{name}", truth, lower, upper)
            )
    return effect_intervals


@dataclass(frozen=True)
class Target:
    """A line of the table of scores: what is counted, among which recordings, and the share to reach."""

    text: str
    count: Count
    least: float | None = None
    most: float | None = None

    @property
    def is_reached(self) -> bool | None:
        """Whether the target is reached; None where there is no target, or nothing was counted."""
        if not self.count.all or (self.least is None and self.most is None):
            return None
        if self.least is not None:
            return self.count.share >= self.least
        return self.most is not None and self.count.share <= self.most


def tellable(truth: Truth) -> bool:
    """Whether the recordings can distinguish the effect from every other one, by `Truth.look_alikes`."""
    return truth.rich and not truth.look_alikes


def targets(items: Sequence[Item]) -> list[Target]:
    """Return all scores."""
    concealed = [i for i in items if i.truth.kind in ("single", "pair")]
    nothing = [i for i in items if i.truth.kind == "none"]
    outside = [i for i in items if i.truth.kind == "outside"]
    known = [i for i in items if i.truth.kind != "outside"]
    reached = [ratio(i) for i in known]
    better = [held_out(i) for i in concealed if i.result is not None and named_effects(i.result)]
    inside = [interval for i in concealed for interval in intervals(i)]
    return [
        Target("right physics named, or among the rivals", _count(concealed, _right), least=0.95),
        Target(
            "named outright, rich program that can tell",
            _count([i for i in concealed if tellable(i.truth)], _outright),
            least=0.90,
        ),
        Target(
            "named outright, all rich programs", _count([i for i in concealed if i.truth.rich], _outright)
        ),
        Target(
            "rivals listed, the truth among them, where there are look-alikes",
            _count([i for i in concealed if i.truth.look_alikes], _among_rivals),
        ),
        Target(
            "an effect, or no explanation, where nothing is concealed", _count(nothing, _alarm), most=0.05
        ),
        Target(
            f"misfit after at most {REACHED:g} times the noise",
            Count(sum(r is not None and r <= REACHED for r in reached), len(reached)),
            least=0.90,
        ),
        Target(
            "held-out misfit improved, where effects are named",
            Count(sum(b is True for b in better), sum(b is not None for b in better)),
            least=0.95,
        ),
        Target(
            "true parameter inside its 95 % interval",
            Count(sum(i.holds for i in inside), len(inside)),
            least=0.85,
        ),
        Target("effect outside the catalogue unexplained, and located", _count(outside, _is_located)),
    ]


def _count(items: Sequence[Item], good: Callable[[Item], bool]) -> Count:
    return Count(sum(map(good, items)), len(items))


def _right(item: Item) -> bool:
    return outcome(item) in ("named", "rival")


def _outright(item: Item) -> bool:
    return outcome(item) == "named"


def _among_rivals(item: Item) -> bool:
    sets = [] if item.result is None else rivals(item.result)
    return len(set(sets)) > 1 and frozenset(item.truth.effects) in sets


def _alarm(item: Item) -> bool:
    return outcome(item) != "explained"


def _is_located(item: Item) -> bool:
    return outcome(item) == "located"
