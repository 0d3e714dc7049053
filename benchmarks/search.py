"""How wrong first-order predictions are in one search, and how far fits of a search tell the errors of others.

``setup/enter python benchmarks/search.py errors DIR CASE...`` diagnoses cases of the development deck and appends the
error of every prediction whose model was fitted to ``search-errors.jsonl`` (minutes per case);
``setup/enter python benchmarks/search.py measure`` prints the log likelihood of these errors for scales of
`bushcli.selection.prediction_errors` (seconds). Results: ``benchmarks/README.md``.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.stats import multivariate_normal, multivariate_t

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import bushcli.diagnosis.diagnose as module  # noqa: E402
from bushcli.case import load_case  # noqa: E402
from bushcli.selection.prediction_errors import MOST, Changes, PredictionErrors  # noqa: E402
from bushcli.selection.queue import Search  # noqa: E402

RESULTS = Path(__file__).with_name("search-errors.jsonl")
# Scales of the errors that all predictions share, of those of a change, and of own ones.
SCALES = (0.0, 0.1, 0.2, 0.3, 0.5), (0.0, 0.1, 0.2, 0.3, 0.4), (0.1, 0.2, 0.3, 0.4, 0.6)
# None: Gaussian errors of one known scale.
FREEDOMS = (None, 1.0, 2.0, 3.0, 5.0, 10.0)

SearchErrors = list[tuple[Changes, float]]
"""Changes and error, in slacks, of each fit of one search."""


class ErrorLog(PredictionErrors):
    """Errors that are also written down."""

    case = ""

    def add(self, changed: Changes, error: float, slack: float) -> None:
        """Note an error, and append it to the file."""
        super().add(changed, error, slack)
        if changed and slack > 0.0 and math.isfinite(error):
            line = {"case": self.case, "changes": sorted(changed), "error": error, "slack": slack}
            with RESULTS.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")


def errors(folder: Path, names: Sequence[str]) -> None:
    """Diagnose cases, and write the errors of their predictions down."""

    class LoggedSearch(Search):
        """A search whose errors are written down."""

        def __post_init__(self) -> None:
            self.waiting.errors = ErrorLog()
            super().__post_init__()

    for name in names:
        ErrorLog.case = name
        with patch.object(module, "Search", LoggedSearch):
            module.diagnose(load_case(folder / name / "case.toml"), maps=False)


def read() -> list[SearchErrors]:
    """Return the errors by search."""
    by_case: dict[str, SearchErrors] = {}
    for text in RESULTS.read_text(encoding="utf-8").splitlines():
        line: dict[str, Any] = json.loads(text)
        size = float(np.clip(line["error"] / line["slack"], -MOST, MOST))
        by_case.setdefault(line["case"], []).append((frozenset(line["changes"]), size))
    return list(by_case.values())


def likelihood(
    searches: Sequence[SearchErrors], common: float, of_change: float, own: float, freedom: float | None
) -> float:
    """Log likelihood of the errors of all searches."""
    total = 0.0
    for search_errors in searches:
        sizes = np.array([size for _, size in search_errors])
        covariance = np.array(
            [[common**2 + of_change**2 * len(a & b) for a, _ in search_errors] for b, _ in search_errors]
        )
        covariance += own**2 * np.eye(len(search_errors))
        if freedom is None:
            total += float(multivariate_normal.logpdf(sizes, np.zeros(len(search_errors)), covariance))
        else:
            total += float(multivariate_t.logpdf(sizes, np.zeros(len(search_errors)), covariance, df=freedom))
    return total


def measure() -> Iterator[str]:
    """Yield the best scales for each number of degrees of freedom, with and without what fits tell of others."""
    searches = read()
    yield f"{sum(map(len, searches))} errors in {len(searches)} searches"
    yield "| degrees of freedom | common | of a change | own | ln likelihood | the best without shared errors |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for freedom in FREEDOMS:
        candidates = [(likelihood(searches, *scales, freedom), scales) for scales in product(*SCALES)]
        (best, scales), alone = max(candidates), max(log for log, (c, d, _) in candidates if c == d == 0.0)
        name = "Gaussian" if freedom is None else f"{freedom:g}"
        yield f"| {name} | {scales[0]:g} | {scales[1]:g} | {scales[2]:g} | {best:.1f} | {alone:.1f} |"


if __name__ == "__main__":
    if sys.argv[1:2] == ["errors"]:
        errors(Path(sys.argv[2]), sys.argv[3:])
    else:
        print("\n".join(measure()))
