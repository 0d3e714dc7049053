import os
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from bushcli.case.tolerance import Toleranced, nominal_tables, toleranced_number
from bushcli.errors import InputError
from bushcli.study.plan import LARGEST_LIST, from_list, plan
from bushcli.study.variable import variable

U = np.linspace(0.001, 0.999, 999)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("22.0 +- 0.1", Toleranced(22.0, 0.1)),
        ("22±.1", Toleranced(22.0, 0.1)),
        ("350 +/- 10 %", Toleranced(350.0, 35.0)),
        ("-3e1 +- 1", Toleranced(-30.0, 1.0)),
        ("22 +- 0", None),
        ("22", None),
        ("bushing 3 +- 4", None),
    ],
)
def test_tolerances(text, found):
    assert toleranced_number(text) == found


def test_a_case_keeps_plain_numbers_and_the_tolerances_by_key():
    data = {"title": "1 +- 2", "geometry": {"length": "40 +- 0.3"}, "load_cases": [{"amplitude": "8 +- 1"}]}
    plain, found = nominal_tables(data)
    assert plain == {"title": "1 +- 2", "geometry": {"length": 40.0}, "load_cases": [{"amplitude": 8.0}]}
    assert found == {
        "geometry.length": Toleranced(40.0, 0.3),
        "load_cases[0].amplitude": Toleranced(8.0, 1.0),
    }


@pytest.mark.parametrize(
    ("spec", "values"),
    [
        ("20:24:5", (20.0, 21.0, 22.0, 23.0, 24.0)),
        ("20,22.5", (20, 22.5)),
        ("plain,tapered", ("plain", "tapered")),
        ("[20.0, 16.0], [21, 16]", ("[20.0, 16.0]", "[21, 16]")),
        ("0.1:0.3:3", (0.1, 0.2, 0.3)),
    ],
)
def test_values(spec, values):
    assert variable(f"k={spec}").values == values


@pytest.mark.parametrize(
    ("spec", "law"),
    [
        ("20:24", stats.uniform(20, 4)),
        ("uniform(20, 24)", stats.uniform(20, 4)),
        ("normal(22, 0.5)", stats.norm(22, 0.5)),
        ("22 +- 0.3", stats.truncnorm(-3, 3, 22, 0.1)),
        ("lognormal(0.5, 0.1)", stats.lognorm(0.1, scale=0.5)),
        ("triangular(1, 2, 5)", stats.triang(0.25, 1, 4)),
    ],
)
def test_distributions_are_those_of_scipy(spec, law):
    assert variable(f"k={spec}").at(U) == pytest.approx(law.ppf(U), rel=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "k",
        "k=",
        "=3",
        "k=24:20",
        "k=20:24:1",
        "k=a:b",
        "k=normal(1)",
        "k=weibull(1, 2)",
        "k=normal(1, -1)",
        "k=nan",
    ],
)
def test_what_is_no_variable_is_refused(text):
    with pytest.raises(InputError, match="--vary"):
        variable(text)


def test_a_grid_has_all_combinations_and_a_sample_as_many_as_asked():
    both = [variable("a=1,2"), variable("b=x,y,z")]
    assert plan(both, None).rows == [(1, "x"), (1, "y"), (1, "z"), (2, "x"), (2, "y"), (2, "z")]
    found = plan([*both, variable("c=0:1")], None, 30)
    assert (found.sampling, len(found.rows)) == ("lhs", 30)
    # A Latin hypercube gives each of three words to ten of thirty designs.
    assert [sum(row[1] == word for row in found.rows) for word in "xyz"] == [10, 10, 10]


def test_a_sample_is_the_same_for_the_same_seed():
    one = [variable("a=0:1"), variable("b=normal(0, 1)")]
    for sampling in ("lhs", "sobol", "random", "saltelli"):
        assert plan(one, sampling, 16, seed=3).rows == plan(one, sampling, 16, seed=3).rows
        assert plan(one, sampling, 16, seed=3).rows != plan(one, sampling, 16, seed=4).rows


def test_corners_are_the_nominal_design_and_all_ends():
    found = plan([variable("a=10 +- 1"), variable("b=5 +- 2")], "corners")
    assert found.rows == [(10.0, 5.0), (9.0, 3.0), (9.0, 7.0), (11.0, 3.0), (11.0, 7.0)]


def test_what_makes_no_plan_is_refused():
    for variables, options in (
        ([], {}),
        ([variable("a=1:2")], {"sampling": "grid"}),
        ([variable("a=1,2"), variable("a=3,4")], {}),
        ([variable("a=x,y")], {"sampling": "corners"}),
        ([variable("a=1,2")], {"sampling": "grid", "designs": 3}),
    ):
        with pytest.raises(InputError):
            plan(variables, **({"sampling": None} | options))


def test_designs_from_a_table(tmp_path):
    file = tmp_path / "designs.csv"
    file.write_text("\ufeffgeometry.length, material.law\n40,yeoh\n\n42.5,neo_hookean\n")
    found = from_list(file)
    assert found.keys == ("geometry.length", "material.law")
    assert found.rows == [(40, "yeoh"), (42.5, "neo_hookean")]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", r"designs\.csv: has no designs"),
        ("a,b\n", r"designs\.csv: has no designs"),
        ("a,b\n\n1\n", r"designs\.csv:3: has 1 values for 2 keys"),
        ("\na,a\n1,2\n", r"designs\.csv:2: names a column twice"),
        ("a,b\n1,2\n\n1,\n", r"designs\.csv:4: has no value for b"),
        ("a,b\n1,2\n1,x\n", r"designs\.csv:3: b = x is a word, but the first value, 2, is a number"),
        ("a,b\n1,x\n1,2\n", r"designs\.csv:3: b = 2 is a number, but the first value, x, is a word"),
        ("a,b\n1,2\n1,inf\n", r"designs\.csv:3: b = inf is not finite"),
        ("a\n\udcff", r"designs\.csv: cannot be read"),
    ],
)
def test_a_table_that_is_none_is_refused(tmp_path, text, said):
    file = tmp_path / "designs.csv"
    file.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(InputError, match=said):
        from_list(file)


@pytest.mark.parametrize("kind", ["device", "pipe", "large"])
def test_a_list_that_does_not_end_is_not_read(tmp_path, kind):
    file = Path("/dev/zero") if kind == "device" else tmp_path / "designs.csv"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "large":
        with file.open("wb") as opened:
            opened.truncate(LARGEST_LIST + 1)
    with pytest.raises(InputError, match=r"(is a device or a pipe|has more than 16 MB).* at most 16 MB"):
        from_list(file)
