"""Judge the models of finished diagnoses again with other numbers of effective features.

For each recording of the development deck a diagnosis saves its fitted models (features of the misfit, their
derivatives, priors) and its predictions of others. Their posterior follows for any law m(K) without further
simulations; the score of a law is the logarithm of the right answer's probability, averaged over the recordings.
"""

from __future__ import annotations

import json
import math
import pickle
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.special import logsumexp

import bushcli.diagnosis.diagnose as module
from benchmarks.decks.manifest import Entry, read
from bushcli.case import load_case
from bushcli.effects.names import effect_name
from bushcli.evidence.laplace import Evidence
from bushcli.likelihood.form import Likelihood
from bushcli.selection.neighbourhood import Neighbourhood
from bushcli.selection.predict import Beside
from bushcli.selection.prediction import FAINT, Prediction
from bushcli.selection.queue import Search

Sets = dict[frozenset[str], float]

# Number of effective features as a function of the number of features.
LAWS: Mapping[str, Callable[[int], float]] = {
    "0.43 K^0.8": lambda k: min(0.43 * k**0.8, k),
    "0.7 K^0.8": lambda k: min(0.7 * k**0.8, k),
    "1.0 K^0.8": lambda k: min(k**0.8, k),
    "1.0 K^0.5": lambda k: min(k**0.5, k),
    "1.2 K^0.5": lambda k: min(1.2 * k**0.5, k),
    "1.5 K^0.5": lambda k: min(1.5 * k**0.5, k),
    "2.0 K^0.5": lambda k: min(2.0 * k**0.5, k),
    "2.5 K^0.5": lambda k: min(2.5 * k**0.5, k),
    "2.5 K^0.35": lambda k: min(2.5 * k**0.35, k),
    "7": lambda k: float(min(7, k)),
    "12": lambda k: float(min(12, k)),
}
UNKNOWN, STATED, HELD, FLOOR = "unknown", 0.95, 0.95, 1e-3


class SearchWithMisfits(Search):
    """A search that keeps the misfit that each prediction leaves."""

    last: Search
    left_by_structure: dict[Any, tuple[Any, float]]

    def run(self) -> None:
        """Search, and keep a reference to the finished search."""
        type(self).last = self
        super().run()

    def __post_init__(self) -> None:
        super().__post_init__()
        self.neighbourhood = NeighbourhoodWithMisfits(self)


class NeighbourhoodWithMisfits(Neighbourhood):
    """Predictions whose misfits the search keeps."""

    def queue(self, prediction: Prediction, *others: Any, **more: Any) -> None:
        """Queue a model, and keep the misfit that it is predicted to leave."""
        super().queue(prediction, *others, **more)
        if prediction.model.structure in self._search.waiting:
            left_by_structure = self._search.__dict__.setdefault("left_by_structure", {})
            left_by_structure[prediction.model.structure] = (
                getattr(prediction, "left", None),
                prediction.log_evidence - prediction.log_likelihood,
            )


class BesideWithMisfits(Beside):
    """Predictions with the misfit that the best point of their grid leaves."""

    def _mean_over_grid(self, points: Any, settles: bool = True) -> Prediction:
        average = super()._mean_over_grid(points, settles)
        best = max((self._value(point)[0] for point in points), key=lambda value: value.judgement.log)
        object.__setattr__(average, "left", best.left)
        return average


def keep(case_file: Path, out: Path, budget: float) -> None:
    """Diagnose a recording and save the data with which it can be judged again.

    Parameters
    ----------
    case_file, out : Path
    budget : float
        Seconds.
    """
    with (
        patch.object(module, "Search", SearchWithMisfits),
        patch("bushcli.selection.neighbourhood.Beside", BesideWithMisfits),
    ):
        module.diagnose(load_case(case_file), maps=False, budget=budget)
    search = SearchWithMisfits.last
    fitted = [
        {
            "key": key,
            "effects": state.model.identities,
            "of": (state.misfit, state.slopes, state.fitted.x, state.known, state.off),
            "odds": (search.odds(state.model), search.odds(state.model, unknown=True)),
        }
        for key, state in search.states.items()
    ]
    left = getattr(search, "left_by_structure", {})
    waiting = [
        {
            "effects": queued.model.identities,
            "base": queued.base.model.structure,
            "odds": search.odds(queued.model),
            "silent": queued.is_silent,
            "left": left[key],
        }
        for key, queued in search.waiting.items()
        if queued.is_sure and key in left and left[key][0] is not None
    ]
    data = {"fitted": fitted, "waiting": waiting, "likelihood": search.problem.likelihood}
    out.write_bytes(pickle.dumps(data))


