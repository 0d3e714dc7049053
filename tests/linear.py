"""A diagnosis in which every fit is one linear least-squares step and takes no time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import lsq_linear

from bushcli.effects.effect import effect
from bushcli.evidence.prior import known_parameters, scales_of
from bushcli.runtime.workers import Workers
from bushcli.selection import derivatives, neighbours, queue
from bushcli.selection.columns import shear_modulus
from bushcli.selection.model import Fitted
from bushcli.selection.queue import Search
from bushcli.selection.state import State

NAMES = ("permanent_set", "drift", "time_lag", "warming", "viscoelasticity", "friction", "mullins")


class World:
    """A coupon whose stress is that of the plain law plus a column for each amplitude of an effect."""

    def __init__(self, coupon, **truth):
        self.one = coupon("yeoh")
        strain, clock = self.one.strain, self.one.time / self.one.time[-1]
        rng = np.random.default_rng(1)
        shapes = [np.sin(np.pi * k * clock + rng.uniform(0.0, 3.0)) * strain for k in range(1, 30)]
        self.columns, self.median = {}, {}
        for name in NAMES:
            for parameter in effect(name).amplitudes:
                # An amplitude equal to its prior's median changes the stress by some per cent of its range.
                scales = scales_of(self.one.case, 1.0, self.one.recordings)
                size = parameter.prior.median(scales) if parameter.prior else parameter.start
                full = f"{name}.{parameter.name}"
                self.columns[full], self.median[full] = 0.1 * shapes[len(self.columns)] / size, size
        self.unsolved = set()
        # Whether a model with effects is fitted although its fit may change nothing.
        self.always = False
        self.asked = []
        plain = self.one.state.fitted
        recorded = self.one.recordings[0].force
        bent = plain.simulated[0] - sum(a * self.median[n] * self.columns[n] for n, a in truth.items())
        # The simulation lacks the concealed effects; the recording is unchanged.
        self.base = Fitted(plain.model, plain.names, plain.x, (bent,), plain.jacobians, True, 1)
        self.recorded = recorded
        excess = State(self.one.problem, self.base).evidence.left.excess
        whole = self.one.problem.likelihood
        self.problem = replace(self.one.problem, likelihood=replace(whole, plain=tuple(map(float, excess))))
        self.plain = State(self.problem, self.base)

    def derivatives(self, case, base, candidates, known=()):
        assert not known
        return (
            np.array(
                [
                    np.column_stack([self.columns[f"{trial.effect.name}.{n}"] for n in trial.amplitudes])
                    for trial in candidates
                ]
            ),
        )

    def fit(self, case, model, measured, contained=None, least=float("inf"), needed="unsaid"):
        # A law alone always matters; a model with effects may be given up.
        assert needed == "unsaid" or (needed is None) == (self.always or not model.effects)
        self.asked.append(model.structure)
        if set(model.identities) & self.unsolved:
            return None
        held = [
            (f"{one.name}.{p.name}", p) for one in model.effects for p in one.parameters if p.off is not None
        ]
        features = self.problem.likelihood.features[0]
        shear = shear_modulus(model, case)
        priors = known_parameters(case, model.effects, shear, self.one.recordings)
        names = (*self.base.names, *(name for name, _ in held))
        own = self.base.jacobians[0]
        if model.law != self.base.model.law:
            # No other law is of use: it would only have one more parameter.
            return None
        J = np.hstack([own, *(self.columns[name][:, None] for name, _ in held)])
        variance = self.problem.variances[0]
        A = features.whiten(features.of(J), variance)
        z = features.whiten(features.of(self.base.simulated[0] - self.recorded), variance)
        low = np.array([-np.inf] * own.shape[1] + [float(p.lower) for _, p in held])
        step, pulls = np.zeros(len(names)), [0.0] * len(held)
        for _ in range(20):
            pull = np.diag([0.0] * own.shape[1] + pulls)
            whole = np.vstack([A, pull])
            step = lsq_linear(
                whole, -np.concatenate([z, np.zeros(len(names))]), (low, np.inf), method="bvls"
            ).x
            # The weight of each prior at the end of the previous step.
            pulls = [
                (
                    priors[n].prior.curvature(0.5 * p.start, priors[n].scales)
                    if priors[n].prior.is_logarithmic
                    else priors[n].prior.weight(value, priors[n].scales)
                )
                ** 0.5
                for (n, p), value in zip(held, step[own.shape[1] :], strict=True)
            ]
        x = np.concatenate([self.base.x, np.zeros(len(held))]) + step
        return Fitted(
            model.at(dict(zip(names, map(float, x), strict=True))),
            names,
            x,
            (self.base.simulated[0] + J @ step,),
            (J,),
            True,
            3,
        )

    def search(self, monkeypatch, crew=None, deadline=float("inf"), names=NAMES, told=None):
        monkeypatch.setattr(queue, "fit", self.fit)
        monkeypatch.setattr(derivatives, "columns", self.derivatives)
        monkeypatch.setattr(neighbours, "laws", dict)
        catalogue = [effect(name) for name in names]
        made = Search(
            self.problem,
            crew or Workers(1),
            self.plain,
            catalogue,
            False,
            deadline,
            told or (lambda *_: None),
        )
        self.ended = made.run()
        return made
