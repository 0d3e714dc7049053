"""A coupon with a recording in closed form, and the problem that a diagnosis poses for it: no mesh, no long march."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.diagnosis.question import pose_problem
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.recording import read_recording
from bushcli.runtime.workers import Workers
from bushcli.selection.fit import FittedSamples, fit
from bushcli.selection.model import Model
from bushcli.selection.model_cache import ModelCache
from bushcli.selection.plain import first_plain_fit, fit_plain
from bushcli.selection.state import State

# MPa; a soft filled rubber.
C10, C20 = 0.5, -0.02
TEXT = """
[geometry]
shape = "coupon"
[material]
law = "{law}"
[[recordings]]
mode = "uniaxial"
file = "uniaxial.csv"
"""


def cycles(peaks=(0.3, 0.3, 0.6, 0.6), per_way=20, rate=0.02):
    """Time (s) and strain of cycles from zero."""
    q, t = [0.0], [0.0]
    for end in [e for peak in peaks for e in (peak, 0.0)]:
        way = np.linspace(q[-1], end, per_way + 1)[1:]
        t += list(t[-1] + np.abs(way - q[-1]) / rate)
        q += list(way)
    return np.array(t), np.array(q)


def stress(strain, set_=0.0):
    """Nominal stress of an incompressible Yeoh rubber with permanent set, in closed form (Treloar 1975, eq. 4.25)."""
    farthest = np.maximum.accumulate(np.maximum(strain, 0.0))
    stretch = 1.0 + strain - set_ * farthest
    i1 = stretch**2 + 2.0 / stretch - 3.0
    return 2.0 * (stretch - stretch**-2) * (C10 + 2.0 * C20 * i1)


class Coupon:
    """A uniaxial coupon and the problem of its diagnosis."""

    def __init__(self, folder, law, set_, noise, seed):
        self.time, self.strain = cycles()
        force = stress(self.strain, set_)
        sigma = noise * np.ptp(force)
        force = force + sigma * np.random.default_rng(seed).normal(size=len(force))
        rows = zip(self.time, 1.0 + self.strain, force, strict=True)
        lines = ["time_s,stretch,nominal_stress_MPa", *(f"{t:.6f},{s:.8f},{f:.8f}" for t, s, f in rows)]
        (folder / "uniaxial.csv").write_text("\n".join(lines) + "\n")
        (folder / "case.toml").write_text(TEXT.format(law=law))
        self.case = load_case(folder / "case.toml", ())
        self.recordings = tuple(read_recording(source) for source in self.case.recordings)
        start = {"neo_hookean": {"C10": 0.4}, "yeoh": {"C10": 0.4, "C20": -0.01, "C30": 0.001}}[law]
        self.cache = ModelCache()
        self.plain = fit_plain(self.cache, self.case, Model(law, start))
        self.used = tuple(np.ones(len(one.force), dtype=bool) for one in self.recordings)
        # As in a diagnosis: the plain law at its best under the likelihood, whose units depend on it.
        rough = first_plain_fit(self.cache, self.case, Model(law, start), self.used)
        crew = Workers(1, cache=self.cache)
        self.problem, self.state = pose_problem(
            self.case, rough, self.recordings, self.used, crew, self.cache
        )

    @property
    def measured(self):
        """The measured data that a fit gets."""
        return FittedSamples(self.used, self.problem.likelihood.plain, self.problem.noises)

    def model(self, **effects):
        """The best plain law with effects that begin at given values."""
        active = tuple(
            ActiveEffect(effect(name), values).with_start_values() for name, values in effects.items()
        )
        at = self.state.model
        return Model(at.law, at.start, effects=active)

    def fit(self, model, *contained):
        """Fit a model, starting also from the states of models that it contains, and return its state."""
        best = min(contained, key=lambda state: state.objective, default=None)
        inner, least = (None, float("inf")) if best is None else (best.model, best.objective)
        found = fit(self.cache, self.case, model, self.measured, inner, least)
        return State(self.problem, found)


@pytest.fixture(scope="session")
def coupon(tmp_path_factory):
    """Make a coupon from its law, its concealed permanent set, and its noise as a share of the force range.

    Tests that ask for the same one share it, because its plain law takes seconds to fit. Nobody changes it.
    """

    @cache
    def make(law="neo_hookean", set_=0.0, noise=0.003, seed=5):
        return Coupon(tmp_path_factory.mktemp("coupon"), law, set_, noise, seed)

    return make
