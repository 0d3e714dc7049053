"""What each mechanism of the search of `bushcli diagnose` is worth: recordings are diagnosed with one off at a time.

``setup/enter python benchmarks/ablation_diagnosis.py FOLDER ... [--only WORD|WORD]`` prints a table of
benchmarks/ablation.md. Each FOLDER has a ``case.toml``. The whole catalogue, one process; neither maps nor the next
test are calculated, and the answer is refitted only where that is what is off.
"""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bushcli.case import load_case
from bushcli.diagnosis import diagnose as diagnosing
from bushcli.diagnosis.aftermath import Extras
from bushcli.evidence import stopping_rule
from bushcli.inverse.channel import FollowedChannel, SweptChannel
from bushcli.selection import fit, queue
from bushcli.selection.law_edge import LawEdge
from bushcli.selection.prediction_errors import NONE, PredictionErrors

HEADS = (
    "without",
    "recordings",
    "other verdict",
    "probability changes by",
    "misfit grows by",
    "marches",
    "processor time",
)


def patches() -> dict[str, list[Any]]:
    """Return what takes each mechanism out, by name."""
    plain_queue = queue.Search._queue

    def hopeless(search: Any, prediction: Any, *given: Any, **named: Any) -> None:
        plain_queue(search, replace(prediction, hope=0.0), *given, **named)

    never = property(lambda self: False)
    return {
        "-": [],
        "errors learned from fits": [
            patch.object(PredictionErrors, "expected_error", lambda self, changed: NONE)
        ],
        "predictions within the law's stability": [patch.object(LawEdge, "cut_off", lambda self, x: False)],
        "begin at a finite size": [
            patch.object(queue.Search, "_start_beside_effects", lambda self, queued: None)
        ],
        "fits that cannot matter are given up": [patch.object(queue, "needed_of", lambda *given: None)],
        "end before a minimum is confirmed": [patch.object(stopping_rule, "NOTHING", 0.0)],
        "variances before the minimum": [patch.object(stopping_rule, "ROUGH", 1e-9)],
        "held back by stability, along the edge": [patch.object(stopping_rule, "LEAST_RATIO", 0.0)],
        "own start of the law where a fit is stuck": [patch.object(fit._End, "is_stuck", never)],
        "again from a contained model": [patch.object(fit, "WORSE", 1e9)],
        "smaller sizes where a start fails": [patch.object(fit, "RETREATS", ())],
        # Defaults, bound when the function was defined: of `failed_steps` and `variances`.
        "marches are given up": [patch.object(fit.pose, "__defaults__", (None, None))],
        "what a fit may find in addition": [patch.object(queue.Search, "_queue", hopeless)],
        "one effect more beside a poor one": [
            patch.object(queue.Search, "_queue_with_one_more", lambda *given: None)
        ],
        "one branch more beside a poor one": [patch.object(queue, "more_branches", lambda *given: [])],
        "others in place of an effect": [patch.object(queue.Search, "_expand_without", lambda *given: None)],
        "reliable predictions count": [
            patch.object(queue.Search, "counted_models", property(lambda self: []))
        ],
        "the answer fitted to its end": [
            patch.object(diagnosing, "closest_model", lambda search, state: state)
        ],
    }


def diagnosis_outcome(folder: Path) -> tuple[str, dict[str, float], float, int, float]:
    """Return verdict, probabilities, misfit (%, summed over channels), marches and processor seconds."""
    marches = 0

    def count_calls(solve: Any) -> Any:
        def counting_solve(*given: Any, **named: Any) -> Any:
            nonlocal marches
            marches += 1
            return solve(*given, **named)

        return counting_solve

    with ExitStack() as stack:
        for kind in (FollowedChannel, SweptChannel):
            stack.enter_context(patch.object(kind, "solve", count_calls(kind.solve)))
        begin = time.process_time()
        diagnosis = diagnosing.diagnose(load_case(folder / "case.toml", []), maps=False)
        seconds = time.process_time() - begin
    misfit = sum(channel.after_percent for channel in diagnosis.channels)
    return diagnosis.verdict, dict(diagnosis.probability), misfit, marches, seconds


def row(name: str, results: list[tuple[Any, ...]], usual: list[tuple[Any, ...]]) -> str:
    """Return a row of the table: what changes without a mechanism."""
    pairs = list(zip(results, usual, strict=True))
    verdicts = sum(new[0] != old[0] for new, old in pairs)
    change = max(
        max(abs(new[1].get(key, 0.0) - value) for key, value in old[1].items()) for new, old in pairs
    )
    grown = max(new[2] / max(old[2], 1e-9) for new, old in pairs) - 1.0
    marches, seconds = (sum(new[i] for new, _ in pairs) / sum(old[i] for _, old in pairs) for i in (3, 4))
    return (
        f"| {name} | {len(results)} | {verdicts} | {change:.3f} | {100 * grown:.0f} % | {marches:.2f} "
        f"| {seconds:.2f} |"
    )


def main(folders: list[Path], only: str) -> None:
    """Print the table."""
    usual: dict[Path, tuple[Any, ...]] = {}
    with patch.object(Extras, "make", lambda *given: None):
        print("| " + " | ".join(HEADS) + " |\n|" + " --- |" * len(HEADS))
        for name, changes in patches().items():
            if name != "-" and not any(word in name for word in only.split("|")):
                continue
            with ExitStack() as stack:
                for change in changes:
                    stack.enter_context(change)
                results = {}
                for folder in folders:
                    results[folder] = diagnosis_outcome(folder)
                    verdict, chances, *rest = results[folder]
                    likely = {k: round(v, 3) for k, v in chances.items() if v > 0.02}
                    print(f"{name} | {folder.name}: {verdict} {likely} {rest}", file=sys.stderr, flush=True)
            usual = usual or results
            print(row(name, list(results.values()), list(usual.values())), flush=True)


if __name__ == "__main__":
    given = sys.argv[1:]
    word = given.pop(given.index("--only") + 1) if "--only" in given else ""
    main([Path(argument) for argument in given if argument != "--only"], word)
