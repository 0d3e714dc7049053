"""The text of a case file to start from, given a part alone."""

from __future__ import annotations

import os
from pathlib import Path

from bushcli.case.case import Case
from bushcli.case.identified import inline

_TEXT = """\
title = "{title}"

[geometry]
shape = "{shape}"
file = "{file}"
{chosen}# What was found in it (see geometry.png); keys of [geometry] change it, bushcli list shapes names them:
{notes}

[material]                  # placeholder: put in law and parameters of your rubber, or [[coupons]]
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


def starter_case(case: Case, folder: Path) -> str:
    """Return the text of a case file to start from, with all that was found in a geometry file.

    Parameters
    ----------
    case : Case
        Case that `load_part` made.
    folder : Path
        Folder of the case file to be, to which file names are relative.

    Raises
    ------
    GeometryError
    """
    shape = case.geometry
    file = os.path.relpath(str(getattr(shape, "file", case.path)), folder)
    measures = shape.measures()
    bonds = sum(value for name, value in measures.items() if name.endswith("_bond"))
    # Thickness of a plate of the same volume and bonds; the travels below are shares of it.
    reach = 2.0 * measures["rubber"] / bonds
    chosen = [
        f"{name} = {inline(value)}"
        for name, value in shape.model_dump(mode="json", by_alias=True, exclude_defaults=True).items()
        if name != "file"
    ]
    return _TEXT.format(
        title=case.title.replace('"', "'"),
        shape=type(shape).name,
        file=Path(file).as_posix(),
        chosen="".join(f"{line}\n" for line in chosen),
        notes="\n".join(f"#   {note}" for note in shape.notes),
        axial=0.2 * reach,
        radial=0.1 * reach,
    )
