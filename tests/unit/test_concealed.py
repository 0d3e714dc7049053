"""Concealed effects: what is drawn, what the runner saves, and how the scorer judges invented results."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.concealed import draw, programs, refit, report, score
from benchmarks.concealed.run import Run, read_run, run_all
from benchmarks.concealed.sizes import SIZES, Situation, effect_of_size
from benchmarks.concealed.strength import apart, beside_a_factor, strength
from benchmarks.concealed.truth import Specimen, Truth, read_truth, write_truth
from bushcli.curve.segment import segment
from bushcli.effects.effect import effects
from cases.march import NotConverged

Array = NDArray[np.float64]

SITUATION = Situation(10.0, 35.0, 5.0, 1000.0, 300.0, 600.0, 8.0, 1.0, 0.5)


# -- what is drawn -----------------------------------------------------------------------------------------------


def test_a_deck_has_every_effect_of_the_catalogue_once() -> None:
    kinds = [draw.draw_concealed(seed) for seed in range(50, 75)]
    singles = sorted(plan.names[0] for plan in kinds if plan.kind == "single")
    assert singles == sorted(draw.CONCEALED)
    counts = [sum(plan.kind == kind for plan in kinds) for kind in ("none", "pair", "outside")]
    assert counts == [draw.NOTHINGS, draw.PAIRS, draw.OUTSIDERS]


def test_the_seed_alone_decides() -> None:
    assert [draw.draw_concealed(seed) for seed in range(40)] == [
        draw.draw_concealed(seed) for seed in range(40)
    ]
    rngs = [np.random.default_rng(7) for _ in range(2)]
    first, second = (draw.specimen(rng, ("axial", "radial")) for rng in rngs)
    assert first == second
    assert first != draw.specimen(np.random.default_rng(8), ("axial", "radial"))


@pytest.mark.parametrize("seed", range(60))
def test_channels_serve_the_effects(seed: int) -> None:
    plan = draw.draw_concealed(seed)
    for name in plan.names:
        assert any(effects()[name].acts_on(channel) for channel in plan.channels)
        if name in draw.NEEDS and plan.program == "rich":
            assert any(set(menu) <= set(plan.channels) for menu in draw.NEEDS[name])
        if effects()[name].of_channel:
            assert len(plan.channels) == 1
    assert plan.coupons >= ("batch_stiffness" in plan.names)


def test_every_effect_of_a_pair_acts_on_a_channel() -> None:
    """The longer of two sets of channels may lack the only channel on which the other effect acts."""
    for plan in map(draw.draw_concealed, range(2000, 2200)):
        for name in plan.names:
            assert any(effects()[name].acts_on(channel) for channel in plan.channels), plan


def test_every_effect_has_sizes_that_the_catalogue_admits() -> None:
    assert set(SIZES) <= set(effects())
    rng = np.random.default_rng(3)
    for name, sizes in SIZES.items():
        values = sizes.values(rng, SITUATION)
        needed = {p.name for p in effects()[name].parameters if not (p.optional or p.choices or p.under)}
        assert needed <= set(values) <= {p.name for p in effects()[name].parameters}
        for size in (sizes.least, sizes.most):
            active = effect_of_size(name, values, size)
            for parameter in effects()[name].parameters:
                if parameter.name in values:
                    assert parameter.admits(active.values[parameter.name]), (name, parameter.name)


def test_size_scales_amplitudes_and_leaves_shapes() -> None:
    small, large = (
        effect_of_size("viscoelasticity", {"g1": 0.2, "tau1": 3.0}, size).values for size in (1.0, 2.0)
    )
    assert large == {"g1": 2 * small["g1"], "tau1": small["tau1"]}


def test_only_stable_laws_are_drawn() -> None:
    rng = np.random.default_rng(11)
    drawn = [draw.stable_law(rng) for _ in range(12)]
    assert all(draw.stable(name, values) for name, values in drawn)
    # Softens without limit: C20 alone makes the tangent of W negative (2 C20 (I1 - 3) outweighs C10).
    assert not draw.stable("yeoh", {"C10": 0.5, "C20": -0.2, "C30": 0.0})


def test_rich_programs_have_cycles_a_hold_and_two_rates_that_are_found_again() -> None:
    rng = np.random.default_rng(5)
    t, q = programs.path(programs.rich(rng), 5.0, 60.0, programs.SAMPLES["rich"])
    assert np.all(np.diff(t) > 0)
    assert 150 <= len(t) <= 190
    noisy = q + 2e-4 * 5.0 * rng.standard_normal(len(q))
    found = segment(noisy, t)
    assert sum(branch.kind == "hold" for branch in found) == 1
    assert max(branch.cycle for branch in found) >= 5
    assert np.abs(q).max() == pytest.approx(5.0)
    rates = [
        abs(q[b.stop - 1] - q[b.start]) / (t[b.stop - 1] - t[b.start]) for b in found if b.kind != "hold"
    ]
    assert max(rates) > 4 * min(rates)


def test_a_common_factor_is_noise_that_samples_share() -> None:
    rng = np.random.default_rng(7)
    v, F, s = rng.standard_normal(20), 30.0 * rng.standard_normal(20), 0.01
    rows = beside_a_factor(v, F, s)
    covariance = np.eye(20) + s**2 * np.outer(F, F)
    assert rows @ rows == pytest.approx(v @ np.linalg.solve(covariance, v), rel=1e-10)
    assert np.linalg.norm(beside_a_factor(0.01 * F, F, s)) < 1.0 < np.linalg.norm(0.01 * F)


def test_strength_is_what_the_law_cannot_do() -> None:
    rng = np.random.default_rng(2)
    J, own = rng.standard_normal((50, 3)), rng.standard_normal(50)
    own -= J @ np.linalg.lstsq(J, own, rcond=None)[0]
    own *= 7.0 / np.linalg.norm(own)
    assert strength(own + J @ [1.0, -2.0, 3.0], [J]) == pytest.approx(7.0)
    assert strength(J @ [1.0, -2.0, 3.0], [J]) == pytest.approx(0.0, abs=1e-9)
    assert apart(own, 0.1 * own, [J], one_sided=True) == pytest.approx(0.0, abs=1e-9)
    assert apart(own, -0.1 * own, [J], one_sided=True) == pytest.approx(7.0)
    assert apart(own, -0.1 * own, [J], one_sided=False) == pytest.approx(0.0, abs=1e-9)


def test_a_law_that_is_moved_far_may_do_what_it_cannot_to_first_order() -> None:
    q = np.linspace(0.0, 1.0, 50)

    def curves(x: Array) -> tuple[Array, Array]:
        if x[0] > 3.0:
            raise NotConverged("the law is not stable there")
        return np.exp(x[0] * q), (q * np.exp(x[0] * q))[:, None]

    target = np.exp(2.5 * q) + 0.1 * np.cos(20.0 * q)
    first, free = curves(np.ones(1)), np.full(1, np.inf)
    assert strength(target - first[0], [first[1]]) > 3.0
    # What no law can imitate remains: the wave, less its component along the slope.
    _, slope = curves(np.full(1, 2.5))
    wave = strength(target - np.exp(2.5 * q), [slope])
    assert refit.remaining_misfit(curves, target, np.ones(1), -free, free) == pytest.approx(wave, rel=0.02)
    # With bounds, the fit ends at the nearest bound.
    bound = refit.remaining_misfit(curves, target, np.ones(1), np.zeros(1), np.full(1, 2.0))
    assert bound == pytest.approx(np.linalg.norm(target - np.exp(2.0 * q)), rel=0.02)


# -- invented truths and results -------------------------------------------------------------------------


SPECIMEN = Specimen("plain", {"inner_radius": 10.0}, "yeoh", {"C10": 0.5}, np.inf, {"axial": 5.0})


def truth(kind: str = "single", **effect: dict[str, float]) -> Truth:
    return Truth(
        seed=3,
        attempt=0,
        kind=kind,  # type: ignore[arg-type]
        program="rich",
        coupons=False,
        specimen=SPECIMEN,
        effects=effect,
        strength=dict.fromkeys(effect, 20.0),
        look_alikes=(),
        mesh=0.1,
        noise={"axial": 0.5},
    )


def result(*names: str, verdict: str = "", **more: Any) -> dict[str, Any]:
    effect = {"parameters": {"g1": {"value": 0.2, "std": 0.01, "lower": 0.18, "upper": 0.22}}}
    return {
        "verdict": verdict or ("missing_physics" if names else "explained"),
        "effects": [{"name": name, **effect} for name in names],
        "rivals": [],
        "mismatch": [],
        "misfit": {
            "before": {"axial": 4.0},
            "after": {"axial": 0.6},
            "held_out_before": {"axial": 4.0},
            "held_out_after": {"axial": 0.7},
        },
    } | more


def item(truth: Truth, result: dict[str, Any] | None) -> score.Item:
    return score.Item(truth, result, Run(10.0, 0 if result else None, result is not None, ""))


VISCO = {"viscoelasticity": {"g1": 0.21, "tau1": 4.0}}
BOTH = VISCO | {"mullins": {"inverse_r": 0.3}}


@pytest.mark.parametrize(
    ("secret", "said", "expected"),
    [
        (truth("none"), result(), "explained"),
        (truth("none"), result("mullins"), "false_alarm"),
        (truth("none"), result(verdict="unexplained"), "false_alarm"),
        (truth(**VISCO), result("viscoelasticity"), "named"),
        (truth(**VISCO), result("friction", rivals=[["friction"], ["viscoelasticity"]]), "rival"),
        (truth(**VISCO), result("friction", rivals=[["friction"], ["viscoelasticity", "mullins"]]), "other"),
        (truth(**VISCO), result("viscoelasticity", "mullins"), "extra"),
        (truth(**VISCO), result(), "missed"),
        (truth(**VISCO), result(verdict="law_too_poor"), "law_too_poor"),
        (truth(**VISCO), result(verdict="unexplained"), "unexplained"),
        (truth(**VISCO), None, "no_result"),
        (truth("pair", **BOTH), result("mullins", "viscoelasticity"), "named"),
        (truth("pair", **BOTH), result("mullins"), "part"),
    ],
)
def test_outcomes(secret: Truth, said: dict[str, Any] | None, expected: str) -> None:
    assert score.outcome(item(secret, said)) == expected


def part(first: int, last: int, sign: str, share: float) -> dict[str, Any]:
    return {"cycle": [first, last], "sign": sign, "share": share}


@pytest.mark.parametrize(
    ("parts", "right"),
    [
        ([part(1, 3, "too_soft", 0.5), part(4, 7, "too_stiff", 0.3)], True),
        ([part(1, 3, "too_stiff", 0.5), part(4, 7, "too_stiff", 0.3)], False),
        ([part(1, 7, "too_stiff", 0.8)], False),
        ([], False),
    ],
)
def test_a_step_outside_the_catalogue_has_to_be_located(parts: list[dict[str, Any]], right: bool) -> None:
    secret = replace(truth("outside"), step={"cycle": 4.0, "factor": 0.8})
    assert score.outcome(item(secret, result(verdict="unexplained", mismatch=parts))) == (
        "located" if right else "not_located"
    )
    assert score.outcome(item(secret, result("mullins", mismatch=parts))) == "not_located"


def test_targets_count_what_they_say() -> None:
    blind = replace(truth(**VISCO), program="ramp", look_alikes=("friction",))
    items = [
        item(truth(**VISCO), result("viscoelasticity")),
        item(truth(**VISCO), result("friction")),
        item(blind, result("friction", rivals=[["friction"], ["viscoelasticity"]])),
        item(truth("none"), result()),
        item(truth("none"), None),
    ]
    right, outright, rich, among, alarms, reached, held_out, inside, outside = score.targets(items)
    assert (right.count.good, right.count.all) == (2, 3)
    assert (outright.count.good, outright.count.all) == (1, 2)
    assert rich.count == outright.count
    assert (among.count.good, among.count.all) == (1, 1)
    assert (alarms.count.good, alarms.count.all) == (1, 2)
    # 0.6 % of misfit over 0.5 % of noise; a missing result counts as a failure.
    assert (reached.count.good, reached.count.all) == (4, 5)
    assert (held_out.count.good, held_out.count.all) == (3, 3)
    # g1 = 0.21 in 0.18..0.22; the result has no tau1.
    assert (inside.count.good, inside.count.all) == (1, 1)
    assert outside.count.all == 0
    assert [t.is_reached for t in (right, alarms, held_out, outside)] == [False, False, True, None]


def test_misfit_and_held_out_are_weighed_by_the_true_noise() -> None:
    secret = replace(truth(**VISCO), noise={"axial": 0.5, "radial": 0.1})
    misfit = {
        "after": {"axial": 0.5, "radial": 0.2},
        "held_out_before": {"axial": 2.0, "radial": 0.1},
        "held_out_after": {"axial": 0.5, "radial": 0.3},
    }
    assert score.ratio(item(secret, result("viscoelasticity", misfit=misfit))) == pytest.approx(2.0)
    # 16 + 1 before, 1 + 9 after.
    assert score.held_out(item(secret, result("viscoelasticity", misfit=misfit))) is True
    misfit["held_out_before"] = {"axial": None, "radial": None}  # type: ignore[dict-item]
    assert score.held_out(item(secret, result("viscoelasticity", misfit=misfit))) is None


def test_wilson_interval() -> None:
    # Newcombe (1998), Stat. Med. 17:857-872, table I: 81 of 263 gives 0.2553 to 0.3662 (without correction).
    assert score.Count(81, 263).wilson() == pytest.approx((0.2553, 0.3662), abs=5e-5)


def test_page_shows_scores_and_misses() -> None:
    items = [
        item(truth(**VISCO), result("viscoelasticity")),
        item(replace(truth(**VISCO), seed=4), result("friction")),
        item(replace(truth("none"), seed=5), None),
    ]
    text = report.document(items)
    assert "1 of 2: 50 % (9 to 91)" in text
    assert "make --count 3 --seed 3 DIR" in text
    assert "| viscoelasticity | 2 |" in text
    assert "| 0000004 | viscoelasticity (20) | friction | another effect |" in text
    assert "| 0000005 | nothing | no result | no result |" in text


def test_page_tells_sets_of_seeds_apart() -> None:
    items = [
        item(replace(truth(**VISCO), seed=seed), result(said))
        for seed, said in ((3, "viscoelasticity"), (4, "friction"), (11, "viscoelasticity"))
    ]
    text = report.document(items, [replace(truth(**VISCO), seed=12)])
    assert "make --count 2 --seed 3 DIR" in text
    assert "make --count 2 --seed 11 DIR" in text
    assert "3 recordings, seeds 3 to 4 and 11 to 12." in text
    assert "2 of 3: 67 % (21 to 94) | at least 95 % | **no** | 1 of 2 | 1 of 1 |" in text


def test_truth_is_read_back(tmp_path: Path) -> None:
    secret = replace(truth(**VISCO), look_alikes=("friction",), given_up=("too faint",))
    write_truth(secret, tmp_path / "truth.json")
    assert read_truth(tmp_path / "truth.json") == secret


# -- the runner, with a command that diagnoses nothing ------------------------------------------------------------


FAKE = """\
import json, sys, time
from pathlib import Path
case = Path(sys.argv[1])
out = Path(sys.argv[sys.argv.index("-o") + 1])
assert not list(case.parent.parent.glob("**/truth"))
what = case.read_text()
with Path(sys.argv[0]).with_name("calls").open("a") as calls:
    calls.write(what + "\\n")
