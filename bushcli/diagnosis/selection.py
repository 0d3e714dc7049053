"""From the plain law to the model that explains the recordings: one effect at a time, while it pays.

Each round screens the whole catalogue to first order beside the model at hand, refits the most promising effects
together with the law, and takes the one with the best BIC, provided it also predicts what it was not fitted to no
worse. Then every earlier effect has to prove itself again. A richer law stands among the candidates, so that physics
is not called for what a law can do. The search ends at the noise, or where nothing pays any more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.casefile import Case
from bushcli.diagnosis.beginnings import PROMISING, pairs, richer, singles
from bushcli.diagnosis.candidates import Trial, candidate, catalogue, columns, trials
from bushcli.diagnosis.criterion import NoiseTest, noise_test
from bushcli.diagnosis.held_out import HeldOut, held_out
from bushcli.diagnosis.model import Fitted, Hope, Model, chi_square, exact, fit, predicted
from bushcli.diagnosis.noise_model import Compared
from bushcli.diagnosis.result import Stage
from bushcli.diagnosis.rivals import STRONG, Combination, forward
from bushcli.diagnosis.score import Candidate, Score, screen
from bushcli.diagnosis.weighing import whitened
from bushcli.diagnosis.workers import Workers
from bushcli.effect import ActiveEffect, Effect, effects, full_name

Array = NDArray[np.float64]
Progress = Callable[[str, str, str], None]
"""Called with the stage, what is looked at, and what came of it."""

# The same of one beside an effect that reaches the noise.
NEAR = 0.5
# Effects in one model, at most.
MOST = 3
# Share of the fall of chi square by an effect from which on another effect had nearly the same, and how many of these
# are refitted in its place beside what was found since. Their start may be worse by such a factor.
NEARLY, RIVALS, WORSE = 0.7, 3, 1.5
# Worse prediction of what was held out than without the effect that is put down to chance: as a factor of the misfit,
# or as a rise of the sum of squares.
NO_WORSE, CHANCE_RISE = 1.05, 6.0
# Beside a misfit that passes for noise an effect is called for only by such a fall of BIC, and refitted only where its
# score test leaves chance less than this, the misfit taken for noise as it is.
OUTSTANDING, CHANCE = 12.0, 1e-4
# Of what effects have taken away of the sum of squares, the share that they may leave because real rubber and real rigs
# follow no equation exactly: 10 % of an effect's curve, which is what the literature accepts of a model. No further
# effect is called for so little.
FORM = 0.01
# Misfit over noise up to which a model counts as having reached the noise, whatever the order of the samples says: what
# the literature accepts of a model is far above it.
AT_NOISE = 1.05


@dataclass
class Selection:
    """What the search has found so far.

    Attributes
    ----------
    plain, best : Fitted
        The plain law, and the model at hand.
    stages : list of (tuple of str, Stage)
        Each with its model's `structure`.
    tables : list of (candidates, scores)
        Of each round, the first beside the plain law.
    refits : dict
        Names of effects (and "law: ...") -> fit, of all models that were refitted.
    combined : tuple of Combination
        Effects and pairs of them to first order beside the plain law.
    held : tuple of HeldOut
    predictions, foretold : dict
        By `structure`, of models fitted without what is held out: misfit over noise on that, and all samples as they
        foretell them.
    """

    plain: Fitted
    best: Fitted
    stages: list[tuple[tuple[str, ...], Stage]] = field(default_factory=list)
    tables: list[tuple[list[Candidate], tuple[Score, ...]]] = field(default_factory=list)
    refits: dict[tuple[str, ...], Fitted] = field(default_factory=dict)
    combined: tuple[Combination, ...] = ()
    held: tuple[HeldOut, ...] = ()
    predictions: dict[tuple[str, ...], float] = field(default_factory=dict)
    foretold: dict[tuple[str, ...], tuple[Compared, ...] | None] = field(default_factory=dict)


def key(model: Model, plain: Model) -> tuple[str, ...]:
    """Name of a model: its effects, and its law where that is not the plain one."""
    names = tuple(sorted(model.names))
    if model.law != plain.law:
        return (f"law: {model.law}", *names)
    return (*names, "law: refitted") if plain.fixed and not model.fixed else names


def structure(model: Model, plain: Model) -> tuple[str, ...]:
    """Name of a model that also tells the number of an effect's branches: with the parameters of its effects."""
    return (*key(model, plain), *(full_name(e.effect, p) for e in model.effects for p in e.parameters))


