"""Answers for each recording, one line of JSON each, kept in git so that runs continue on other machines."""

from __future__ import annotations

import fcntl
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "results"
# Largest number of entries kept of lists that can be long, and of characters of stderr.
MODELS, PARTS, TAIL = 30, 12, 600


def file_of(deck: str, label: str, folder: Path = FOLDER) -> Path:
    """Path of the ledger of a deck and a label."""
    return folder / f"{deck}-{label}.jsonl"


def read(deck: str, label: str, folder: Path = FOLDER) -> dict[str, dict[str, Any]]:
    """Lines by recording; a later line replaces an earlier one."""
    file = file_of(deck, label, folder)
    if not file.exists():
        return {}
    lines = [json.loads(line) for line in file.read_text("utf-8").splitlines() if line.strip()]
    return {line["name"]: line for line in lines}


def append(deck: str, label: str, line: Mapping[str, Any], folder: Path = FOLDER) -> None:
    """Append a whole line, even while other processes append theirs."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(line, separators=(",", ":"), allow_nan=True)
    with file_of(deck, label, folder).open("a", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.write(text + "\n")


def compact(
    name: str, result: Mapping[str, Any] | None, *, seconds: float, code: int | None, stderr: str
) -> dict[str, Any]:
    """Make a line from a result.json, old or new, or else from the command's end (code None = out of time)."""
    line: dict[str, Any] = {"name": name, "seconds": round(seconds, 1), "code": code}
    if result is None:
        return line | {"stderr": stderr[-TAIL:]}
    line["verdict"] = result["verdict"]
    line["effects"] = [_effect(effect) for effect in result.get("effects") or []]
    line["rivals"] = [_names(rival) for rival in result.get("rivals") or []]
    line["misfit"] = {key: _round(value) for key, value in (result.get("misfit") or {}).items()}
    line["mismatch"] = _round((result.get("mismatch") or [])[:PARTS])
    for key in ("probability", "groups", "data_faults", "searched", "law"):
        if result.get(key) is not None:
            line[key] = _round(result[key])
    if result.get("models") is not None:
        line["models"] = [_model(model) for model in result["models"][:MODELS]]
    return line


def _effect(effect: Mapping[str, Any]) -> dict[str, Any]:
    keys = ("value", "std", "lower", "upper", "unit")
    parameters = {
        name: {k: _round(said[k]) for k in keys if said.get(k) is not None}
        if isinstance(said, Mapping)
        else said
        for name, said in (effect.get("parameters") or {}).items()
    }
    summary = {"name": effect["name"], "parameters": parameters}
    return summary | {
        k: _round(effect[k]) for k in ("evidence", "channels", "plausible") if effect.get(k) is not None
    }


def _names(rival: Any) -> list[str]:
    """Effects of a rival: a list of names, or a model with them."""
    return sorted(rival["effects"] if isinstance(rival, Mapping) else rival)


def _model(model: Mapping[str, Any]) -> dict[str, Any]:
    effects = [e["name"] if isinstance(e, Mapping) else e for e in model.get("effects") or []]
    return {
        "law": model.get("law"),
        "effects": sorted(effects),
        "probability": _round(model.get("probability")),
    }


def _round(value: Any) -> Any:
    """Round all numbers in nested lists and mappings to six digits."""
    if isinstance(value, bool) or value is None or isinstance(value, (int, str)):
        return value
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, Mapping):
        return {key: _round(item) for key, item in value.items()}
    if isinstance(value, Iterable):
        return [_round(item) for item in value]
    return value
