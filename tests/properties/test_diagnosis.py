"""A diagnosis does not depend on units, order of channels, sense of the path, sampling or the number of workers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bushcli.case import load_case
from bushcli.diagnosis.diagnose import diagnose

# MPa; permanent set of a soft filled rubber.
C10, C20, SET = 0.5, -0.02, 0.05
NOISE = 0.003
# Units of the files, and the factors from MPa, s, N and mm to them.
STRESS = {"MPa": 1.0, "kPa": 1e3}
TIME = {"s": 1.0, "min": 1.0 / 60.0}
FORCE = {"N": 1.0, "kN": 1e-3}
LENGTH = {"mm": 1.0, "m": 1e-3}
# Rows of time, strain and force -> the rows that were written.
Sampling = Callable[..., tuple[Any, ...]]
FEW = settings(
    max_examples=3,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def cycles(*ends: float, per_way: int = 20, rate: float = 0.02) -> tuple[Any, Any]:
    """Time (s) and displacement from zero through the turning points `ends`."""
    q, t = [0.0], [0.0]
    for end in ends:
        way = np.linspace(q[-1], end, per_way + 1)[1:]
        t += list(t[-1] + np.abs(way - q[-1]) / rate)
        q += list(way)
    return np.array(t), np.array(q)


def stress(mode: str, strain: Any) -> Any:
    """Nominal stress of incompressible Yeoh rubber with permanent set, uniaxial or planar (Treloar 1975)."""
    stretch = 1.0 + strain - SET * np.maximum.accumulate(strain)
    if mode == "uniaxial":
        i1, shape = stretch**2 + 2.0 / stretch - 3.0, stretch - stretch**-2
    else:
        i1, shape = stretch**2 + stretch**-2 - 2.0, stretch - stretch**-3
    return 2.0 * shape * (C10 + 2.0 * C20 * i1)


def table(file: Path, names: list[str], columns: list[Any]) -> None:
    rows = [",".join(f"{value:.12g}" for value in row) for row in zip(*columns, strict=True)]
    file.write_text("\n".join([",".join(names), *rows]) + "\n")


def answer(found: Any) -> dict[str, Any]:
    """The values of a diagnosis that must not depend on how the data are written."""
    return {
        "verdict": found.verdict,
        "effects": sorted(one.name for one in found.effects),
        "probability": dict(found.probability),
        "law": {name: found.parameters[name].value for name in found.material.parameters},
        "std": {name: found.parameters[name].std for name in found.material.parameters},
        "misfit": {one.name: one.after_percent for one in found.channels},
    }


def alike(one: dict[str, Any], other: dict[str, Any]) -> None:
    """Check that two answers are equal to the fit's tolerance of a thousandth; the files have twelve digits."""
    assert one["verdict"] == other["verdict"]
    assert one["effects"] == other["effects"]
    assert one["probability"] == pytest.approx(other["probability"], abs=1e-3)
    assert one["law"] == pytest.approx(other["law"], rel=1e-3, abs=1e-5)
    assert one["std"] == pytest.approx(other["std"], rel=1e-2)
    assert one["misfit"] == pytest.approx(other["misfit"], rel=1e-3)


COUPON = """
[geometry]
shape = "coupon"
[material]
law = "yeoh"
"""


def coupon(
    folder: Path,
    unit: str,
    clock: str,
    order: list[str],
    workers: int,
    sampled: Sampling = lambda *each: each,
) -> dict[str, Any]:
    text = COUPON
    for mode in order:
        time, strain = cycles(0.3, 0.0, 0.3, 0.0, 0.6, 0.0, 0.6, 0.0)
        force = stress(mode, strain)
        force = force + NOISE * np.ptp(force) * np.random.default_rng(len(mode)).normal(size=len(force))
        time, strain, force = sampled(time, strain, force)
        names = [f"time_{clock}", "stretch", f"nominal_stress_{unit}"]
        table(folder / f"{mode}.csv", names, [TIME[clock] * time, 1.0 + strain, STRESS[unit] * force])
        text += f'[[recordings]]\nmode = "{mode}"\nfile = "{mode}.csv"\n'
    (folder / "case.toml").write_text(text)
    found = diagnose(
        load_case(folder / "case.toml", ()), effects=["permanent_set", "drift"], maps=False, workers=workers
    )
    return answer(found)


BOTH = ["uniaxial", "planar"]


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return coupon(tmp_path_factory.mktemp("usual"), "MPa", "s", BOTH, 1)


def test_what_is_concealed_is_found(usual: dict[str, Any]) -> None:
    """Otherwise all answers below might be equal because all are empty."""
    assert usual["effects"] == ["permanent_set"]
    assert usual["probability"]["permanent_set"] > 0.95