def posterior(data: Mapping[str, Any], law: Callable[[int], float]) -> Sets:
    """Return the probability of each set of effects, `unknown` among them.

    Parameters
    ----------
    data : mapping
        Data that `keep` saved.
    law : callable
        Effective features by the number of features.
    """
    with patch("bushcli.likelihood.form.effective_features", law):
        # A copy, which has not calculated anything with another law.
        likelihood: Likelihood = replace(data["likelihood"])
        states = {model["key"]: (model, Evidence(likelihood, *model["of"])) for model in data["fitted"]}
        weights: dict[frozenset[str], list[float]] = {}

        def add(effects: Any, weight: float, *more: str) -> None:
            weights.setdefault(frozenset(map(effect_name, effects)) | set(more), []).append(weight)

        best = -math.inf
        for key, (model, evidence) in states.items():
            seen = _smallest_equivalent(key, states)
            best = max(best, evidence.log + model["odds"][0], evidence.log_unknown + model["odds"][1])
            add(seen, evidence.log + model["odds"][0])
            add(seen, evidence.log_unknown + model["odds"][1], UNKNOWN)
        for model in data["waiting"]:
            left, occam = model["left"]
            weight = likelihood.judge(left).log + occam + model["odds"]
            if weight < best:
                add(
                    _smallest_equivalent(model["base"], states) if model["silent"] else model["effects"],
                    weight,
                )
    total = float(logsumexp([w for logs in weights.values() for w in logs]))
    return {names: math.exp(float(logsumexp(logs)) - total) for names, logs in weights.items()}


def _smallest_equivalent(key: Any, states: Mapping[Any, tuple[Any, Evidence]]) -> tuple[str, ...]:
    """Return the effects of the smallest model within another that describes the recordings as well."""
    model, evidence = states[key]
    least: tuple[str, ...] = model["effects"]
    for other, (smaller, worse) in states.items():
        more = len(model["effects"]) - len(smaller["effects"])
        if more > 0 and set(other) < set(key) and evidence.judgement.log - worse.judgement.log < FAINT * more:
            least = min(least, smaller["effects"], key=len)
    return least


def table(folder: Path) -> str:
    """Return the laws with their scores.

    Parameters
    ----------
    folder : Path
        Folder with the diagnoses that `keep` saved.
    """
    entries = read("dev")
    diagnoses = {file.stem: pickle.loads(file.read_bytes()) for file in sorted(folder.glob("*.pkl"))}
    lines = [
        f"{len(diagnoses)} recordings of the development deck",
        "",
        "| m | log score | right set in the credible set | a wrong effect stated |",
        "| --- | --- | --- | --- |",
    ]
    for name, law in LAWS.items():
        scores = [_score(posterior(data, law), entries[case]) for case, data in diagnoses.items()]
        mean = np.mean([score for score, _, _ in scores])
        lines.append(f"| {name} | {mean:.3f} | {sum(s[1] for s in scores)} | {sum(s[2] for s in scores)} |")
    return "\n".join(lines)


def _score(sets: Sets, entry: Entry) -> tuple[float, bool, bool]:
    """Log probability of the right answer, whether the credible set has it, and whether a wrong effect is stated."""
    right = {frozenset(names) for names in (entry.truth, *entry.also_right)} if not entry.outside else set()
    if entry.outside and entry.truth:
        right.add(frozenset(entry.truth))

    def is_right(names: frozenset[str]) -> bool:
        return names in right or (entry.outside and UNKNOWN in names)

    credible, held = [], 0.0
    for names, probability in sorted(sets.items(), key=lambda item: -item[1]):
        credible.append(names)
        held += probability
        if held >= HELD:
            break
    effects = {name for names in sets for name in names if name != UNKNOWN}
    stated = {e for e in effects if sum(p for names, p in sets.items() if e in names) >= STATED}
    probability = sum(p for names, p in sets.items() if is_right(names))
    possible = frozenset().union(*right)
    return math.log(max(probability, FLOOR)), any(map(is_right, credible)), bool(stated - possible)


def names_of(folder: Path) -> list[str]:
    """Return the names of the recordings of a deck.

    Parameters
    ----------
    folder : Path
    """
    return [json.loads(file.read_text())["name"] for file in sorted((folder / "truth").glob("*.json"))]
