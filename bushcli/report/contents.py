"""Contents of the files of a result: functions that write a text, a picture or a table of curves at a path."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bushcli.recording import write_curve_csv
from bushcli.report.quantity import quantities
from bushcli.report.six import six_columns

if TYPE_CHECKING:
    from bushcli.diagnosis.result import DiagnosedChannel
    from bushcli.report.document import Picture
    from bushcli.report.folder import Content
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Simulated
    from geometry.view import View


def geometry_pictures(view: View, title: str, measures: Mapping[str, float]) -> dict[str, Content]:
    """Return the picture of a geometry as PNG and SVG.

    Parameters
    ----------
    view : View
        Faces or edges to draw, mm.
    title : str
        Title of the picture.
    measures : mapping of str to float
        Areas (mm2) and volumes (mm3) by name.
    """
    from bushcli.report.drawing.results import geometry_picture

    return drawn([geometry_picture(view, title, measures)])


def drawn(pictures: Sequence[Picture]) -> dict[str, Content]:
    """Return each picture as a PNG and an SVG file."""
    files: dict[str, Content] = {f"{one.name}.png": data_file(one.png) for one in pictures}
    return files | {f"{one.name}.svg": data_file(one.svg) for one in pictures}


def text_file(content: str) -> Callable[[Path], None]:
    """Return a function that writes a text at a path."""
    return data_file(content.encode())


def data_file(content: bytes) -> Callable[[Path], None]:
    """Return a function that writes bytes at a path."""

    def write(path: Path) -> None:
        path.write_bytes(content)

    return write


def curve_table(channel: Simulated) -> Callable[[Path], None]:
    """Return the simulated curve of a channel as CSV; for a path of six motions, all motions and reactions."""
    if channel.six is not None:
        return number_table(*six_columns(channel.six))
    return lambda path: write_curve_csv(path, channel.curve)


def comparison_table(channel: Simulated, found: Misfit) -> Callable[[Path], None]:
    """Return recorded and simulated force at the recorded displacements, in the order of the recording.

    Parameters
    ----------
    channel : Simulated
        The simulated channel.
    found : Misfit
        Its misfit.
    """
    shown = quantities(channel.mode)
    q, force = shown.csv_names
    return number_table(
        (q, f"recorded_{force}", f"simulated_{force}"),
        (shown.shown(found.displacement), found.simulated - found.difference, found.simulated),
    )


def diagnosed_table(
    channel: DiagnosedChannel, missing: np.ndarray[Any, Any] | None = None
) -> Callable[[Path], None]:
    """Return recorded force, forces of plain law and most probable model, missing force, and a mark of faulty samples.

    The first column is the time, if the recording has time.

    Parameters
    ----------
    channel : DiagnosedChannel
        The diagnosed channel.
    missing : (n,) array or None
        Force that no known effect explains, N or N mm.
    """
    shown = quantities(channel.mode)
    q, force = shown.csv_names
    recorded = channel.recording
    names = [q, f"recorded_{force}", f"plain_{force}", f"final_{force}"]
    columns = [shown.shown(recorded.displacement), recorded.force, channel.before, channel.after]
    if missing is not None:
        names, columns = [*names, f"missing_{force}"], [*columns, missing]
    names, columns = [*names, "faulty"], [*columns, channel.faulty.astype(float)]
    if recorded.time is not None:
        names, columns = ["time_s", *names], [recorded.time, *columns]
    return number_table(names, columns)


def number_table(names: Sequence[str], columns: Sequence[np.ndarray[Any, Any]]) -> Callable[[Path], None]:
    """Return a table as CSV, with twelve significant digits.

    Parameters
    ----------
    names : sequence of str
        Names of the columns.
    columns : sequence of (n,) array
        One array per column, in the unit that its name gives.
    """
    rows = "".join(",".join(f"{value:.12g}" for value in row) + "\n" for row in np.column_stack(columns))
    return text_file(",".join(names) + "\n" + rows)
