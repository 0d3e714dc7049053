"""The pictures of results that are more than plots: bodies, maps, interpretations of geometry files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.document import Panels, Picture
from bushcli.report.drawing.body import deformed_figure, mesh_figure
from bushcli.report.drawing.geometry import geometry_figure
from bushcli.report.drawing.picture import picture, plotted
from bushcli.report.plots.direct import capital
from bushcli.report.quantity import listed, quantities

if TYPE_CHECKING:
    from bushcli.diagnosis.result import Diagnosis
    from bushcli.report.results import DirectResult
    from bushcli.simulate.meshes import Meshed
    from cases.stretches import Surface
    from geometry.shape import Shape
    from geometry.view import View

# Title of the picture of a geometry file.
INTERPRETED = "How the file was interpreted"


def drawn(found: Iterable[Panels | Picture]) -> list[Picture]:
    """Return the plots as pictures."""
    return [plotted(one) if isinstance(one, Panels) else one for one in found]


def direct_pictures(found: DirectResult, names: Mapping[str, str]) -> Iterator[Panels | Picture]:
    """Yield curves, tables, coupons, the deformed shape of each channel, and each mesh once."""
    from bushcli.report.plots.cycles import history_panels
    from bushcli.report.plots.direct import curve_panels, six_panels
    from bushcli.report.plots.dynamic import table_panels
    from bushcli.report.plots.fit import fit_panels

    response = found.response
    for channel in response.channels:
        file = names[channel.name]
        if channel.six is not None and len(channel.six.time) > 1:
            yield six_panels(channel.name, channel.six, file)
        yield curve_panels(channel, found.misfits.get(channel.name), file)
    yield from history_panels(found.histories, names)
    yield from (table_panels(one, names[one.table.name]) for one in found.tables or ())
    if found.fit is not None:
        yield fit_panels(found.fit)
    yield from _interpretation(response.case.geometry)
    meshes: list[Surface] = []
    for channel in response.channels:
        if channel.surface is None:
            continue
        shown, at, file = quantities(channel.mode), channel.surface.displacement, names[channel.name]
        reached = f"{at:.3g} s"
        if not channel.in_time:
            value = f"{float(f'{shown.at(at):.3g}'):g}"
            reached = f"{value} {shown.displacement_unit}" if shown.displacement_unit else f"stretch {value}"
        title = f"{capital(channel.name)}: deformed at {reached}"
        figure = deformed_figure(channel.surface, title)
        yield picture(f"{file}-deformed", "deformed", title, figure, channel.name)
        if any(_same(channel.surface, other) for other in meshes):
            continue
        meshes.append(channel.surface)
        drawn = [one for one in response.channels if one.surface is not None]
        served = [one.name for one in drawn if _same(channel.surface, one.surface)]  # type: ignore[arg-type]
        title = f"Mesh for {listed(served)}"
        yield picture(f"{file}-mesh", "mesh", title, mesh_figure(channel.surface, title), channel.name)


def mesh_pictures(shape: Shape, meshes: Sequence[Meshed]) -> Iterator[Picture]:
    """Yield the interpretation of a geometry file, and each mesh."""
    yield from _interpretation(shape)
    for mesh in meshes:
        if mesh.surface is not None:
            title = f"Mesh for {listed(list(mesh.modes))}: {mesh.cells} elements"
            yield picture(f"mesh-{mesh.name}", "mesh", title, mesh_figure(mesh.surface, title))


def geometry_picture(view: View, title: str, measures: Mapping[str, float]) -> Picture:
    """Return the picture of the interpretation of a geometry."""
    return picture("geometry", "geometry", title, geometry_figure(view, title, measures))


def _interpretation(shape: Shape) -> Iterator[Picture]:
    if shape.view is not None:
        yield geometry_picture(shape.view, INTERPRETED, shape.measures())


def diagnosis_pictures(found: Diagnosis, names: Mapping[str, str]) -> Iterator[Panels | Picture]:
    """Yield every picture of a diagnosis."""
    from bushcli.report.drawing.bushing_map import map_figure, map_title
    from bushcli.report.plots import certainty, diagnosis, dynamic, places

    if found.probability and found.models:
        yield certainty.probability_panels(found)
    if priors := certainty.prior_panels(found):
        yield priors
    for channel in found.channels:
        file = names[channel.name]
        yield diagnosis.diagnosed_panels(found, channel, file)
        # A held-out channel is not fitted and may have no bins.
        if any(one.channel == channel.name for one in found.location.bins):
            yield places.record_panels(found, channel, file)
        profiles = [] if found.missing is None else found.missing.profiles
        if own := [one for one in profiles if one.channel == channel.name]:
            yield places.missing_panels(channel, own, file)
    for table in found.tables:
        yield dynamic.table_panels(table.compared, names[table.name])
    for local in found.maps:
        file = f"{names[local.name]}-bushing-map"
        yield picture(file, "bushing_map", map_title(local), map_figure(local), local.name)
    if found.next_test is not None and not found.next_test.frequency:
        yield places.next_test_panels(found, found.next_test)


def _same(one: Surface, other: Surface) -> bool:
    return one is other or (
        one.reference.shape == other.reference.shape and np.allclose(one.reference, other.reference)
    )
