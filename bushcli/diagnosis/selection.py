"""From the plain law to the model that explains the recordings: one effect at a time, while it pays.

Each round screens the whole catalogue to first order beside the model at hand, refits the most promising effects
together with the law, and takes the one with the best BIC, provided it also predicts what it was not fitted to no
worse. Then every earlier effect has to prove itself again. A richer law stands among the candidates, so that physics
is not called for what a law can do. The search ends at the noise, or where nothing pays any more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bushcli.casefile import Case
from bushcli.diagnosis import alternatives
from bushcli.diagnosis.beginnings import PROMISING, pairs, richer, singles
from bushcli.diagnosis.candidates import Trial, candidate, catalogue, columns, grids, unfit
from bushcli.diagnosis.held_out import HeldOut, held_out
from bushcli.diagnosis.model import Fitted, Model, exact, fit, predicted
from bushcli.diagnosis.noise_model import Compared
from bushcli.diagnosis.result import Stage
from bushcli.diagnosis.rivals import STRONG, combine
from bushcli.diagnosis.score import Candidate, Score, screen
from bushcli.diagnosis.selected import (
    Round,
    Selection,
    at_noise,
    form_error,
    key,
    least_promise,
    most_gain,
    structure,
)
from bushcli.diagnosis.weighing import whitened
from bushcli.diagnosis.workers import Workers
from bushcli.effect import Effect, effect_name, effects, spoken

Array = NDArray[np.float64]
Progress = Callable[[str, str, str], None]
"""Called with the stage, what is looked at, and what came of it."""

# An effect is refitted beside one that reaches the noise if it promises such a share of what that one does.
NEAR = 0.5
# Effects in one model, at most.
MOST = 3
# Worse prediction of what was held out than without the effect that is put down to chance: as a factor of the misfit,
# or as a rise of the sum of squares.
NO_WORSE, CHANCE_RISE = 1.05, 6.0
# Beside a misfit that passes for noise an effect is called for only by such a fall of BIC, and refitted only where its
# score test leaves chance less than this, the misfit taken for noise as it is.
OUTSTANDING, CHANCE = 12.0, 1e-4


class Search:
    """The search of one diagnosis.

    Parameters
    ----------
    case
    workers
    names
        Effects to be thought of; None = all.
    progress

    Attributes
    ----------
    forward_solves, failed_solves : int
        Of all refits: simulations of a channel, and evaluations that failed.
    """

    def __init__(self, case: Case, workers: Workers, names: Sequence[str] | None, progress: Progress) -> None:
        self.case, self.workers, self.names, self.progress = case, workers, names, progress
        self.forward_solves = self.failed_solves = 0
        self._first: dict[tuple[object, ...], tuple[Array, ...]] = {}

    # -- the rounds ----------------------------------------------------------------------------------------------

    def run(self, plain: Fitted) -> Selection:
        """Search from the plain law."""
        found = self._searched(plain)
        if found.best.model.anchor is not None:
            # What is shown in the end is the usual mesh's.
            exact_ = self.workers.run(_exact, [(self.case, found.best)])[0]
            found.rough, found.best = found.best, exact_ or found.best
        return found

    def _searched(self, plain: Fitted) -> Selection:
        found = Selection(plain, plain)
        found.held = tuple(held_out(channel.recording) for channel in plain.channels)
        found.refits[()] = plain
        self.forward_solves, self.failed_solves = plain.solves, plain.failed
        self._stage(found, "fit", plain, f"{plain.model.law} alone")
        reason = ""
        for _ in range(MOST):
            table, scores = self.screened(found.best)
            found.rounds.append(Round(found.best, table, scores))
            if len(found.rounds) == 1:
                found.combined = combine(found.best.linear, table)
            # What passes for noise as a whole may still hold an effect that stands out by itself.
            asked = STRONG if at_noise(found.best) is None else OUTSTANDING
            if asked == OUTSTANDING and not any(_stands_out(one) for one in scores):
                break
            reason = self._extended(found, table, scores, asked)
            if reason:
                break
            self._reduced(found)
            # What takes the place of a pair may itself be a step on the way.
            for _ in range(MOST):
                if len(found.best.model.effects) != 2 or not alternatives.reconsidered(self, found, asked):
                    break
                self._reduced(found, again=False)
        alternatives.rivalled(self, found)
        # What came in by pairs, or in place of another one, has not been left out yet.
        self._reduced(found, again=False)
        if not reason:
            reason = (
                "what is left is noise" if at_noise(found.best) is not None else f"a search has {MOST} rounds"
            )
        self._stage(found, "stop", found.best, reason)
        return found

    def screened(self, fitted: Fitted) -> tuple[list[Candidate], tuple[Score, ...]]:
        """The catalogue beside a model, tested to first order."""
        specimen = "coupon" if self.case.geometry.specimen == "coupon" else "bushing"
        asked = [(e, grid) for e in self._catalogue(specimen) for grid in grids(self.case, fitted, e)]
        labels = [trial for _, grid in asked for trial in grid.trials]
        questions = [(self.case, fitted, trial) for trial in labels]

        def told(i: int, answer: object) -> None:
            point = (f"{k} {v:.3g}" for k, v in labels[i].shape.items())
            shape = ", ".join((*point, *(labels[i].active.channels or ())))
            self.progress(
                "screen", labels[i].effect.name, shape if answer is not None else f"{shape} cannot be solved"
            )

        answers = iter(self.workers.run(_columns, questions, told))
        table = []
        for effect, grid in asked:
            found = [self._known(trial, next(answers)) for trial in grid.trials]
            table.append(candidate(fitted, effect, grid, found))
        return table, screen(fitted.linear, table)

    def _known(self, trial: Trial, found: tuple[Array, ...] | None) -> tuple[Array, ...] | None:
        """The columns of a trial; the first ones known of it where it cannot be solved.

        A law that was fitted beside an effect may not bear the bushing without it.
        """
        shape = sorted(trial.shape.items())
        what = (trial.effect.name, *trial.amplitudes, *shape, trial.size, trial.active.channels)
        if found is None:
            return self._first.get(what)
        self._first.setdefault(what, found)
        return found

    def _catalogue(self, specimen: str) -> list[Effect]:
        return list(catalogue(self.names, effects(), specimen))

    def _extended(
        self, found: Selection, table: Sequence[Candidate], scores: Sequence[Score], asked: float
    ) -> str:
        """Refit the most promising, and take the best; the reason why none was taken, if so."""
        form = form_error(found)
        asked = max(asked, form)
        # Beside a misfit that passes for noise, which may be overestimated, no such bound is known.
        if at_noise(found.best) is None and most_gain(found.best) < form:
            return "what is left is no more than the form of the effects may err"
        least = least_promise(found)
        beginnings = singles(found.best, table, scores, least)
        poorer, richest = richer(found.best, scores, self.case.geometry.specimen == "coupon")
        if not beginnings and not poorer and not richest:
            text = "nothing in the catalogue promises more"
            return text + (" than the form of the effects may err" if least else "")
        tried: dict[tuple[str, ...], Fitted] = {}
        first = [model for one in beginnings[:1] for model in one.models]
        self.refit(found, tried, [*first, *poorer])
        if any(at_noise(one) is not None for one in tried.values()):
            # What promises less than half of the best is no rival of one that leaves but noise.
            near = [one for one in beginnings[1:] if one.drop > NEAR * beginnings[0].drop]
            self.refit(found, tried, [model for one in near for model in one.models])
        else:
            self.refit(found, tried, [*(model for one in beginnings[1:] for model in one.models), *richest])
            # Another beginning is for those whose first one has not led to the noise.
            again = [model for one in beginnings for model in one.others]
            names = {name for name, one in tried.items() if at_noise(one) is not None}
            self.refit(found, tried, [model for model in again if key(model, found.plain.model) not in names])
        if self.take(found, tried, asked):
            return ""
        if at_noise(found.best) is None:
            law = found.best.model.law
            begun = [e for one in tried.values() if one.model.law == law for e in one.model.effects]
            two: dict[tuple[str, ...], Fitted] = {}
            if len(found.best.model.effects) + 2 <= MOST:
                alone = max((one.drop for one in scores if one.testable), default=0.0)
                together = [
                    one
                    for one in combine(found.best.linear, table)
                    if one.drop > alone + PROMISING
                    and self.is_possible((*found.best.model.names, *one.names))
                ]
                self.refit(found, two, pairs(found.best, table, together, begun))
            if self.take(found, two, asked) or alternatives.reconsidered(self, found, asked):
                return ""
        if len(set(map(effect_name, found.best.model.names))) == MOST:
            return "effects enough for one model"
        return "no effect of the catalogue improves the fit enough to be believed"

    def take(self, found: Selection, tried: dict[tuple[str, ...], Fitted], asked: float) -> bool:
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
            fall = (
                f"falls by {gain:.4g}"
                if gain >= 0
                else f"rises by {-gain:.4g}, but its values are of real size"
            )
            self._stage(found, "add", one, f"{added}: BIC {fall}")
            return True
        return False

    def _worse(self, found: Selection, before: float, after: float) -> bool:
        """Whether a prediction is worse than another one, by more than chance."""
        samples = sum(
            float(one.samples.sum()) / channel.noise.correlation_time
            for one, channel in zip(found.held, found.plain.channels, strict=True)
        )
        return after > NO_WORSE * before and samples * (after**2 - before**2) > CHANCE_RISE

    def refit(self, found: Selection, tried: dict[tuple[str, ...], Fitted], models: Sequence[Model]) -> None:
        """Refit models, and keep the best of each name; those that cannot be are left out."""
        possible = [model for model in models if self.is_possible(model.names)]
        for one in self._fitted(possible, found.best.model.law):
            if one is not None and _better(one, tried.get(key(one.model, found.plain.model))):
                tried[key(one.model, found.plain.model)] = one

    def is_possible(self, names: Sequence[str]) -> bool:
        """Whether one model can have these effects."""
        return len(set(map(effect_name, names))) <= MOST and not unfit(self.case, names)

    def _fitted(self, models: Sequence[Model], law: str) -> list[Fitted | None]:
        """Refit models; another law than the one at hand has to find its scale first."""
        questions = [(self.case, model, model.law != law) for model in models]

        def told(i: int, answer: Fitted | None) -> None:
            self.progress(
                "refit",
                _label(models[i]),
                "cannot be solved" if answer is None else f"misfit {answer.size:.3g} of the noise",
            )

        answers = self.workers.run(_refit, questions, told)
        self.forward_solves += sum(one.solves for one in answers if one is not None)
        self.failed_solves += sum(one.failed for one in answers if one is not None)
        return answers

    def _reduced(self, found: Selection, again: bool = True) -> None:
        """Leave out, one at a time, every effect that the model does not need.

        Parameters
        ----------
        again
            Also where the model without it has been fitted before, from other start values; but for the effect that
            came last.
        """
        while found.best.model.effects:
            model = found.best.model
            models = [
                less
                for name in model.names
                if key(less := model.without(name), found.plain.model) not in found.refits
                or (again and name != model.names[-1])
            ]
            fits = [one for one in self._fitted(models, found.best.model.law) if one is not None]
            found.refits |= {
                key(one.model, found.plain.model): one
                for one in fits
                if _better(one, found.refits.get(key(one.model, found.plain.model)))
            }
            # A law of coupons is not set free for its own sake.
            able = [one for one in fits if one.model.effects or one.model.fixed == found.plain.model.fixed]
            better = [one for one in able if one.bic() <= found.best.bic() + STRONG]
            if not better:
                return
            left = min(better, key=lambda one: one.bic())
            gone = set(model.identities) - set(left.model.identities)
            found.best = left
            self._stage(found, "drop", left, f"{', '.join(map(spoken, sorted(gone)))} is not needed any more")

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
        stage = Stage(
            action,  # type: ignore[arg-type]
            fitted.model.identities,
            fitted.model.law,
            fitted.bic(),
            fitted.size,
            kept,
            text,
        )
        found.stages.append((name, stage))
        self.progress(action, _label(fitted.model), text)


def _better(one: Fitted, other: Fitted | None) -> bool:
    # Of one name they may differ in their number of parameters: terms of a law, branches of an effect.
    return other is None or one.bic() < other.bic()


def _stands_out(score: Score) -> bool:
    return score.testable and max(score.p, score.p_misfit) < CHANCE and score.drop > OUTSTANDING


def _label(model: Model) -> str:
    return " + ".join([model.law, *map(spoken, model.identities)])


def _difference(one: Fitted, other: Fitted) -> str:
    new, old = one.model.identities, other.model.identities
    added, gone = [name for name in new if name not in old], [name for name in old if name not in new]
    if added:
        instead = f" in place of {' and '.join(map(spoken, gone))}" if gone else ""
        return " and ".join(map(spoken, added)) + instead
    if one.model.law != other.model.law:
        return f"the law {one.model.law} in place of {other.model.law}"
    if other.model.fixed and not one.model.fixed:
        return "the law identified from the recordings"
    return f"one more branch of {', '.join(map(spoken, one.model.names[-1:]))}"


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
