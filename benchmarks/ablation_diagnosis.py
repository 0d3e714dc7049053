"""What each mechanism of the search of `bushcli diagnose` is worth: recordings are diagnosed with one off at a time.

::

    setup/enter python benchmarks/ablation_diagnosis.py run RESULTS.jsonl FOLDER ... [--only WORD|WORD] [--limit 900]
    setup/enter python benchmarks/ablation_diagnosis.py table RESULTS.jsonl ...

`run` appends a line for each FOLDER (DECK/cases/NUMBER, with a ``case.toml``) and mechanism, and continues where it
stopped. A mechanism that did not act in the usual diagnosis of a folder cannot change it, and is not switched off. The
whole catalogue, one process; neither maps nor the next test are calculated. `table` prints a table of
benchmarks/ablation.md, with mechanisms that have been deleted since.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bushcli.case import load_case
from bushcli.diagnosis import diagnose as diagnosing
from bushcli.diagnosis.aftermath import Extras
from bushcli.evidence import stopping_rule
from bushcli.evidence.density import Posterior
from bushcli.inverse.channel import FollowedChannel, SweptChannel
from bushcli.inverse.local import HeldBack, Hopeless
from bushcli.selection import fit, queue
from bushcli.selection.law_edge import LawEdge
from bushcli.selection.neighbourhood import Neighbourhood

HEADS = (
    "without",
    "acts in",
    "other verdict",
    "probability changes by",
    "misfit grows by",
    "marches",
    "processor time",
)
USUAL = "-"


@dataclass(frozen=True)
class Mechanism:
    """A mechanism of the search.

    Attributes
    ----------
    changes : list
        Patches that take it out.
    owner, method : object, str
        The function that shows whether it acts; none where it always does.
    acts : callable
        What the function returned, and was given -> whether it acted.
    """

    changes: list[Any]
    owner: Any = None
    method: str = ""
    acts: Callable[..., bool] = lambda result, *given: bool(result)


def mechanisms() -> dict[str, Mechanism]:
    """Return the mechanisms by name."""
    plain_queue = Neighbourhood.queue

    def hopeless(near: Any, prediction: Any, *given: Any, **named: Any) -> None:
        plain_queue(near, replace(prediction, hope=0.0), *given, **named)

    ends = stopping_rule.StoppingRule, "ends"
    return {
        "predictions within the law's stability": Mechanism(
            [patch.object(LawEdge, "cut_off", lambda self, x: False)], LawEdge, "cut_off"
        ),
        "fits that cannot matter are given up": Mechanism(
            [patch.object(queue, "needed_of", lambda *given: None)],
            *ends,
            lambda end, *given: isinstance(end, Hopeless),
        ),
        "end before a minimum is confirmed": Mechanism([patch.object(stopping_rule, "NOTHING", 0.0)]),
        "variances before the minimum": Mechanism([patch.object(stopping_rule, "ROUGH", 1e-9)]),
        "held back by stability, along the edge": Mechanism(
            [patch.object(stopping_rule, "LEAST_RATIO", 0.0)],
            *ends,
            lambda end, *given: isinstance(end, HeldBack),
        ),
        "own start of the law where a fit is stuck": Mechanism(
            [patch.object(fit._End, "is_stuck", property(lambda self: False))],
            fit,
            "_own_law_start",
            lambda own, *given: own is not None,
        ),
        "again from a contained model": Mechanism(
            [patch.object(fit, "WORSE", 1e9)], Posterior, "lift_limits", lambda *given: True
        ),
        # Defaults, bound when the function was defined: of `failed_steps` and `variances`.
        "marches are given up": Mechanism([patch.object(fit.pose, "__defaults__", (None, None))]),
        "what a fit may find in addition": Mechanism([patch.object(Neighbourhood, "queue", hopeless)]),
        "one effect more beside a poor one": Mechanism(
            [patch.object(Neighbourhood, "queue_borrowed", lambda *given: None)]
        ),
        "others in place of an effect": Mechanism(
            [patch.object(Neighbourhood, "queue_without", lambda *given: None)]
        ),
        "reliable predictions count": Mechanism(
            [patch.object(queue.Search, "counted_models", property(lambda self: []))]
        ),
        "the answer fitted to its end": Mechanism(
            [patch.object(diagnosing, "closest_model", lambda search, state: state)]
        ),
    }


class TookTooLong(Exception):
    """The processor time allowed is over."""


def diagnosis_outcome(folder: Path, watched: dict[str, Mechanism], limit: float) -> dict[str, Any]:
    """Return verdict, probabilities, misfit (%, summed over channels), marches, processor seconds and what acted."""
    marches, acted = 0, {name for name, mechanism in watched.items() if not mechanism.method}

    def counting(solve: Any) -> Any:
        def counting_solve(*given: Any, **named: Any) -> Any:
            nonlocal marches
            marches += 1
            return solve(*given, **named)

        return counting_solve

    def watching(name: str, mechanism: Mechanism) -> Any:
        plain = getattr(mechanism.owner, mechanism.method)

        def watched_function(*given: Any, **named: Any) -> Any:
            result = plain(*given, **named)
            if mechanism.acts(result, *given):
                acted.add(name)
            return result

        return patch.object(mechanism.owner, mechanism.method, watched_function)

    def stop(*given: Any) -> None:
        raise TookTooLong

    signal.signal(signal.SIGPROF, stop)
    outcome: dict[str, Any] = {}
    with ExitStack() as stack:
        stack.enter_context(patch.object(Extras, "make", lambda *given: None))
        for kind in (FollowedChannel, SweptChannel):
            stack.enter_context(patch.object(kind, "solve", counting(kind.solve)))
        for name, mechanism in watched.items():
            if mechanism.method:
                stack.enter_context(watching(name, mechanism))
        begin = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, limit)
        try:
            diagnosis = diagnosing.diagnose(load_case(folder / "case.toml", []), maps=False)
        except TookTooLong:
            outcome = {"verdict": "none in time", "probability": {}, "misfit": 0.0}
        else:
            misfit = sum(channel.after_percent for channel in diagnosis.channels)
            likely = {key: round(value, 4) for key, value in diagnosis.probability.items()}
            outcome = {"verdict": diagnosis.verdict, "probability": likely, "misfit": misfit}
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        seconds = time.process_time() - begin
    return outcome | {"marches": marches, "seconds": round(seconds, 1), "acted": sorted(acted)}


def run(results: Path, folders: list[Path], only: str, limit: float) -> None:
    """Append what each diagnosis answers."""
    lines = [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []
    known = {(line["recording"], line["without"]): line for line in lines}

    def outcome(folder: Path, without: str, watched: dict[str, Mechanism]) -> dict[str, Any]:
        name = f"{folder.parts[-3]} {folder.name}"
        if (name, without) not in known:
            line = {"recording": name, "without": without} | diagnosis_outcome(folder, watched, limit)
            known[name, without] = line
            with results.open("a") as file:
                file.write(json.dumps(line) + "\n")
        return known[name, without]

    every = mechanisms()
    for folder in folders:
        usual = outcome(folder, USUAL, every)
        for name in usual["acted"]:
            if any(word in name for word in only.split("|")):
                with ExitStack() as stack:
                    for change in every[name].changes:
                        stack.enter_context(change)
                    outcome(folder, name, {})


def table(lines: list[dict[str, Any]]) -> None:
    """Print what changes without each mechanism, where it acts."""
    usual = {line["recording"]: line for line in lines if line["without"] == USUAL}
    print("| " + " | ".join(HEADS) + " |\n|" + " --- |" * len(HEADS))
    for name in dict.fromkeys(line["without"] for line in lines if line["without"] != USUAL):
        pairs = [(line, usual[line["recording"]]) for line in lines if line["without"] == name]
        verdicts = sum(new["verdict"] != old["verdict"] for new, old in pairs)
        change = max(
            abs(new["probability"].get(key, 0.0) - old["probability"].get(key, 0.0))
            for new, old in pairs
            for key in new["probability"] | old["probability"]
        )
        grown = max(new["misfit"] / max(old["misfit"], 1e-9) for new, old in pairs) - 1.0
        marches, seconds = (
            sum(new[key] for new, _ in pairs) / sum(old[key] for _, old in pairs)
            for key in ("marches", "seconds")
        )
        skipped = sum(name not in line["acted"] for line in usual.values())
        print(
            f"| {name} | {len(pairs)} of {len(pairs) + skipped} | {verdicts} | {change:.3f} | {100 * grown:.0f} % "
            f"| {marches:.2f} | {seconds:.2f} |"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run")
    running.add_argument("results", type=Path)
    running.add_argument("folders", nargs="+", type=Path)
    running.add_argument(
        "--only", default="", help="mechanisms whose names contain one of these words: WORD|WORD"
    )
    running.add_argument("--limit", default=900.0, type=float, help="processor time of a diagnosis, s")
    commands.add_parser("table").add_argument("results", nargs="+", type=Path)
    given = parser.parse_args()
    if given.command == "run":
        run(given.results, given.folders, given.only, given.limit)
    else:
        table([json.loads(line) for path in given.results for line in path.read_text().splitlines()])