@pytest.mark.slow
@FEW
@given(unit=st.sampled_from(sorted(STRESS)), clock=st.sampled_from(sorted(TIME)), order=st.permutations(BOTH))
def test_units_and_order_do_not_matter(
    usual: dict[str, Any], tmp_path: Path, unit: str, clock: str, order: list[str]
) -> None:
    alike(coupon(tmp_path, unit, clock, order, 1), usual)


def same_physics(one: dict[str, Any], other: dict[str, Any]) -> None:
    """Check that two answers name the same effect, and laws that differ by no more than four standard errors."""
    assert (one["verdict"], one["effects"]) == (other["verdict"], other["effects"])
    assert one["probability"]["permanent_set"] > 0.99
    for name, value in one["law"].items():
        assert abs(value - other["law"][name]) < 4.0 * np.hypot(one["std"][name], other["std"][name]), name


@pytest.mark.slow
@settings(FEW, max_examples=2)
@given(share=st.sampled_from([0.5, 0.7, 0.9]), seed=st.integers(0, 9))
def test_which_samples_were_taken_does_not_matter(
    usual: dict[str, Any], tmp_path: Path, share: float, seed: int
) -> None:
    """Some samples are left out at random: those that remain are not evenly spaced in time."""

    def some(*each: Any) -> tuple[Any, ...]:
        kept = np.random.default_rng(seed).random(len(each[0])) < share
        kept[[0, 20, 60, 80, 100, 120, 140, -1]] = True  # turning points
        return tuple(one[kept] for one in each)

    same_physics(coupon(tmp_path, "MPa", "s", BOTH, 1, some), usual)


@pytest.mark.slow
@settings(FEW, max_examples=2)
@given(times=st.sampled_from([2, 4]))
def test_samples_between_samples_tell_nothing_new(usual: dict[str, Any], tmp_path: Path, times: int) -> None:
    """A rig that writes points of a straight line between its samples adds rows, and no knowledge of the law."""

    def more(*each: Any) -> tuple[Any, ...]:
        rows = np.arange(len(each[0]), dtype=float)
        places = np.linspace(0.0, rows[-1], times * (len(rows) - 1) + 1)
        return tuple(np.interp(places, rows, one) for one in each)

    found = coupon(tmp_path, "MPa", "s", BOTH, 1, more)
    same_physics(found, usual)
    # Of white noise, straight lines leave two thirds of the variance: standard errors may be that much smaller.
    for name, std in found["std"].items():
        assert std > np.sqrt(2.0 / 3.0) * usual["std"][name], name


@pytest.mark.slow
def test_the_number_of_workers_does_not_matter(usual: dict[str, Any], tmp_path: Path) -> None:
    assert coupon(tmp_path, "MPa", "s", BOTH, 2) == usual


AXIAL = """
[geometry]
shape = "plain"
inner_radius = 10.0
outer_radius = 18.0
length = 28.0
[mesh]
elements_across = 2
elements_along = 4
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
"""


def axial(folder: Path, force: str, length: str, sense: int, both: bool) -> dict[str, Any]:
    """A bushing with play of 0.1 mm in the rig; `sense` -1 reverses `both` columns, or the force alone as declared."""
    time, q = cycles(3.0, -3.0, 4.0, -4.0, 0.0, per_way=16, rate=0.5)
    inner = np.sign(q) * np.maximum(np.abs(q) - 0.1, 0.0)
    recorded = 340.0 * inner + 1.0 * inner**3
    recorded = recorded + NOISE * np.ptp(recorded) * np.random.default_rng(1).normal(size=len(q))
    # Where only the force is reversed, the case declares it.
    turned = 'reverse = ["force"]' if sense < 0 and not both else ""
    travel = (sense if both else 1) * q
    names = ["time_s", f"displacement_{length}", f"force_{force}"]
    table(folder / "axial.csv", names, [time, LENGTH[length] * travel, sense * FORCE[force] * recorded])
    text = f'{AXIAL}[[recordings]]\nmode = "axial"\nfile = "axial.csv"\n{turned}\n'
    (folder / "case.toml").write_text(text)
    return answer(diagnose(load_case(folder / "case.toml", ()), effects=["free_play", "offset"], maps=False))


@pytest.fixture(scope="module")
def play(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return axial(tmp_path_factory.mktemp("play"), "N", "mm", 1, True)


@pytest.mark.slow
@FEW
@given(
    force=st.sampled_from(sorted(FORCE)),
    length=st.sampled_from(sorted(LENGTH)),
    sense=st.sampled_from([1, -1]),
    both=st.booleans(),
)
def test_units_and_sense_of_a_bushing_do_not_matter(
    play: dict[str, Any], tmp_path: Path, force: str, length: str, sense: int, both: bool
) -> None:
    alike(axial(tmp_path, force, length, sense, both), play)
