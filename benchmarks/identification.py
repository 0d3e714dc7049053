"""Cost of an identification, and coverage of its intervals.

    OMP_NUM_THREADS=1 python benchmarks/identification.py speed
    OMP_NUM_THREADS=1 python benchmarks/identification.py coverage --seeds 50 --modes axial,torsional

The recordings are pseudo-experiments by third-order elements (tests/recovery/conftest.py): plain bushing, rubber
9/18 mm, 34 mm long, Yeoh 0.5, -0.04, 0.007 MPa, kappa 2000 MPa. Results: identification.md beside this file.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, load_case
from bushcli.curve.curve import Curve
from bushcli.inverse import Fit, Task, identify
from bushcli.inverse.channel import Channel
from bushcli.inverse.problem import LeastSquaresProblem
from bushcli.recording import write_curve_csv
from cases.simulate import sweep

Array = NDArray[np.float64]
ROOT = Path(__file__).resolve().parents[1]
# Relative step of forward differences: about the square root of the march's resolution (1e-7 of the force).
STEP = 1e-4


def pseudo_experiments() -> ModuleType:
    """Import the tests' module that makes the pseudo-experiments."""
    spec = importlib.util.spec_from_file_location("pseudo", ROOT / "tests" / "recovery" / "conftest.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Bench:
    """Make cases of the pseudo-experiment, with noise."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.pseudo = folder, pseudo_experiments()
        self.curves: dict[str, Curve] = {}

    def case(self, *modes: str, noise: float = 0.0, seed: int = 0) -> Case:
        """Case with recordings of the modes; noise in percent of the peak force."""
        text = str(self.pseudo.CASE)
        rng = np.random.default_rng(seed)
        for mode in modes:
            if mode not in self.curves:
                self.curves[mode] = self.pseudo.third_order_curve(mode)
            curve = self.curves[mode]
            error = noise / 100 * np.abs(curve.force).max() * rng.standard_normal(len(curve.force))
            write_curve_csv(self.folder / f"{mode}.csv", Curve(mode, curve.displacement, curve.force + error))
            text += f'[[recordings]]\nmode = "{mode}"\nfile = "{mode}.csv"\n'
        file = self.folder / "case.toml"
        file.write_text(text, encoding="utf-8")
        return load_case(file)


def with_time(act: Callable[[], Fit]) -> tuple[Fit, float]:
    """Return the result and the wall-clock time, s."""
    begin = time.perf_counter()
    return act(), time.perf_counter() - begin


def by_differences(case: Case) -> Fit:
    """The same search with forward differences instead of exact derivatives."""
    exact = LeastSquaresProblem.jacobian

    def differences(self: LeastSquaresProblem, x: Array) -> Array:
        value = self.residual(x)
        columns = []
        for i in range(len(x)):
            moved = x.copy()
            moved[i] += STEP * max(abs(x[i]), 1e-3)
            columns.append((self.residual(moved) - value) / (moved[i] - x[i]))
        return np.column_stack(columns)

    LeastSquaresProblem.jacobian = differences  # type: ignore[method-assign]
    try:
        return identify(Task(case, "yeoh"))
    finally:
        LeastSquaresProblem.jacobian = exact  # type: ignore[method-assign]


def parameter_text(fit: Fit) -> str:
    """Parameters as short text."""
    return ", ".join(f"{estimate.value:.4f}" for estimate in fit.parameters.values())


def speed(bench: Bench) -> None:
    """Compare exact derivatives and differences in identifications; cost of derivatives."""
    print("| channels | derivatives | sweeps | forward solves | seconds | C10, C20, C30 (MPa) | rms, % |")
    print("|---|---|---|---|---|---|---|")
    for modes in (("axial",), ("axial", "torsional"), ("radial",), ("axial", "radial")):
        case = bench.case(*modes)
        runs: dict[str, Callable[[], Fit]] = {
            "exact": lambda case=case: identify(Task(case, "yeoh")),  # type: ignore[misc]
            "differences": lambda case=case: by_differences(case),  # type: ignore[misc]
        }
        for name, act in runs.items():
            fit, seconds = with_time(act)
            rms = ", ".join(f"{curve.rms_percent:.3f}" for curve in fit.curves)
            print(
                f"| {', '.join(modes)} | {name} | {fit.sweeps} | {fit.forward_solves} | {seconds:.1f} "
                f"| {parameter_text(fit)} | {rms} |",
                flush=True,
            )
    print(
        "\n| mode | forward solve, s | with three sensitivities, s | sensitivities / solve |\n|---|---|---|---|"
    )
    for mode in ("axial", "torsional", "radial"):
        (channel,), _ = Task(bench.case(mode), "yeoh").channels()
        channel.model.set_parameters(bench.pseudo.TRUTH)
        bare, whole = (least_time(channel, names) for names in ((), tuple(bench.pseudo.TRUTH)))
        print(f"| {mode} | {bare:.3f} | {whole:.3f} | {(whole - bare) / bare:.2f} |", flush=True)


def least_time(channel: Channel, names: tuple[str, ...]) -> float:
    """Least time of five sweeps, s."""
    times = []
    for _ in range(5):
        begin = time.perf_counter()
        sweep(channel.model, channel.targets, sensitivity=names)
        times.append(time.perf_counter() - begin)
    return min(times)


def coverage(bench: Bench, modes: tuple[str, ...], noise: float, seeds: int) -> None:
    """Print how often the 95 % intervals hold the truth.

    Two kinds: value +- 1.96 standard errors, and what the result reports, which is the profiles' intervals where one
    of the standard errors is above 20 % of its value or the search was held back by stability. Truth is what the
    default mesh finds from noise-free curves, because intervals describe noise, not the error of the mesh.
    """
    begin = time.perf_counter()
    clean = identify(Task(bench.case(*modes), "yeoh"))
    fits = []
    for seed in range(seeds):
        fits.append(identify(Task(bench.case(*modes, noise=noise, seed=seed), "yeoh")))
        print(
            f"seed {seed}: {parameter_text(fits[-1])}, failed {fits[-1].failed_solves}",
            file=sys.stderr,
            flush=True,
        )
    print(
        "| channels | noise, % | seeds | parameter | standard errors, % | reported intervals, % | profiles |"
    )
    print("|---|---|---|---|---|---|---|")
    for name in bench.pseudo.TRUTH:
        estimates = [fit.parameters[name] for fit in fits]
        truth = clean.parameters[name].value
        plain = [abs(e.value - truth) < 1.96 * e.std for e in estimates]
        whole = [
            (e.interval[0] <= truth <= e.interval[1]) if e.interval else inside
            for e, inside in zip(estimates, plain, strict=True)
        ]
        profiled = sum(e.interval is not None for e in estimates)
        print(
            f"| {', '.join(modes)} | {noise:g} | {seeds} | {name} | {100 * np.mean(plain):.0f} "
            f"| {100 * np.mean(whole):.0f} | {profiled} |"
        )
    for name in ("at_stability_limit", "beside_failure", "not_converged", "failed_solves"):
        print(f"\n{name}: {sum(any(c.name == name for c in fit.conditions) for fit in fits)} of {seeds}")
    sweeps = [np.mean([getattr(fit, name) for fit in fits]) for name in ("sweeps", "profile_sweeps")]
    failed = np.mean([sum(not np.isfinite(e.cost) for e in fit.evaluations) for fit in fits])
    print(
        f"\nsweeps of the search {sweeps[0]:.1f}, of the profiles {sweeps[1]:.1f}, failed {failed:.1f}; in the mean"
    )
    print(f"{time.perf_counter() - begin:.0f} s")


def main() -> int:
    """Run one of the benchmarks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("speed", "coverage"))
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--noise", type=float, default=1.0, help="percent of the peak force")
    parser.add_argument("--modes", default="axial,torsional")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder))
        if given.what == "speed":
            speed(bench)
        else:
            coverage(bench, tuple(given.modes.split(",")), given.noise, given.seeds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
