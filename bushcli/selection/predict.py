"""Predicted evidence of a model with further effects, to first order about a fitted model.

The misfit's features, the derivatives by the fitted parameters and those by the further amplitudes form a linear
least-squares problem with the fit's own weights and priors, in which one-sided amplitudes stay on their side. Its
solution is judged like a fit, so that predictions and fits are on one scale. The evidence is averaged over the grid of
the shape parameters.

References
----------
Silvapulle and Sen (2005), Constrained statistical inference, Wiley, doi:10.1002/9781118165614, chapter 3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.special import logsumexp

from bushcli.evidence.amplitudes import amplitudes
from bushcli.evidence.density import SETTLED
from bushcli.evidence.laplace import Evidence
from bushcli.evidence.stopping_rule import NEGLIGIBLE
from bushcli.selection.columns import shear_modulus
from bushcli.selection.fit import TURNS
from bushcli.selection.law_edge import LawEdge
from bushcli.selection.model import Model
from bushcli.selection.prediction import (
    Addition,
    KnownAmplitudes,
    Prediction,
    known_amplitudes,
    reachable_likelihood,
)
from bushcli.selection.queued import slack_of
from bushcli.selection.state import State
from bushcli.selection.tangent_space import TangentSpace, tangent_space

Array = NDArray[np.float64]

# Points of an effect's grid that are tried in a pair: the best ones. Other values change probabilities by less than
# 0.002 (`benchmarks/constants.md`).
POINTS = 2
# Most rounds in which a prediction is brought within the law's stability: of 1710 in foreign 034 none took over three.
CUTS = 8
# Its square, as a share of the square of an effect's change of the curves, is added to the diagonal of the normal
# equations, so that an amplitude that the fitted parameters imitate stays finite: 1e-12, far above the rounding of the
# sums (2e-16) and far below any change that is visible.
DAMPING = 1e-6
# Points of a grid whose evidence is less than this share of the best point's do not change the mean. It changes by
# less than 1 % with each.
SMALL = 0.01
# Pieces of the cubic splines in the displacement that stand for any law, whose force is a smooth function of it.
# Other values change probabilities by less than 0.002 (`benchmarks/constants.md`).
PIECES = 6


class Beside:
    """First-order predictions about a fitted model."""

    def __init__(
        self,
        state: State,
        additions: Sequence[Addition],
        variances: Sequence[float] | None = None,
        before: Beside | None = None,
    ) -> None:
        self.state = state
        self._known: dict[Addition, KnownAmplitudes] = {} if before is None else before._known
        self.variances = state.problem.variances if variances is None else variances
        self.edge: LawEdge = LawEdge(state, self._own_optimum) if before is None else before.edge
        grouped: dict[str, list[Addition]] = {}
        for addition in additions:
            # Each value of a mesh dimension is a separate model, as is a variant; times and gaps are averaged over.
            active = addition.trial.active
            fixed = [f"{p.name}={active.values[p.name]:g}" for p in active.parameters if p.of_mesh]
            variants = [p.name for p in active.parameters if p.variant]
            grouped.setdefault(" ".join([active.identity, *fixed, *variants]), []).append(addition)
        self.grouped = grouped
        self._solutions: dict[tuple[Addition, ...], tuple[Evidence, Array]] = {}
        self._settled: dict[tuple[Addition, ...], tuple[Evidence, Array]] = {}
        self._own_columns: dict[Addition, tuple[Array, Array]] = {}
        # What was predicted before serves where the same additions are predicted with the same variances.
        if before is not None and list(before.variances) == list(self.variances):
            self._solutions, self._settled = before._solutions, before._settled
            self._own_columns = before._own_columns

    # -- predictions ---------------------------------------------------------------------------------------------

    def singles(
        self, least: float = -math.inf, slack: Callable[[float], float] = slack_of
    ) -> list[Prediction]:
        """Return predictions with one more effect.

        Parameters
        ----------
        least : float
            Log evidence that matters. Variances settle where a fit may reach it.
        slack : callable
            Possible error of a prediction, in nats, by its reach.
        """
        grids = [[(addition,) for addition in points] for points in self.grouped.values()]
        predictions = [self._mean_over_grid(points, settles=False) for points in grids]
        most = [one.log_evidence + slack(one.reach) + one.hope for one in predictions]
        gained = max(self._value(())[0].log - self._solve_amplitudes(())[0].log, 0.0)
        for i in sorted(range(len(grids)), key=lambda i: -most[i]):
            # The lower the misfit, the more is gained where the variances settle: most in the best effects.
            if most[i] + gained < least:
                break
            one = predictions[i] = self._mean_over_grid(grids[i])
            gained = max(gained, one.log_evidence + slack(one.reach) + one.hope - most[i])
        return predictions

    def alone(self) -> Prediction:
        """Return the prediction for the model itself, with its parameters at their first-order optimum."""
        evidence = self._value(())[0]
        return Prediction(self.state.model, evidence.log, 0.0, evidence.judgement.log, 0.0)

    def pairs(self) -> list[Prediction]:
        """Return predictions with two more effects, each at the best points of its grid.

        A variant of one of them is predicted beside the fit of the other.
        """
        best = {
            name: [
                addition
                for _, addition in sorted(
                    ((-self._value((addition,))[0].log, i), addition) for i, addition in enumerate(points)
                )[:POINTS]
            ]
            for name, points in self.grouped.items()
            if not any(p.variant for p in points[0].trial.active.parameters)
        }
        top = max((self._value((points[0],))[0].log for points in best.values()), default=-np.inf)
        names = [
            (a, b)
            for a, b in combinations(best, 2)
            if not best[a][0].trial.active.is_among([best[b][0].trial.active])
        ]
        roughly = [self._solve_amplitudes((best[a][0], best[b][0]))[0] for a, b in names]
        most = [self._most_evidence(evidence) for evidence in roughly]
        predictions, gained = dict[int, Prediction](), 0.0
        for i in sorted(range(len(names)), key=lambda i: -most[i]):
            a, b = names[i]
            points = list(product(best[a], best[b]))
            # The lower the misfit, the more is gained where the variances settle: most in the best pairs.
            settles = most[i] + gained > top + math.log(NEGLIGIBLE)
            predictions[i] = self._mean_over_grid(points[:1], settles)
            if not settles:
                continue
            evidence = self._value(points[0])[0]
            top = max(top, predictions[i].log_evidence)
            gained = max(gained, self._most_evidence(evidence) - most[i])
            # Where the pair cannot matter at the best points of both, its other points are not evaluated.
            if self._most_evidence(evidence) > top + math.log(NEGLIGIBLE):
                predictions[i] = self._mean_over_grid(points)
        return [predictions[i] for i in range(len(names))]

    def _most_evidence(self, evidence: Evidence) -> float:
        """Log evidence that a fit of a model may find, given the evidence to first order."""
        return evidence.log + slack_of(evidence.coarse - self.coarse_likelihood)

    def changes(self, addition: Addition) -> tuple[Array, Array]:
        """Return sizes (k,) of the change by each amplitude of an addition, and of what the fit cannot make of it."""
        G = self._weighted_features(addition.slopes)
        return np.linalg.norm(G, axis=0), np.linalg.norm(self._tangent.left(G), axis=0)

    def any_law(self, has_more: bool) -> float:
        """Log evidence of the model if its law could remove all misfit that is a function of the displacement.

        Parameters
        ----------
        has_more : bool
            Whether the other law has more parameters.
        """
        features = self.state.problem.likelihood.features
        blocks = []
        for i, (recording, feature) in enumerate(zip(self.state.problem.recordings, features, strict=True)):
            q = recording.displacement
            low, high = float(q.min()), float(q.max())
            splines = np.ones((len(q), 1))
            if high > low:
                knots = np.concatenate([[low] * 3, np.linspace(low, high, PIECES + 1), [high] * 3])
                splines = BSpline.design_matrix(q, knots, 3).toarray()
            # Of a table a law changes the stiffness at each preload, by a factor.
            simulated = self.state.fitted.simulated[i][:, None]
            own = feature.of(splines if recording.kind == "static" else simulated * splines)
            if recording.kind == "dynamic" and high == low:
                # About one preload all laws are one modulus.
                own = own[:, :0]
            blocks.append(
                [own if i == j else np.zeros((f.count, own.shape[1])) for j, f in enumerate(features)]
            )
        G = self._weighted_features([np.hstack([b[j] for b in blocks]) for j in range(len(features))])
        u, s, _ = np.linalg.svd(self._tangent.left(G), full_matrices=False)
        # What the law's own parameters change is rounding.
        u = u[:, s > 1e-8 * max(float(np.linalg.norm(G)), 1e-300)]
        rest = self._rest - u @ (u.T @ self._rest)
        likelihood, evidence = self.state.problem.likelihood, self.state.evidence
        left = likelihood.left(self._split(rest))
        # Each spline also absorbs one unit of noise.
        across = np.minimum(left.across + u.shape[1] / len(features), evidence.left.across)
        less = replace(left, across=across, excess=left.excess + across - left.across)
        gain = likelihood.judge(less).log - evidence.judgement.log
        variance = float(np.mean(evidence.judgement.scale))
        explained = float(np.maximum(evidence.left.excess - less.excess, 0.0).sum())
        # A further parameter changes the force by what it explains at least: the prior admits that, and the recordings
        # determine it.
        return evidence.log + gain - (0.5 * math.log(1.0 + explained / variance) if has_more else 0.0)

    # -- the linear problem --------------------------------------------------------------------------------------

    def _weighted_features(self, parts: Sequence[Array]) -> Array:
        """Features (K,) or (K, k) of all channels with the weights of the fit, then the priors' rows, all zero."""
        problem = self.state.problem
        rows = [
            feature.whiten(part, v)
            for feature, part, v in zip(problem.likelihood.features, parts, self.variances, strict=True)
        ]
        rows.append(np.zeros((len(self.state.fitted.x), *parts[0].shape[1:])))
        return np.concatenate(rows)

    @cached_property
    def _whole(self) -> tuple[Array, Array]:
        """Weighted misfit (rows,) and derivatives (rows, p), the priors' rows last."""
        state = self.state
        p = len(state.fitted.x)
        misfit, slopes = self._weighted_features(state.misfit), self._weighted_features(state.slopes)
        rows = [
            (0.0, 0.0) if prior is None else prior.row(float(value))
            for prior, value in zip(state.parameter_priors, state.fitted.x, strict=True)
        ]
        if p:
            misfit[-p:] = [row for row, _ in rows]
            slopes[-p:] = np.diag([slope for _, slope in rows])
        return misfit, slopes

    @cached_property
    def _tangent(self) -> TangentSpace:
        """The changes that the fitted parameters can make within their bounds."""
        misfit, slopes = self._whole
        x = self.state.fitted.x
        held, values = self.state.held_parameters(misfit, slopes)
        return tangent_space(misfit, slopes, ~held, values - x, x)

    @property
    def _own_optimum(self) -> Array:
        """Parameters (p,) of the model itself to first order; where its fit has converged, those of the fit."""
        return self._tangent.optimum(np.zeros(len(self._tangent.rest)))

    @cached_property
    def _rest(self) -> Array:
        return self._tangent.left(self._tangent.rest)

    def _split(self, rows: Array) -> list[Array]:
        """Return the features of each channel, cut from the weighted rows of all."""
        features, start = [], 0
        for feature, v in zip(self.state.problem.likelihood.features, self.variances, strict=True):
            features.append(feature.colour(rows[start : start + feature.count], v))
            start += feature.count
        return features

    def _mean_over_grid(self, points: Sequence[tuple[Addition, ...]], settles: bool = True) -> Prediction:
        """The mean of the evidence over points of a grid, and the model at the best of them.

        ``settles``: whether their variances are brought to those of the misfit that is left.
        """
        solutions = [self._solve_amplitudes(point) for point in points]
        top, gained = -np.inf, 0.0
        for i in sorted(range(len(points)), key=lambda i: -solutions[i][0].log) if settles else ():
            # The lower the misfit, the more is gained where the variances settle: most at the best points.
            if solutions[i][0].log + gained < top + math.log(SMALL):
                break
            before = solutions[i][0].log
            solutions[i] = self._value(points[i])
            top, gained = max(top, solutions[i][0].log), max(gained, solutions[i][0].log - before)
        best = int(np.argmax([evidence.log for evidence, _ in solutions]))
        log = float(logsumexp([evidence.log for evidence, _ in solutions])) - math.log(len(solutions))
        most = max(evidence.judgement.log for evidence, _ in solutions)
        coarse = max(evidence.coarse for evidence, _ in solutions)
        model = self._model(points[best], solutions[best][1])
        reach, hope = coarse - self.coarse_likelihood, 0.0
        if len(points[best]) == 1:
            # Pairs are predicted again beside the fit of one of their effects.
            evidence = solutions[best][0]
            hope = reachable_likelihood(evidence.likelihood, self._value(())[0].left, evidence.left) - most
        return Prediction(model, log, most - self._value(())[0].judgement.log, most, reach, max(hope, 0.0))

    @cached_property
    def coarse_likelihood(self) -> float:
        """`Likelihood.coarse` of the model itself, at its first-order optimum."""
        return self._value(())[0].coarse

    def _value(self, point: tuple[Addition, ...]) -> tuple[Evidence, Array]:
        """Return evidence and amplitudes after alternating between the solution and its variances, as a fit does."""
        if point in self._settled:
            return self._settled[point]
        evidence, amplitude = self._solve_amplitudes(point)
        for _ in range(TURNS):
            scale = evidence.judgement.scale
            if max(max(a / b, b / a) for a, b in zip(scale, self.variances, strict=True)) < SETTLED:
                break
            again, other = Beside(self.state, (), scale, self)._solve_amplitudes(point)
            if again.log <= evidence.log:
                break
            evidence, amplitude = again, other
        self._settled[point] = evidence, amplitude
        return evidence, amplitude

    def _solve_amplitudes(self, point: tuple[Addition, ...]) -> tuple[Evidence, Array]:
        """Evidence to first order with the variances at hand, and the amplitudes, within the law's stability."""
        if point not in self._solutions:
            self._solutions[point] = self._solution(point)
        return self._solutions[point]

    def _columns(self, addition: Addition) -> tuple[Array, Array]:
        """Weighted features (rows, k) of an addition, and what the fitted parameters cannot make of them."""
        if addition not in self._own_columns:
            G = self._weighted_features(addition.slopes)
            self._own_columns[addition] = G, self._tangent.left(G)
        return self._own_columns[addition]

    def _solution(self, point: tuple[Addition, ...]) -> tuple[Evidence, Array]:
        raw = [
            np.hstack([np.zeros((len(z), 0)), *(addition.slopes[c] for addition in point)])
            for c, z in enumerate(self.state.misfit)
        ]
        none = np.zeros((len(self._rest), 0))
        G, own = (
            (np.hstack([none, *parts]) for parts in zip(*map(self._columns, point), strict=True))
            if point
            else (none, none)
        )
        parts = [self._known_amplitudes_of(addition) for addition in point]
        known = [prior for part in parts for prior in part.known]
        start, low, high = (
            np.concatenate([np.zeros(0), *(getattr(part, what) for part in parts)])
            for what in ("start", "low", "high")
        )
        at, misfit = self._tangent, self._rest
        active: tuple[int, ...] = ()
        for _ in range(CUTS):
            gram = own.T @ own
            gram[np.diag_indices(len(gram))] += DAMPING**2 * np.sum(G**2, axis=0) + 1e-300
            amplitude = amplitudes(gram, -(own.T @ misfit), known, start, (low, high))
            further = G @ amplitude
            beyond = self.edge.cut_off(at.optimum(further))
            if not beyond and not active:
                break
            # Where bounds hold parameters the law is stable.
            cuts = self.edge.cuts.after(self._tangent.values - self.state.fitted.x)
            held = self._tangent.active(cuts, further)
            if held == active:
                break
            at, active = self._tangent.within(cuts.only(held)) if held else self._tangent, held
            own, misfit = at.left(G), at.left(at.rest)
        slopes = [np.hstack([J, part]) for J, part in zip(self.state.slopes, raw, strict=True)]
        evidence = Evidence(
            self.state.problem.likelihood,
            self._split(misfit + own @ amplitude),
            slopes,
            np.concatenate([at.values, start + amplitude]),
            [*self.state.parameter_priors, *known],
            [*self.state.off_values, *start],
            self.state.evidence,
        )
        return evidence, amplitude

    def _known_amplitudes_of(self, addition: Addition) -> KnownAmplitudes:
        """Priors, off values and bounds of an addition, computed once for all predictions beside the model."""
        if addition not in self._known:
            problem = self.state.problem
            self._known[addition] = known_amplitudes(
                addition, problem.case, self._shear_modulus, problem.sound_recordings
            )
        return self._known[addition]

    @cached_property
    def _shear_modulus(self) -> float:
        return shear_modulus(self.state.model, self.state.problem.case)

    def _model(self, point: tuple[Addition, ...], amplitude: Array) -> Model:
        """The model with the effects at their first-order amplitudes, 0.3 of the prior's median if these are off."""
        model, i = self.state.model, 0
        for addition in point:
            own = self._known_amplitudes_of(addition)
            values: dict[str, float] = dict(addition.trial.active.values)
            for name, prior, off in zip(addition.trial.amplitudes, own.known, own.start, strict=True):
                value = float(off + amplitude[i])
                if value == off and prior is not None:
                    value = float(off + 0.3 * prior.prior.median(prior.scales))
                values[name] = value
                i += 1
            active = replace(addition.trial.active, values=values).with_start_values()
            model = replace(addition.trial, active=active).add_to(model)
        if model.anchor is None:
            # Bodies with memory are compared on a coarse mesh, whose error is known for the law alone.
            model = replace(model, anchor=dict(self.state.model.start))
        return model