if what == "hang":
    time.sleep(60)
if what == "fail":
    sys.exit("it fell over")
out.mkdir(parents=True)
(out / "result.json").write_text(json.dumps({"verdict": what}))
(out / "large.bin").write_text("of no use")
"""


def test_runner_keeps_results_and_goes_on_where_it_was(tmp_path: Path) -> None:
    (tmp_path / "fake.py").write_text(FAKE)
    folder, command = tmp_path / "bench", [sys.executable, str(tmp_path / "fake.py")]
    for name, what in {"1": "explained", "2": "fail", "3": "hang", "4": "unexplained"}.items():
        (folder / "cases" / name).mkdir(parents=True)
        (folder / "cases" / name / "case.toml").write_text(what)
    assert len(list(run_all(folder, command, workers=2, timeout=2.0, count=1))) == 1
    assert len(list(run_all(folder, command, workers=2, timeout=2.0))) == 3
    kept = sorted(str(file.relative_to(folder / "results")) for file in (folder / "results").glob("*/*"))
    assert kept == ["1/result.json", "1/run.json", "2/run.json", "3/run.json", "4/result.json", "4/run.json"]
    assert json.loads((folder / "results/4/result.json").read_text()) == {"verdict": "unexplained"}
    failed, hung = (read_run(folder / "results" / name / "run.json") for name in "23")
    assert failed.code == 1
    assert "it fell over" in failed.stderr
    assert hung.code is None
    assert hung.seconds < 30
    assert list(run_all(folder, command, timeout=2.0)) == []
    (folder / "cases/3/case.toml").write_text("explained")
    assert len(list(run_all(folder, command, timeout=2.0, again=True))) == 2
    assert read_run(folder / "results/3/run.json").result
    assert (tmp_path / "calls").read_text().split().count("unexplained") == 1


def test_interrupted_runner_ends_what_is_under_way(tmp_path: Path) -> None:
    (tmp_path / "fake.py").write_text(FAKE)
    folder, command = tmp_path / "bench", [sys.executable, str(tmp_path / "fake.py")]
    for name, what in {"1": "explained", "2": "hang"}.items():
        (folder / "cases" / name).mkdir(parents=True)
        (folder / "cases" / name / "case.toml").write_text(what)
    lines = run_all(folder, command, workers=2, timeout=60.0)
    begin = time.monotonic()
    assert next(lines).startswith("1: done")
    lines.close()
    # The fake would sleep for a minute.
    assert time.monotonic() - begin < 30
    assert not (folder / "results/2/run.json").exists()


def test_processes_that_make_recordings_end_with_the_first_one_when_that_is_killed(tmp_path: Path) -> None:
    program = tmp_path / "main.py"
    program.write_text(
        "import os, time\n"
        "from concurrent.futures import ProcessPoolExecutor\n"
        "from multiprocessing import get_context\n"
        "from benchmarks.concealed.batch import follow\n"
        "if __name__ == '__main__':\n"
        "    with ProcessPoolExecutor(1, mp_context=get_context('spawn'), initializer=follow) as pool:\n"
        "        print(pool.submit(os.getpid).result(), flush=True)\n"
        "        time.sleep(100.0)\n"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    with subprocess.Popen(
        [sys.executable, str(program)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
    ) as process:
        assert process.stdout is not None
        assert int(process.stdout.readline()) != process.pid
        process.kill()
        # An idle process of the pool holds the pipe open until it ends.
        process.communicate(timeout=30)
