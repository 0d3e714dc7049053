"""The picture of docs/filled-rubber.md: ``python docs/filled_rubber_figure.py LOOPS VIBRATIONS``, two results."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt


def read(file: Path) -> np.ndarray:
    """Return a CSV table with its names."""
    return np.genfromtxt(file, delimiter=",", names=True)


def main(direct: Path, dynamic: Path) -> None:
    """Draw loops, a hold, and stiffness and loss angle over frequency and amplitude."""
    figure, axes = plt.subplots(2, 2, figsize=(9.0, 6.6), layout="constrained")
    loops, hold, over_frequency, over_amplitude = axes.ravel()
    for name, label, colour in (("axial-1", "0.2 mm/s", "#1f5f99"), ("axial-2", "2 mm/s", "#c0562b")):
        table = read(direct / f"{name}.csv")
        loops.plot(table["displacement_mm"], table["force_N"] / 1000, label=label, color=colour, lw=1.2)
    loops.set(xlabel="displacement, mm", ylabel="force, kN", title="Two cycles")
    table = read(direct / "axial-3.csv")
    held = table["displacement_mm"] == table["displacement_mm"].max()
    time = table["time_s"] - table["time_s"][held].min()
    hold.semilogx(time[held][1:], table["force_N"][held][1:] / 1000, "o-", ms=3, color="#1f5f99")
    hold.set(xlabel="time after the ramp, s", ylabel="force, kN", title="A hold at 4 mm")
    table = read(dynamic / "axial-dynamic.csv")
    for k, amplitude in enumerate((0.02, 0.2, 2.0)):
        rows = table[np.isclose(table["amplitude_mm"], amplitude)]
        colour = f"C{k}"
        size, angle = rows["stiffness_N_per_mm"], rows["loss_angle_deg"]
        over_frequency.loglog(rows["frequency_Hz"], size, color=colour, label=f"{amplitude:g} mm")
        over_frequency.text(
            rows["frequency_Hz"][-1], size[-1], f" {angle[-1]:.1f}°", color=colour, va="center", fontsize=8
        )
        over_frequency.text(
            rows["frequency_Hz"][0],
            size[0],
            f"{angle[0]:.1f}° ",
            color=colour,
            va="center",
            ha="right",
            fontsize=8,
        )
    over_frequency.margins(x=0.15)
    over_frequency.set(
        xlabel="frequency, Hz", ylabel="|K*|, N/mm", title="Frequency, with loss angles at the ends"
    )
    angles = over_amplitude.twinx()
    for k, frequency in enumerate((0.1, 1.0, 100.0)):
        rows = table[np.isclose(table["frequency_Hz"], frequency)]
        over_amplitude.semilogx(
            rows["amplitude_mm"], rows["stiffness_N_per_mm"], color=f"C{k}", label=f"{frequency:g} Hz"
        )
        angles.semilogx(rows["amplitude_mm"], rows["loss_angle_deg"], color=f"C{k}", ls=":")
    angles.set_ylabel("loss angle, degrees (dotted)")
    over_amplitude.set(xlabel="amplitude, mm", ylabel="|K*|, N/mm", title="Amplitude")
    for one in (loops, over_frequency, over_amplitude):
        one.legend(frameon=False, fontsize=8)
    for one in axes.ravel():
        one.spines["top"].set_visible(False)
        one.grid(color="0.92", lw=0.6)
    figure.savefig(Path(__file__).with_name("pictures") / "filled-rubber.png", dpi=110)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
