"""A case file to go on with, from a part alone."""

from __future__ import annotations

import os
from pathlib import Path

from bushcli.case.case import Case

_TEXT = """\
title = "{title}"

[geometry]
shape = "{shape}"
file = "{file}"
# What was found in it (see geometry.png); keys of [geometry] change it, bushcli list shapes names them:
{notes}

[material]                  # not your rubber: put in its law and parameters, or [[coupons]]
law = "neo_hookean"
[material.parameters]
C10 = 0.5

[[load_cases]]
mode = "axial"
amplitude = {axial:.2g}
steps = 10

[[load_cases]]
mode = "radial"
amplitude = {radial:.2g}
steps = 10
"""


def beginning(case: Case, folder: Path) -> str:
    """Return the text of a case file in this folder.

    Raises
    ------
    GeometryError
    """
    shape = case.geometry
    file = os.path.relpath(str(getattr(shape, "file", case.path)), folder)
    reach = shape.thickness
    return _TEXT.format(
        title=case.title.replace('"', "'"),
        shape=type(shape).name,
        file=Path(file).as_posix(),
        notes="\n".join(f"#   {note}" for note in shape.notes),
        axial=0.2 * reach,
        radial=0.1 * reach,
    )
