"""Size of the error of form, and its number of effective features.

`python -m benchmarks.form measure DIR` and `... table`; `... keep DIR --to FOLDER` and `... again FOLDER`.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp

HERE = Path(__file__).parent
RESULTS = HERE / "results.jsonl"
# Excess below this (in units of the features' noise) is only an upper bound of the error of form.
SEEN = 2.0
# Share of the misfit (root mean square) below which a channel enters the second summary of phi.
MOST = 0.5
NODES = np.linspace(-3.0, 3.0, 25)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.form", description=__doc__)
    parser.add_argument("work", choices=["measure", "table", "keep", "again"])
    parser.add_argument(
        "folder", nargs="?", type=Path, help="of the development deck (benchmarks.decks make dev)"
    )
    parser.add_argument("--only", nargs="*", default=None, help="numbers of recordings")
    parser.add_argument("--to", type=Path, help="folder for the diagnoses that `again` judges")
    parser.add_argument("--budget", type=float, default=300.0, help="seconds of each diagnosis")
    chosen = parser.parse_args()
    if chosen.work == "keep":
        keep(chosen.folder, chosen.to, chosen.only, chosen.budget)
        return
    if chosen.work == "again":
        from benchmarks.form.again import table as judged_again

        print(judged_again(chosen.folder))
        return
    if chosen.work == "measure":
        measure(chosen.folder, chosen.only)
    print(table([json.loads(line) for line in RESULTS.read_text().splitlines()]))


def keep(folder: Path, to: Path, only: list[str] | None, budget: float) -> None:
    """Diagnose the recordings whose diagnosis has not been kept yet."""
    from benchmarks.form import again

    to.mkdir(parents=True, exist_ok=True)
    for name in again.names_of(folder):
        if (to / f"{name}.pkl").exists() or (only is not None and name not in only):
            continue
        again.keep(folder / "cases" / name / "case.toml", to / f"{name}.pkl", budget)
        print(name, flush=True)


def measure(folder: Path, only: list[str] | None) -> None:
    """Add the recordings that the results do not contain yet."""
    from benchmarks.form.measure import excess_by_channel

    there = (
        {json.loads(line)["name"] for line in RESULTS.read_text().splitlines()} if RESULTS.exists() else set()
    )
    for file in sorted((folder / "truth").glob("*.json")):
        truth = json.loads(file.read_text())
        name = truth["name"]
        if name in there or truth["outside"] or (only is not None and name not in only):
            continue
        if truth["part"] == "own" and truth["kind"] != "none":
            continue
        case = folder / "cases" / name / "case.toml"
        try:
            result = excess_by_channel(case, tuple(truth["truth"]))
        except (RuntimeError, ValueError, ArithmeticError) as error:
            result = {"failed": repr(error)}
        row = {
            "name": name,
            "truth": truth["truth"],
            "formulas": [formula["name"] for formula in truth["formulas"]],
            **(result or {"failed": "cannot be solved"}),
        }
        with RESULTS.open("a") as out:
            out.write(json.dumps(row) + "\n")
        print(name, row["truth"], row["formulas"], row.get("failed", ""), flush=True)


def table(rows: list[dict[str, Any]]) -> str:
    """The results as a table, and the constants of the likelihood that follow from them."""
    lines = [
        "| recording | formula | effects | channel | r/D | effective features |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    shares: list[tuple[float, float, float]] = []
    laws: list[tuple[float, float, float]] = []
    effective: list[float] = []
    for row in rows:
        if "failed" in row:
            lines.append(
                f"| {row['name']} | {', '.join(row['formulas'])} | {', '.join(row['truth'])} | | {row['failed']} | |"
            )
            continue
        whole = _squares_to_explain(np.maximum(row["plain"], 0.0), np.array(row["signal"]))
        for i, channel in enumerate(row["names"]):
            left, plain = max(row["left"][i], 0.0), float(whole[i])
            noise = SEEN * np.sqrt(2.0 * row["features"][i])
            if not row["truth"]:
                laws.append((left, row["signal"][i], row["features"][i]))
                continue
            if plain <= 4.0 * noise:
                continue
            shares.append((left, plain, row["features"][i]))
            seen = left > noise
            if seen:
                effective.append(row["effective"][i])
            ratio = np.sqrt(max(left, noise) / plain)
            lines.append(
                f"{_first_cells(row)} {channel} | {'' if seen else '< '}{ratio:.3f} | {row['effective'][i]:.1f} |"
            )
    if shares:
        below = [share for share in shares if share[0] < MOST**2 * share[1]]
        lines += ["", _summary("phi", shares), _summary("phi below a half", below)]
    if effective:
        middle = float(np.median(effective))
        lines.append(
            f"effective features where something is left: median {middle:.1f} ({len(effective)} channels)"
        )
    if laws:
        lines.append(_summary("lambda", laws))
    return "\n".join(lines)


def _squares_to_explain(plain: np.ndarray, signal: np.ndarray) -> np.ndarray:
    """Misfit of each channel that an effect has to explain, as in `Likelihood.explained_squares`."""
    return 0.5 * plain + 0.5 * float(plain.sum() / signal.sum()) * signal


def _first_cells(row: dict[str, Any]) -> str:
    return f"| {row['name']} | {', '.join(row['formulas'])} | {', '.join(row['truth'])} |"


def _summary(name: str, rows: list[tuple[float, float, float]]) -> str:
    median, spread = _population(rows)
    return f"{name}: median {median:.5f}, standard deviation of the logarithm {spread:.2f} ({len(rows)} channels)"


def _population(rows: list[tuple[float, float, float]]) -> tuple[float, float]:
    """Median and spread of a log-normal share, by maximum likelihood over channels.

    The excess is phi^2 D, plus noise of K features with variance 2 K.
    """

    def cost(x: np.ndarray) -> float:
        share = np.exp(np.clip(x[0] + np.exp(x[1]) * NODES, -20.0, 3.0))
        total = 0.0
        for left, whole, count in rows:
            # In addition to the noise the squared share scatters, because its features are few (taken as twelve).
            mean = share**2 * whole
            variance = 2.0 * count + 2.0 / 12.0 * mean**2 + 4.0 * mean
            log = -0.5 * np.log(variance) - 0.5 * (left - mean) ** 2 / variance
            total -= float(logsumexp(log - 0.5 * NODES**2))
        return total + 0.5 * float(x[1]) ** 2 * 0.1

    fit = min(
        (minimize(cost, [np.log(a), np.log(0.5)], method="Nelder-Mead") for a in (0.3, 0.1, 0.03, 0.003)),
        key=lambda fit: fit.fun,
    )
    return float(np.exp(fit.x[0])), float(np.exp(fit.x[1]))


if __name__ == "__main__":
    main()