def at_noise(found: Fitted) -> NoiseTest | None:
    """The test by which the misfit is noise; None where it is not."""
    test = noise_test(found.judged, len(found.x))
    return test if test.is_noise or found.size <= AT_NOISE else None


class Search:
    """The search of one diagnosis.

    Parameters
    ----------
    case
    workers
    names
        Effects to be thought of; None = all.
    progress
    """

    def __init__(self, case: Case, workers: Workers, names: Sequence[str] | None, progress: Progress) -> None:
        self.case, self.workers, self.names, self.progress = case, workers, names, progress
        self._first: dict[tuple[object, ...], tuple[Array, ...]] = {}

    # -- the rounds ----------------------------------------------------------------------------------------------

    def run(self, plain: Fitted) -> Selection:
        """Search from the plain law."""
        found = self._searched(plain)
        if found.best.model.anchor is not None:
            # What is shown in the end is the usual mesh's.
            exact_ = self.workers.run(_exact, [(self.case, found.best)])[0]
            found.best = exact_ or found.best
        return found

    def _searched(self, plain: Fitted) -> Selection:
        found = Selection(plain, plain)
        found.held = tuple(held_out(channel.recording) for channel in plain.channels)
        found.refits[()] = plain
        self._stage(found, "fit", plain, f"{plain.model.law} alone")
        reason = ""
        for _ in range(MOST):
            table, scores = self.screened(found.best)
            found.tables.append((table, scores))
            if len(found.tables) == 1:
                found.combined = forward(found.best.linear, table, 2, inflation=1.0)
            # What passes for noise as a whole may still hold an effect that stands out by itself.
            asked = STRONG if at_noise(found.best) is None else OUTSTANDING
            if asked == OUTSTANDING and not any(_stands_out(one) for one in scores):
                break
            reason = self._extended(found, table, scores, asked)
            if reason:
                break
            self._reduced(found)
            if len(found.best.model.effects) == 2:
                self._exchanged(found, asked)
        self._rivalled(found)
        if not reason:
            done = at_noise(found.best) is not None
            reason = "what is left is noise" if done else "effects enough for one model"
        self._stage(found, "stop", found.best, reason)
        return found

    def screened(self, fitted: Fitted) -> tuple[list[Candidate], tuple[Score, ...]]:
        """The catalogue beside a model, tested to first order."""
        specimen = "coupon" if self.case.geometry.specimen == "coupon" else "bushing"
        asked = [(effect, *trials(self.case, fitted, effect)) for effect in self._catalogue(specimen)]
        questions = [(self.case, fitted, trial) for _, grid, _ in asked for trial in grid]
        labels = [trial for _, grid, _ in asked for trial in grid]

        def told(i: int, answer: object) -> None:
            shape = ", ".join(f"{k} {v:.3g}" for k, v in labels[i].shape.items())
            self.progress(
                "screen", labels[i].effect.name, shape if answer is not None else f"{shape} cannot be solved"
            )

        answers = iter(self.workers.run(_columns, questions, told))
        table = []
        for effect, grid, reason in asked:
            table.append(
                candidate(fitted, effect, grid, [self._known(t, next(answers)) for t in grid], reason)
            )
        return table, screen(fitted.linear, table)

    def _known(self, trial: Trial, found: tuple[Array, ...] | None) -> tuple[Array, ...] | None:
        """The columns of a trial; the first ones known of it where it cannot be solved.

        A law that was fitted beside an effect may not bear the bushing without it.
        """
        what = (trial.effect.name, *trial.amplitudes, *sorted(trial.shape.items()), trial.size)
        if found is not None:
            self._first.setdefault(what, found)
        return self._first.get(what)

    def _catalogue(self, specimen: str) -> list[Effect]:
        return list(catalogue(self.names, effects(), specimen))

    def _extended(
        self, found: Selection, table: Sequence[Candidate], scores: Sequence[Score], asked: float
    ) -> str:
        """Refit the most promising, and take the best; the reason why none was taken, if so."""
        form = _form_error(found)
        asked = max(asked, form)
        beginnings = singles(found.best, table, scores, 0.5 * form)
        poorer, richest = richer(found.best, scores)
        if not beginnings and not poorer and not richest:
            text = "nothing in the catalogue promises more"
            return text + (" than the form of the effects may err" if form else "")
        tried: dict[tuple[str, ...], Fitted] = {}
        first = [model for one in beginnings[:1] for model in one.models]
        self._try(found, tried, [*first, *poorer])
        if any(at_noise(one) is not None for one in tried.values()):
            # What promises less than half of the best is no rival of one that leaves but noise.
            near = [one for one in beginnings[1:] if one.drop > NEAR * beginnings[0].drop]
            self._try(found, tried, [model for one in near for model in one.models])
        else:
            self._try(found, tried, [*(model for one in beginnings[1:] for model in one.models), *richest])
            # Another beginning is for those whose first one has not led to the noise.
            again = [model for one in beginnings for model in one.others]
            names = {name for name, one in tried.items() if at_noise(one) is not None}
            self._try(found, tried, [model for model in again if key(model, found.plain.model) not in names])
        if self._taken(found, tried, asked):
            return ""
        if at_noise(found.best) is None:
            law = found.best.model.law
            begun = [e for one in tried.values() if one.model.law == law for e in one.model.effects]
            two: dict[tuple[str, ...], Fitted] = {}
            if len(found.best.model.effects) + 2 <= MOST:
                alone = max((one.drop for one in scores if one.testable), default=0.0)
                together = [c for c in forward(found.best.linear, table, 2) if c.drop > alone + PROMISING]
                self._try(found, two, pairs(found.best, table, together, begun))
            if self._taken(found, two, asked) or self._exchanged(found, asked):
                return ""
        return "no effect of the catalogue improves the fit enough to be believed"

    def _exchanged(self, found: Selection, asked: float) -> bool:
        """Put a pair of effects in place of those at hand; whether one was better.

        One effect at a time does not find two that act together where a third one stands for part of both. Beside the
        plain law, first order may promise more of the two than the model at hand has brought.
        """
        if at_noise(found.best) is not None:
            return False
        table = found.tables[0][0]
        left = chi_square(found.best.channels, found.plain.used)
        whole = float(found.plain.linear.rest @ found.plain.linear.rest)
        known = {frozenset(one.model.names) for one in found.refits.values()}
        promised = [
            one for one in found.combined if whole - one.drop < left and frozenset(one.names) not in known
        ]
        tried: dict[tuple[str, ...], Fitted] = {}
        self._try(found, tried, pairs(found.plain, table, promised, found.best.model.effects))
        return self._taken(found, tried, asked)

    def _rivalled(self, found: Selection) -> None:
        """Put what nearly explained as much as each effect, when that was taken, beside the effects found since.

        The alternatives to the effect that was taken last have been refitted beside all others already.
        """
        best = found.best
        swapped: dict[frozenset[str], tuple[float, Model]] = {}
        for name in best.model.names if len(best.model.effects) > 1 else ():
            others = frozenset(best.model.names) - {name}
            for fitted in found.refits.values():
                near = self._nearly(found, fitted, name)
                if near is None or others | {near.name} in {
                    frozenset(one.model.names) for one in found.refits.values()
                }:
                    continue
                kept = tuple(one for one in best.model.effects if one.name != name)
                hoped = Hope(WORSE * float(best.linear.misfit @ best.linear.misfit), best.used)
                model = replace(best.model, effects=(*kept, near), hoped=hoped)
                swapped.setdefault(others | {near.name}, (fitted.chi_square, model))
        tried: dict[tuple[str, ...], Fitted] = {}
        self._try(
            found, tried, [model for _, model in sorted(swapped.values(), key=lambda pair: pair[0])][:RIVALS]
        )
        self._taken(found, tried, STRONG)

    def _nearly(self, found: Selection, fitted: Fitted, name: str) -> ActiveEffect | None:
        """The one effect that a fit had in place of another one, if it explained nearly as much there."""
        model, best = fitted.model, found.best.model
        new = [one for one in model.effects if one.name not in best.names]
        if len(new) != 1 or name in model.names or (model.law, model.fixed) != (best.law, best.fixed):
            return None
        kept = [one for one in model.names if one != new[0].name]
        same = [
            one.chi_square
            for one in found.refits.values()
            if sorted(one.model.names) == sorted([*kept, name]) and one.model.law == model.law
        ]
        without = [
            one.chi_square
            for one in found.refits.values()
            if sorted(one.model.names) == sorted(kept) and one.model.law == model.law
        ]
        if not same or not without:
            return None
        fall, wanted = min(without) - fitted.chi_square, min(without) - min(same)
        return new[0] if fall >= NEARLY * wanted else None

    def _taken(self, found: Selection, tried: dict[tuple[str, ...], Fitted], asked: float) -> bool:
        """Take the best of the models tried that also predicts what was held out no worse; whether there was one."""
        found.refits |= {name: one for name, one in tried.items() if _better(one, found.refits.get(name))}
        for one in sorted(tried.values(), key=lambda one: one.bic()):
            gain = found.best.bic() - one.bic()
            if gain < asked:
                break
            before, after = self.prediction(found, found.best), self.prediction(found, one)
            added = _difference(one, found.best)
            if np.isfinite(before) and self._worse(found, before, after):
                text = (
                    f"{added} fits better but predicts what was held out worse "
                    f"({after:.3g} against {before:.3g} of the noise)"
                )
                self._stage(found, "refuse", one, text)
                continue
            found.best = one
            self._stage(found, "add", one, f"{added}: BIC falls by {gain:.4g}")
            return True
        return False

    def _worse(self, found: Selection, before: float, after: float) -> bool:
        """Whether a prediction is worse than another one, by more than chance."""
        samples = sum(
            float(one.samples.sum()) / channel.noise.correlation_time
            for one, channel in zip(found.held, found.plain.channels, strict=True)
        )
        return after > NO_WORSE * before and samples * (after**2 - before**2) > CHANCE_RISE

    def _try(self, found: Selection, tried: dict[tuple[str, ...], Fitted], models: Sequence[Model]) -> None:
        """Refit models, and keep the best of each name."""
        for one in self._fitted(models, found.best.model.law):
            if one is not None and _better(one, tried.get(key(one.model, found.plain.model))):
                tried[key(one.model, found.plain.model)] = one

    def _fitted(self, models: Sequence[Model], law: str) -> list[Fitted | None]:
        """Refit models; another law than the one at hand has to find its scale first."""
        questions = [(self.case, model, model.law != law) for model in models]

        def told(i: int, answer: Fitted | None) -> None:
            label = " + ".join([models[i].law, *models[i].names])
            self.progress(
                "refit",
                label,
                "cannot be solved" if answer is None else f"misfit {answer.size:.3g} of the noise",
            )

        return self.workers.run(_refit, questions, told)

    def _reduced(self, found: Selection) -> None:
        """Leave out, one at a time, every effect that the model no longer needs."""
        while len(found.best.model.effects) > 1:
            model = found.best.model
            models = [
                replace(model, effects=tuple(one for one in model.effects if one.name != name))
                for name in model.names[:-1]
            ]
            fits = [one for one in self._fitted(models, found.best.model.law) if one is not None]
            found.refits |= {
                key(one.model, found.plain.model): one
                for one in fits
                if _better(one, found.refits.get(key(one.model, found.plain.model)))
            }
            better = [one for one in fits if one.bic() <= found.best.bic() + STRONG]
            if not better:
                return
            left = min(better, key=lambda one: one.bic())
            gone = set(model.names) - set(left.model.names)
            found.best = left
            self._stage(found, "drop", left, f"{', '.join(gone)} is not needed any more")

    # -- what was held out ---------------------------------------------------------------------------------------

    def prediction(self, found: Selection, fitted: Fitted) -> float:
        """Root mean square misfit over the noise on samples that the model was not fitted to; NaN without any."""
        name = structure(fitted.model, found.plain.model)
        if name not in found.predictions:
            masks = tuple(one.samples for one in found.held)
            answer = self.workers.run(_predict, [(self.case, fitted.model, masks, fitted.used)])[0]
            found.foretold[name] = answer
            found.predictions[name] = _outside(answer, found.held, fitted.factors)
        return found.predictions[name]

    def _stage(self, found: Selection, action: str, fitted: Fitted, text: str) -> None:
        name = structure(fitted.model, found.plain.model)
        kept = found.predictions.get(name, float("nan"))
        stage = Stage(action, fitted.model.names, fitted.model.law, fitted.bic(), fitted.size, kept, text)  # type: ignore[arg-type]
        found.stages.append((name, stage))
        self.progress(action, " + ".join([fitted.model.law, *fitted.model.names]), text)


