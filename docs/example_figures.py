"""The pictures of the examples in README and docs, from the commands that the pages show.

``setup/enter python docs/example_figures.py [NAME...]``; the diagnosis of the CAD example takes minutes.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
DIRECT = "direct examples/batch/case.toml"
IDENTIFIED = "inverse examples/batch/case.toml --model yeoh"
CAD = "diagnose examples/cad/case.toml --hold-out axial --effects misalignment,dimension,cure_shrinkage"
# Picture of the docs -> the command, and the picture that it writes.
PICTURES = {
    "radial-curve": (DIRECT, "radial-curve"),
    "radial-deformed": (DIRECT, "radial-deformed"),
    "coupons": ("fit examples/batch/case.toml", "coupons"),
    "identification-convergence": (IDENTIFIED, "convergence"),
    "identification-profiles": (IDENTIFIED, "profiles"),
    "identification-radial-identified": (IDENTIFIED, "radial-identified"),
    "kidney-geometry": ("mesh examples/cad/bushing.step", "geometry"),
    "cad-diagnosis": (CAD, "radial-diagnosis"),
    "cad-map": (CAD, "radial-bushing-map"),
}
# Pixels; a page shows no more.
WIDTH = 1000


def main(names: list[str]) -> None:
    """Run the command of each picture once, and write the pictures with a palette, which is a third of the size."""
    chosen = {name: PICTURES[name] for name in names or PICTURES}
    with TemporaryDirectory() as temporary:
        for number, command in enumerate(dict.fromkeys(command for command, _ in chosen.values())):
            out = Path(temporary) / str(number)
            arguments = [*shlex.split(command), "-q", "-o", str(out)]
            subprocess.run(
                [sys.executable, "-m", "bushcli.cli", *arguments],
                cwd=ROOT,
                check=True,
                stdout=subprocess.DEVNULL,
            )
            for name, (of, picture) in chosen.items():
                if of == command:
                    image = Image.open(out / f"{picture}.png").convert("RGB")
                    image.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
                    image.quantize(256).save(ROOT / "docs" / "pictures" / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
