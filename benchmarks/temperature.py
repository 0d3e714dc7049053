"""Tensile tests at several temperatures and rates in one file -> coupons and a case for `bushcli fit`.

python -m benchmarks.temperature loading.csv FOLDER ID,ID,...

The file is not part of the project (VHB 4905, collected by miguelmaso/HyperCalibration.jl): id; description;
temperature, K; rate, 1/s; stretch; stress, Pa, with decimal commas. The curves named are fitted, each as far as it is
loaded; the command that holds out the others is printed. `payne.md` has what was measured.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

#: Relaxation times, s, a branch per decade, with start values of g.
BRANCHES = {0.1: 3.0, 1.0: 1.0, 10.0: 0.5, 100.0: 0.3, 1000.0: 0.1, 10000.0: 0.1}
CASE = """title = "{name}"
[geometry]
shape = "coupon"
[material]
law = "yeoh"
[[effects]]
name = "viscoelasticity"
parameters = {{ {branches} }}
[[effects]]
name = "temperature"
parameters = {{ shift = "wlf", C1 = 6.0, C2 = 100.0, exponent = 1.0 }}
"""
COUPON = """[[coupons]]
mode = "uniaxial"
file = "{name}.csv"
name = "{name}"
temperature = {temperature:.2f}
"""


def split(file: Path, folder: Path, fitted: list[str]) -> str:
    """Write the coupons and the case, and return the command that fits it."""
    rows = [line.split(";") for line in file.read_text(encoding="latin-1").splitlines()[1:]]
    folder.mkdir(parents=True, exist_ok=True)
    # The stiffest branches are the last: only those may be a thousand times as stiff as the relaxed rubber.
    order = sorted(BRANCHES, key=lambda tau: -tau if tau >= 10.0 else 1.0 - tau)
    branches = ", ".join(f"g{i} = {BRANCHES[tau]}, tau{i} = {tau}" for i, tau in enumerate(order, 1))
    text, held = CASE.format(name=file.parent.name, branches=branches), []
    for number in dict.fromkeys(row[0] for row in rows):
        values = [[float(cell.replace(",", ".")) for cell in row[2:]] for row in rows if row[0] == number]
        kelvin, rate, stretch, stress = np.array(values).T
        last = int(np.argmax(stretch))
        rising = np.flatnonzero(np.diff(np.maximum.accumulate(stretch[: last + 1]), prepend=0.0) > 1e-4)
        time = (stretch[rising] - min(1.0, stretch[rising][0])) / rate[0]
        name = f"curve{number}"
        lines = zip(time, stretch[rising], 1e-6 * stress[rising], strict=True)
        table = "".join(f"{t:.8g},{x:.8g},{s:.8g}\n" for t, x, s in lines)
        (folder / f"{name}.csv").write_text("time_s,stretch,nominal_stress_MPa\n" + table)
        text += COUPON.format(name=name, temperature=kelvin[0] - 273.15)
        held += [] if number in fitted else [name]
    (folder / "case.toml").write_text(text)
    # The exponent of an ideal network: free, it goes to -2, and C2 to 30 K.
    fixed = "viscoelasticity.tau,temperature.exponent"
    options = f"--hold-out {','.join(held)} --fix {fixed} --weighting absolute"
    return f"bushcli fit {folder / 'case.toml'} {options}"


if __name__ == "__main__":
    print(split(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3].split(",")))
