"""The pictures of results that are more than plots: bodies, maps, interpretations of geometry files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.document import Panels, Picture
from bushcli.report.drawing.body import deformed_figure, mesh_figure
from bushcli.report.drawing.geometry import geometry_figure
from bushcli.report.drawing.picture import draw_panels, picture
from bushcli.report.plots.direct import capital
from bushcli.report.quantity import join_names, quantities

if TYPE_CHECKING:
    from bushcli.diagnosis.result import Diagnosis
    from bushcli.report.results import DirectResult
    from bushcli.simulate.meshes import Meshed
    from cases.stretches import Surface
    from geometry.shape import Shape
    from geometry.view import View

# Title of the picture of a geometry file.
INTERPRETED = "How the file was interpreted"


def pictures_of(plots: Iterable[Panels | Picture]) -> list[Picture]:
    """Return the plots as pictures."""
    return [draw_panels(plot) if isinstance(plot, Panels) else plot for plot in plots]


def direct_pictures(result: DirectResult, names: Mapping[str, str]) -> Iterator[Panels | Picture]:
    """Yield curves, tables, coupons, the deformed shape of each channel, and each mesh once."""
    from bushcli.report.plots.cycles import history_panels
    from bushcli.report.plots.direct import curve_panels, six_panels
    from bushcli.report.plots.dynamic import table_panels
    from bushcli.report.plots.fit import fit_panels

    response = result.response
    for channel in response.channels:
        file = names[channel.name]
        if channel.six is not None and len(channel.six.time) > 1:
            yield six_panels(channel.name, channel.six, file)
        yield curve_panels(channel, result.misfits.get(channel.name), file)
    yield from history_panels(result.histories, names)
    yield from (table_panels(compared, names[compared.table.name]) for compared in result.tables or ())
    if result.fit is not None:
        yield fit_panels(result.fit)
    yield from _interpretation(response.case.geometry)
    meshes: list[Surface] = []
    for channel in response.channels:
        if channel.surface is None:
            continue
        units, at, file = quantities(channel.mode), channel.surface.displacement, names[channel.name]
        value = f"{float(f'{units.at(at):.3g}'):g}"
        reached = f"{value} {units.displacement_unit}" if units.displacement_unit else f"stretch {value}"
        title = f"{capital(channel.name)}: deformed at {f'{at:.3g} s' if channel.in_time else reached}"
        figure = deformed_figure(channel.surface, title)
        yield picture(f"{file}-deformed", "deformed", title, figure, channel.name)
        if any(_same(channel.surface, other) for other in meshes):
            continue
        meshes.append(channel.surface)
        with_surface = [other for other in response.channels if other.surface is not None]
        served = [other.name for other in with_surface if _same(channel.surface, other.surface)]  # type: ignore[arg-type]
        title = f"Mesh for {join_names(served)}"
        yield picture(f"{file}-mesh", "mesh", title, mesh_figure(channel.surface, title), channel.name)


def mesh_pictures(shape: Shape, meshes: Sequence[Meshed]) -> Iterator[Picture]:
    """Yield the interpretation of a geometry file, and each mesh."""
    yield from _interpretation(shape)
    for mesh in meshes:
        if mesh.surface is not None:
            title = f"Mesh for {join_names(list(mesh.modes))}: {mesh.cells} elements"
            yield picture(f"mesh-{mesh.name}", "mesh", title, mesh_figure(mesh.surface, title))


def geometry_picture(view: View, title: str, measures: Mapping[str, float]) -> Picture:
    """Return the picture of the interpretation of a geometry."""
    return picture("geometry", "geometry", title, geometry_figure(view, title, measures))


def _interpretation(shape: Shape) -> Iterator[Picture]:
    if shape.view is not None:
        yield geometry_picture(shape.view, INTERPRETED, shape.measures())


def diagnosis_pictures(diagnosis: Diagnosis, names: Mapping[str, str]) -> Iterator[Panels | Picture]:
    """Yield every picture of a diagnosis."""
    from bushcli.report.drawing.bushing_map import map_figure, map_title
    from bushcli.report.plots import certainty, dynamic, places
    from bushcli.report.plots.diagnosis import diagnosed_panels

    if diagnosis.probability and diagnosis.models:
        yield certainty.probability_panels(diagnosis)
    if priors := certainty.prior_panels(diagnosis):
        yield priors
    for channel in diagnosis.channels:
        file = names[channel.name]
        yield diagnosed_panels(diagnosis, channel, file)
        # A held-out channel is not fitted and may have no bins.
        if any(bin_.channel == channel.name for bin_ in diagnosis.location.bins):
            yield places.record_panels(diagnosis, channel, file)
        profiles = [] if diagnosis.missing is None else diagnosis.missing.profiles
        if channel_profiles := [profile for profile in profiles if profile.channel == channel.name]:
            yield places.missing_panels(channel, channel_profiles, file)
    for table in diagnosis.tables:
        yield dynamic.table_panels(table.compared, names[table.name])
    for local_map in diagnosis.maps:
        file = f"{names[local_map.name]}-bushing-map"
        yield picture(file, "bushing_map", map_title(local_map), map_figure(local_map), local_map.name)
    if diagnosis.next_test is not None and not diagnosis.next_test.frequency:
        yield places.next_test_panels(diagnosis, diagnosis.next_test)


def _same(surface: Surface, other: Surface) -> bool:
    return surface is other or (
        surface.reference.shape == other.reference.shape and np.allclose(surface.reference, other.reference)
    )
