"""The pictures of docs/effects.md: what each effect does to a curve. ``setup/enter python docs/effect_figures.py``."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np

from bushcli.case.unit import case_file_value
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects
from bushcli.effects.rig import measured_stiffness
from bushcli.report.drawing.looks import AMBER, BLUE
from bushcli.report.quantity import quantities
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law
from geometry.shape import Refinement, shapes

mpl.use("Agg")
import matplotlib.pyplot as plt

PICTURES = Path(__file__).with_name("pictures")
BUSHING = {"inner_radius": 9.0, "outer_radius": 18.0, "length": 34.0}
YEOH = {"C10": 0.5, "C20": -0.04, "C30": 0.007}


def program(mode: str) -> tuple[np.ndarray, np.ndarray]:
    """Time (s) and displacement (mm or rad): two equal cycles, a larger one, one to the other side, and a hold."""
    a = {"axial": 6.0, "torsional": 0.5}.get(mode, 2.0)
    points = [0, 0.5 * a, 0, 0.5 * a, 0, a, 0, -0.8 * a, 0, 0.7 * a, 0.7 * a, 0]
    seconds = [10.0 * abs(q - p) / a for p, q in pairwise(points)]
    seconds[9] = 40.0
    time = np.concatenate([[0.0], np.cumsum(seconds)])
    fine = np.unique(np.concatenate([np.linspace(s, t, 13) for s, t in pairwise(time)]))
    return fine, np.interp(fine, time, points)


def main(names: list[str]) -> None:
    """Draw the effects named, or all."""
    shape = shapes()["plain"](**BUSHING)
    rubber = Rubber(law("yeoh"), YEOH, 2000.0)
    for name in names or list(effects()):
        if (shown := effects()[name].shown) is None:
            continue
        mode, values = shown
        if "static" not in effects()[name].kinds:
            draw_table(name, values)
            continue
        time, q = program(mode)
        active = ActiveEffect(effects()[name], values)
        curves = {
            label: Simulation(shape, modes()[mode], rubber, Refinement(), acts, time, q, None).solve({}).force
            for label, acts in (("plain law", [active.off()]), (name, [active]))
        }
        figure, axes = plt.subplots(figsize=(5.2, 3.4), layout="constrained")
        for (label, force), style in zip(
            curves.items(), ({"color": AMBER[0], "lw": 1.4}, {"color": BLUE[0], "lw": 1.4}), strict=True
        ):
            axes.plot(quantities(mode).per_internal * q, force / 1000.0, label=label, **style)
        axes.axhline(0.0, color="0.85", lw=0.8, zorder=0)
        axes.axvline(0.0, color="0.85", lw=0.8, zorder=0)
        turned = modes()[mode].rotational
        axes.set_xlabel("angle, degrees" if turned else "displacement, mm")
        axes.set_ylabel("torque, N m" if turned else "force, kN")
        told = ", ".join(
            f"{key} = {case_file_value(effects()[name].parameter(key), value, turned)}"
            for key, value in values.items()
        )
        axes.set_title(f"{mode}: {told}", fontsize=9, wrap=True)
        axes.legend(frameon=False, fontsize=9)
        axes.spines[["top", "right"]].set_visible(False)
        figure.savefig(PICTURES / f"effect-{name}.png", dpi=110)
        plt.close(figure)
        sys.stdout.write(f"{name}\n")


def draw_table(name: str, values: dict[str, float]) -> None:
    """Draw what an effect that acts on tables alone does to a dynamic stiffness."""
    frequency = np.linspace(1.0, 250.0, 200)
    turned = 2j * np.pi * frequency * 0.004
    part = 400.0 * (1.0 + 0.3 * turned / (1.0 + turned))
    seen = measured_stiffness([ActiveEffect(effects()[name], values)], part, frequency, 0.0, 0.0).value
    figure, axes = plt.subplots(2, 1, figsize=(5.2, 3.8), layout="constrained", sharex=True)
    for stiffness, label, style in (
        (part, "bushing", {"color": AMBER[0], "lw": 1.4}),
        (seen, name, {"color": BLUE[0], "lw": 1.4}),
    ):
        axes[0].plot(frequency, np.abs(stiffness), label=label, **style)
        axes[1].plot(frequency, np.degrees(np.angle(stiffness)), **style)
    axes[0].set_ylabel("|K*|, N/mm")
    axes[1].set_ylabel("loss angle, degrees")
    axes[1].set_xlabel("frequency, Hz")
    axes[0].set_title(", ".join(f"{key} = {value:g}" for key, value in values.items()), fontsize=9)
    axes[0].legend(frameon=False, fontsize=9)
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
    figure.savefig(PICTURES / f"effect-{name}.png", dpi=110)
    plt.close(figure)
    sys.stdout.write(f"{name}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
