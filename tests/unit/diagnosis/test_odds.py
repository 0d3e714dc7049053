"""The table of odds, and priors as fits use them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects, effects_on
from bushcli.evidence import prior
from bushcli.evidence.prior import ODDS, ParameterPrior, effect_odds, log_odds
from bushcli.recording import Recording

SCALES = {
    "duration": 120.0,
    "interval": 0.5,
    "travel": 5.0,
    "force": 900.0,
    "stiffness": 180.0,
    "compliance": 1.0 / 180.0,
    "thickness": 10.0,
    "length": 40.0,
    "shear": 0.8,
    "squared arm": 1.0,
}
KNOWN = [
    (f"{effect.name}.{p.name}", p)
    for effect in effects().values()
    for p in effect.parameters
    if p.prior is not None
]


def active(name, channels=None):
    return ActiveEffect(effects()[name], {}, channels).with_start_values()


def test_an_effect_has_the_odds_of_its_class():
    assert (
        effect_odds("mullins")
        == ODDS["usual"]
        > effect_odds("swaging")
        > effect_odds("warming")
        == ODDS["rare"]
    )


def test_an_effect_is_missing_in_about_one_test_of_four():
    """The probability of at least one effect by all odds together, as the comment at the classes states it."""

    def some(kind, in_tables):
        odds = [effect_odds(name, in_tables=in_tables) for name in effects_on(kind)]
        return 1.0 - math.prod(1.0 / (1.0 + one) for one in odds)

    assert 0.2 < some("static", in_tables=False) < 0.3
    assert some("dynamic", in_tables=True) < 0.35


def static(*names):
    return [(name, "static") for name in names]


@pytest.mark.parametrize(
    ("zeroed_at", "shown"), [(0.0, True), (0.05, True), (0.5, False), (-0.5, False), (1.5, False)]
)
def test_the_zero_of_a_displacement_is_wide_open_where_no_rest_is_shown(zeroed_at, shown):
    """A load cell that reads the true force, beside a displacement that counts from a preload."""
    q = np.concatenate([np.linspace(0.0, 1.0, 30), np.linspace(1.0, -1.0, 60), np.linspace(-1.0, 0.0, 30)])
    loop = 0.05 * np.sign(np.gradient(q))
    one = Recording("axial", q, 100.0 * (q + zeroed_at + loop), None, name="axial")
    case = load_case(Path(__file__).parents[3] / "examples" / "batch" / "case.toml", ())
    found = prior.known_parameters(case, (active("offset"),), 0.8, [one])["offset.displacement"]
    assert found.prior.low == (0.03 if shown else 0.5)


def test_odds_multiply_and_the_plain_law_has_none():
    assert log_odds((), False, False, False, static("axial", "radial")) == 0.0
    both = log_odds((active("mullins"), active("swaging")), True, False, True, static("axial"))
    # Half of it for a sleeve drawn in to a cylinder, half for one drawn in to a cone.
    swaging = effect_odds("swaging") / 2
    expected = effect_odds("mullins") * swaging * prior.OTHER_LAW * prior.UNKNOWN
    assert both == pytest.approx(math.log(expected))
    assert log_odds((), False, True, False, static("axial")) == pytest.approx(math.log(prior.FREED_LAW))
    # Another law is as probable as one of a single parameter, but tables show little of a law's shape.
    other = log_odds((), True, False, False, static("axial"), of_one_parameter=True)
    assert other == pytest.approx(math.log(prior.OTHER_THAN_ONE_PARAMETER))
    both = [*static("axial"), ("axial", "dynamic")]
    beside = log_odds((), True, False, False, both, of_one_parameter=True)
    assert beside == pytest.approx(math.log(prior.OTHER_LAW))


def test_channels_share_the_odds_of_what_belongs_to_one_of_them():
    one = log_odds((active("gain", ("axial",)),), False, False, False, static("axial", "radial", "torsional"))
    assert one == pytest.approx(math.log(effect_odds("gain") / 3))
    assert log_odds(
        (active("mullins"),), False, False, False, static("axial", "radial", "torsional")
    ) == pytest.approx(math.log(effect_odds("mullins")))


def test_channels_share_a_rig_or_one_has_its_own():
    """All ways of a lag have the odds of one together; a compliant rig does not act in torsion."""
    three = static("axial", "radial", "torsional")
    ways = [active("time_lag"), *(active("time_lag", (mode,)) for mode, _ in three)]
    together = sum(math.exp(log_odds((one,), False, False, False, three)) for one in ways)
    assert together == pytest.approx(effect_odds("time_lag"))
    ways = [active("rig_compliance"), *(active("rig_compliance", (mode,)) for mode, _ in three[:2])]
    branches = effects()["rig_compliance"].branches
    together = sum(math.exp(log_odds((one,), False, False, False, three)) for one in ways)
    assert together == pytest.approx(effect_odds("rig_compliance") / branches)
    one = log_odds((active("rig_compliance"),), False, False, False, static("axial", "torsional"))
    assert one == pytest.approx(math.log(effect_odds("rig_compliance") / branches))


def test_a_dynamic_rig_is_not_the_static_one():
    """A gain belongs to one of the two load cells; the mass of a fixture to the only dynamic one."""
    both = [("axial", "static"), ("axial", "dynamic")]
    one = log_odds((active("gain", ("axial",)),), False, False, False, both)
    assert one == pytest.approx(math.log(effect_odds("gain") / 2))
    one = log_odds((active("fixture_mass"),), False, False, False, both)
    assert one == pytest.approx(math.log(effect_odds("fixture_mass")))


def test_numbers_of_branches_share_the_odds_of_their_effect():
    found = log_odds((active("viscoelasticity"),), False, False, False, static("axial"))
    # A rate that grows with the stress is a fourth way.
    assert found == pytest.approx(math.log(effect_odds("viscoelasticity") / 4))
    assert log_odds((active("friction"),), False, False, False, static("axial")) == pytest.approx(
        math.log(effect_odds("friction") / 3)
    )


def test_variants_share_the_odds_of_their_effect():
    ways = [ActiveEffect(effects()["permanent_set"], {"set": 0.1} | more) for more in ({}, {"cycles": 1.0})]
    together = sum(math.exp(log_odds((one,), False, False, False, static("axial"))) for one in ways)
    assert together == pytest.approx(effect_odds("permanent_set"))


def test_what_fillers_do_comes_together():
    """Softening and set are more probable beside dissipation, a second formula of the same kind is not."""

    def odds(*names, **options):
        return log_odds([active(name) for name in names], False, False, False, static("axial"), **options)

    def alone(*names):
        return sum(map(odds, names))

    further = math.log(prior.FILLED)
    assert odds("mullins", "payne") == pytest.approx(alone("mullins", "payne") + further)
    three = ("mullins", "payne", "permanent_set")
    assert odds(*three) == pytest.approx(alone(*three) + 2 * further)
    assert odds("friction", "payne") == pytest.approx(alone("friction", "payne"))
    assert odds("friction", "payne", "mullins") == pytest.approx(
        alone("friction", "payne", "mullins") + further
    )
    assert odds("mullins", "offset") == pytest.approx(alone("mullins", "offset"))
    assert prior.log_odds_together(["mullins", "payne"], uniform=True) == pytest.approx(
        2 * math.log(prior.OCCASIONAL)
    )


def test_uniform_odds_prefer_no_effect():
    assert len({effect_odds(name, uniform=True) for name in effects()}) == 1


def test_every_identified_parameter_of_the_catalogue_has_a_prior_with_a_source():
    without = [
        f"{effect.name}.{p.name}"
        for effect in effects().values()
        for p in effect.parameters
        if p.prior is None or not p.prior.source
    ]
    assert without == []


@pytest.mark.parametrize(("name", "parameter"), KNOWN, ids=[name for name, _ in KNOWN])
def test_a_fit_meets_the_density_of_the_prior(name, parameter):
    """Up to a constant, half the square of the row is the negative log density (of the logarithm, where it applies)."""
    known = ParameterPrior(parameter.prior, SCALES, False)
    if parameter.prior.shape == "choice":
        return
    low, high = parameter.prior.range(SCALES)
    values = np.linspace(max(low, 0.0) + 0.05 * (high - low), 1.5 * high, 9)
    logarithm = np.log(np.abs(values)) if parameter.prior.is_logarithmic else 0.0
    density = np.array([parameter.prior.log_density(v, SCALES) for v in values]) + logarithm
    rows = np.array([known.row(v)[0] for v in values])
    np.testing.assert_allclose(
        -0.5 * rows**2 - density, np.ptp(density) * 0.0 - density[0] - 0.5 * rows[0] ** 2
    )
    step = 1e-6 * (high - low)
    slopes = [(known.row(v + step)[0] - known.row(v - step)[0]) / (2 * step) for v in values]
    np.testing.assert_allclose([known.row(v)[1] for v in values], slopes, rtol=1e-4, atol=1e-6 / (high - low))


def test_what_every_rig_has_is_more_probable_beside_tables():
    """Mass, resonance and delay of a rig show at the frequencies of tables, unless these were corrected."""
    for name in ("fixture_mass", "rig_resonance", "time_lag"):
        assert effect_odds(name, in_tables=True) == ODDS["usual"]
    assert effect_odds("time_lag") == ODDS["occasional"]
    lag = active("time_lag", ("axial",))
    table, path = (log_odds((lag,), False, False, False, [("axial", kind)]) for kind in ("dynamic", "static"))
    assert table - path == pytest.approx(math.log(ODDS["usual"] / ODDS["occasional"]))
    uniform = (
        log_odds((lag,), False, False, False, [("axial", kind)], uniform=True)
        for kind in ("dynamic", "static")
    )
    assert len(set(uniform)) == 1