def _form_error(found: Selection) -> float:
    """What the effects of the model at hand may leave because their form is not quite that of the real ones."""
    explained = found.plain.chi_square - found.best.chi_square if found.best.model.effects else 0.0
    return max(0.0, FORM * explained)


def _better(one: Fitted, other: Fitted | None) -> bool:
    return other is None or one.chi_square < other.chi_square


def _stands_out(score: Score) -> bool:
    return score.testable and max(score.p, score.p_misfit) < CHANCE and score.drop > OUTSTANDING


def _difference(one: Fitted, other: Fitted) -> str:
    added = [name for name in one.model.names if name not in other.model.names]
    gone = [name for name in other.model.names if name not in one.model.names]
    if added:
        return " and ".join(added) + (f" in place of {' and '.join(gone)}" if gone else "")
    if one.model.law != other.model.law:
        return f"the law {one.model.law} in place of {other.model.law}"
    if other.model.fixed and not one.model.fixed:
        return "the law identified from the recordings"
    return f"one more branch of {', '.join(one.model.names[-1:])}"


def _outside(answer: tuple[Compared, ...] | None, held: Sequence[HeldOut], factors: Sequence[float]) -> float:
    """Misfit over noise on the samples held out."""
    if answer is None:
        return float("nan")
    total, samples = 0.0, 0.0
    for channel, kept, factor in zip(answer, held, factors, strict=True):
        if not kept.samples.any():
            continue
        only = replace(channel, simulated=np.where(kept.samples, channel.simulated, np.nan))
        rows = whitened(np.where(only.known, only.misfit, 0.0), only, factor)
        total, samples = total + float(rows @ rows), samples + only.effective_samples
    return float(np.sqrt(total / samples)) if samples else float("nan")


# -- what is run in other processes -------------------------------------------------------------------------------


def _columns(case: Case, fitted: Fitted, trial: Trial) -> tuple[Array, ...] | None:
    return columns(case, fitted, trial)


def _refit(case: Case, model: Model, rescale: bool) -> Fitted | None:
    return fit(case, model, rescale=rescale)


def _exact(case: Case, fitted: Fitted) -> Fitted | None:
    return exact(case, fitted)


def _predict(
    case: Case, model: Model, masks: tuple[Array, ...], factors: tuple[float, ...]
) -> tuple[Compared, ...] | None:
    """The recordings as a model foretells them that was fitted to what is not masked."""
    if not any(mask.any() for mask in masks):
        return None
    partly = fit(case, model, masks, factors=factors)
    return None if partly is None else predicted(case, partly)
