import numpy as np
import pytest
from scipy import stats

from bushcli.case import Material
from bushcli.case.hardness import scaled_to_hardness, youngs_modulus
from bushcli.study.analysis import Columns, Limits, failures, limits_of, summary, within
from bushcli.study.plan import plan
from bushcli.study.variable import variable
from forms.law import laws


def columns(chosen, values, status=None):
    n = len(chosen.rows)
    keys = {key: [row[i] for row in chosen.rows] for i, key in enumerate(chosen.keys)}
    return Columns(np.arange(n), keys, {"y": np.asarray(values, dtype=float)}, status or [("ok", "", "")] * n)


def ishigami(chosen):
    x = np.array(chosen.rows)
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_plan(designs):
    return plan(
        [variable(f"x{i}=-3.141592653589793:3.141592653589793") for i in range(3)], "saltelli", designs
    )


# Closed form: Ishigami and Homma (1990), doi:10.1109/ISUMA.1990.151285, with a = 7, b = 0.1.
FIRST, TOTAL = (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437)


def test_sobol_indices_of_ishigamis_function():
    chosen = ishigami_plan(20_480)
    found = summary(chosen, columns(chosen, ishigami(chosen)), "y")
    for i in range(3):
        influence = found.influences[f"x{i}"]
        assert influence.first == pytest.approx(FIRST[i], abs=0.03)
        assert influence.total == pytest.approx(TOTAL[i], abs=0.03)
        assert 0.0 < influence.total_error < 0.06


def test_sobol_indices_without_the_blocks_of_failed_designs():
    chosen = ishigami_plan(20_480)
    values = ishigami(chosen)
    values[::97] = np.nan
    found = summary(chosen, columns(chosen, values), "y")
    assert found.influences["x1"].total == pytest.approx(TOTAL[1], abs=0.05)


def test_a_linear_answer_is_explained_and_its_worst_cases_named():
    chosen = plan([variable("a=0:1"), variable("b=10 +- 3"), variable("c=u,v")], "lhs", 200)
    values = [2.0 * a - 0.5 * b for a, b, _ in chosen.rows]
    found = summary(chosen, columns(chosen, values), "y", Limits(-4.5, -3.5))
    assert found.linear == pytest.approx(1.0)
    assert set(found.influences) == {"a", "b"}
    assert found.influences["a"].swing == pytest.approx((-0.9, 0.9), abs=0.02)
    assert found.highest.value == max(values)
    assert found.highest.at["a"] == chosen.rows[found.highest.design][0]
    assert found.limits.share == pytest.approx(np.mean([-4.5 <= y <= -3.5 for y in values]))


@pytest.mark.parametrize(("good", "of"), [(0, 20), (13, 20), (20, 20)])
def test_interval_of_a_yield_is_that_of_clopper_and_pearson(good, of):
    found = within(Limits(0.0, 1.0), np.array([0.5] * good + [2.0] * (of - good)))
    interval = stats.binomtest(good, of).proportion_ci(0.95)
    assert found.interval == pytest.approx((interval.low, interval.high), abs=1e-9)


def test_reasons_that_differ_in_numbers_are_one():
    chosen = plan([variable("a=1,2,3,4")], None)
    status = [
        ("failed", "input", "a = 1 is too small"),
        ("ok", "", ""),
        ("failed", "input", "a = 2.5 is too small"),
    ]
    status.append(("failed", "died", "gone"))
    found = failures(columns(chosen, [np.nan, 1.0, np.nan, np.nan], status))
    assert [(one.kind, one.count, one.designs) for one in found] == [("input", 2, (0, 2)), ("died", 1, (3,))]


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("k=300:400", 300.0, 400.0),
        ("k=350 +- 10 %", 315.0, 385.0),
        ("k=350", 315.0, 385.0),
        ("a.b=1 +- 0.5", 0.5, 1.5),
    ],
)
def test_limits(text, low, high):
    name, found = limits_of(text)
    assert name == text.partition("=")[0]
    assert (found.low, found.high) == pytest.approx((low, high))


# Gent (1958), as tabulated from his formula: Shore A 40, 60 and 80 are 1.69, 3.60 and 9.34 MPa.
@pytest.mark.parametrize(("shore_a", "modulus"), [(40.0, 1.6898), (60.0, 3.6059), (80.0, 9.3538)])
def test_modulus_of_a_hardness(shore_a, modulus):
    by_hand = 0.0981 * (56 + 7.62336 * shore_a) / (0.137505 * 2.54 * (100 - shore_a))
    assert youngs_modulus(shore_a) == pytest.approx(by_hand)
    assert youngs_modulus(shore_a) == pytest.approx(modulus, rel=5e-3)


@pytest.mark.parametrize("name", laws())
def test_hardness_scales_the_shear_modulus_of_every_law(name):
    law = laws()[name]
    start = {p.name: p.start for p in law.parameters}
    harder = scaled_to_hardness(Material(name, 2000.0, start), 60.0, 65.0)
    factor = law.shear_modulus(**harder.parameters) / law.shear_modulus(**start)
    assert factor == pytest.approx(youngs_modulus(65.0) / youngs_modulus(60.0), rel=1e-12)
    assert harder.bulk_modulus == 2000.0


def test_a_hardness_outside_of_the_relation_is_refused():
    with pytest.raises(ValueError, match="outside 20 to 90"):
        scaled_to_hardness(Material("neo_hookean", 2000.0, {"C10": 0.5}), 60.0, 95.0)


def test_mean_and_yield_of_a_saltelli_design_are_those_of_the_designs_that_were_drawn():
    chosen = plan([variable("a=0:1"), variable("b=0:1")], "saltelli", 4096)
    drawn = np.flatnonzero(chosen.is_independent)
    assert len(drawn) == 2 * len(chosen.rows) // 4
    # Drawn designs have no value in common; mixed designs take their values from them.
    assert len({row[0] for row in np.array(chosen.rows)[drawn]}) == len(drawn)
    assert len({row[0] for row in chosen.rows}) == len(drawn)
    found = summary(chosen, columns(chosen, [a * b for a, b in chosen.rows]), "y", Limits(0.0, 0.25))
    assert found.mean == pytest.approx(0.25, abs=0.005)
    # P(ab < 1/4) = (1 + ln 4) / 4.
    assert found.limits.share == pytest.approx(0.25 * (1.0 + np.log(4.0)), abs=0.02)
    assert found.count == len(chosen.rows)
