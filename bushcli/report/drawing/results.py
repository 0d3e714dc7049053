"""The pictures of each result, for its folder and its page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.document import Panels, Picture
from bushcli.report.drawing.body import deformed_figure, mesh_figure
from bushcli.report.drawing.geometry import geometry_figure
from bushcli.report.drawing.picture import picture, plotted
from bushcli.report.drawing.projection import is_twisted
from bushcli.report.plots.direct import capital
from bushcli.report.quantity import listed, quantities

if TYPE_CHECKING:
    from bushcli.diagnosis.result import Diagnosis
    from bushcli.inverse import Fit
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep
    from bushcli.report.cycles import ChannelHistory
    from bushcli.simulate.dynamic import DynamicResponse
    from bushcli.simulate.dynamic_tables import ComparedTable
    from bushcli.simulate.meshes import Meshed
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response, Simulated
    from bushcli.study.batch import Batch
    from bushcli.study.compare import Comparison
    from bushcli.study.study import Study
    from cases.stretches import Surface
    from geometry.view import View

# Title of the picture of a geometry file.
INTERPRETED = "How the file was interpreted"


def direct_figures(
    response: Response,
    misfits: Mapping[str, Misfit],
    fit: Fit | None,
    names: Mapping[str, str],
    tables: Sequence[ComparedTable] = (),
) -> tuple[Picture, ...]:
    """Return curves, tables, coupons, deformed shapes and meshes of a direct prediction."""
    from bushcli.report.cycles import response_histories
    from bushcli.report.plots.cycles import history_panels
    from bushcli.report.plots.direct import curve_panels, six_panels
    from bushcli.report.plots.dynamic_tables import table_panels
    from bushcli.report.plots.fit import fit_panels

    panels: list[Panels] = []
    for channel in response.channels:
        file = names[channel.name]
        if channel.six is not None and len(channel.six.time) > 1:
            panels.append(six_panels(channel.name, channel.six, file))
        panels.append(curve_panels(channel, misfits.get(channel.name), file))
    panels += history_panels(response_histories(response, misfits), names)
    panels += [table_panels(one, names[one.table.name]) for one in tables]
    if fit is not None:
        panels.append(fit_panels(fit))
    pictures = [plotted(one) for one in panels]
    shape = response.case.geometry
    if shape.view is not None:
        pictures.append(geometry_picture(shape.view, INTERPRETED, shape.measures()))
    return (*pictures, *_bodies(response.channels, names))


def batch_figures(found: Batch) -> tuple[Picture, ...]:
    """Return the curves of a batch's parts, with mean and tolerance band."""
    from bushcli.report.plots.batch import batch_panels

    return tuple(map(plotted, batch_panels(found)))


def compare_figures(found: Comparison) -> tuple[Picture, ...]:
    """Return the curves of results over each other."""
    from bushcli.report.plots.compare import compare_panels

    return tuple(map(plotted, compare_panels(found)))


def dynamic_figures(response: DynamicResponse, names: Mapping[str, str]) -> tuple[Picture, ...]:
    """Return stiffness and loss angle over frequency, a picture for each load case.

    Parameters
    ----------
    response : DynamicResponse
    names : mapping of str to str
        File name by name of the load case.
    """
    from bushcli.report.plots.dynamic import dynamic_panels

    return tuple(
        plotted(dynamic_panels([one for one in response.curves if one.name == name], file))
        for name, file in names.items()
    )


def _bodies(channels: Sequence[Simulated], names: Mapping[str, str]) -> list[Picture]:
    """Return the deformed shape of each channel, and each mesh once."""
    pictures: list[Picture] = []
    drawn: list[Surface] = []
    for channel in channels:
        if channel.surface is None:
            continue
        title, file = _deformed_title(channel, channel.surface), names[channel.name]
        figure = deformed_figure(channel.surface, title, _note(channel.surface, deformed=True))
        pictures.append(picture(f"{file}-deformed", "deformed", title, figure, channel.name))
        if any(_same(channel.surface, other) for other in drawn):
            continue
        drawn.append(channel.surface)
        served = [c.name for c in channels if c.surface is not None and _same(channel.surface, c.surface)]
        title = f"Mesh for {listed(served)}"
        figure = mesh_figure(channel.surface, title, _note(channel.surface))
        pictures.append(picture(f"{file}-mesh", "mesh", title, figure, channel.name))
    return pictures


def fit_figures(fit: Fit) -> tuple[Picture, ...]:
    """Return the picture of the coupons of a fit."""
    from bushcli.report.plots.fit import fit_panels

    return (plotted(fit_panels(fit)),)


def spectrum_figures(
    found: Sequence[TableSpectrum | TableSweep], names: Mapping[str, str]
) -> tuple[Picture, ...]:
    """Return the master curve of each table of moduli, or its moduli over amplitude.

    Parameters
    ----------
    found : sequence of TableSpectrum or TableSweep
    names : mapping of str to str
        File name by name of the table.
    """
    from bushcli.inverse.coupon_tables import TableSweep
    from bushcli.report.plots.spectrum import master_panels, sweep_panels

    def panels(one: TableSpectrum | TableSweep) -> Panels:
        file = names[one.table.name]
        return sweep_panels(one, file) if isinstance(one, TableSweep) else master_panels(one, file)

    return tuple(plotted(panels(one)) for one in found)


def mesh_figures(meshes: Sequence[Meshed]) -> tuple[Picture, ...]:
    """Return one picture for each mesh."""
    found = []
    for mesh in meshes:
        if mesh.surface is not None:
            title = f"Mesh for {listed(list(mesh.modes))}: {mesh.cells} elements"
            figure = mesh_figure(mesh.surface, title, _note(mesh.surface))
            found.append(picture(f"mesh-{mesh.name}", "mesh", title, figure))
    return tuple(found)


def geometry_picture(view: View, title: str, measures: Mapping[str, float]) -> Picture:
    """Return the picture of the interpretation of a geometry."""
    return picture("geometry", "geometry", title, geometry_figure(view, title, measures))


def inverse_figures(fits: Sequence[Fit], names: Mapping[str, str]) -> tuple[Picture, ...]:
    """Return curves, search, certainty and, for several laws, their ranking; the best law first."""
    from bushcli.report.plots.fit import inverse_panels

    return tuple(plotted(one) for one in inverse_panels(fits, names))


def history_figures(histories: Sequence[ChannelHistory], names: Mapping[str, str]) -> tuple[Picture, ...]:
    """Return a picture of the loops of each channel, and one of its holds where the recording has time."""
    from bushcli.report.plots.cycles import history_panels

    return tuple(plotted(one) for one in history_panels(histories, names))


def diagnosis_figures(found: Diagnosis, names: Mapping[str, str]) -> tuple[Picture, ...]:
    """Return every picture of a diagnosis."""
    from bushcli.report.drawing.bushing_map import map_figure, map_title
    from bushcli.report.plots import certainty, diagnosis, places

    panels: list[Panels] = []
    if found.probability and found.models:
        panels.append(certainty.probability_panels(found))
    if priors := certainty.prior_panels(found):
        panels.append(priors)
    for channel in found.channels:
        file = names[channel.name]
        panels.append(diagnosis.diagnosed_panels(found, channel, file))
        # A held-out channel is not fitted and may have no bins.
        if any(one.channel == channel.name for one in found.location.bins):
            panels.append(places.record_panels(found, channel, file))
        profiles = [] if found.missing is None else found.missing.profiles
        if own := [one for one in profiles if one.channel == channel.name]:
            panels.append(places.missing_panels(channel, own, file))
    pictures = [plotted(one) for one in panels]
    for one in found.maps:
        file = f"{names[one.name]}-bushing-map"
        pictures.append(picture(file, "bushing_map", map_title(one), map_figure(one), one.name))
    if found.next_test is not None:
        pictures.append(plotted(places.next_test_panels(found, found.next_test)))
    return tuple(pictures)


def study_figures(found: Study) -> tuple[Picture, ...]:
    """Return all pictures of a study."""
    from bushcli.report.plots.study import study_panels

    return tuple(plotted(one) for one in study_panels(found))


def _deformed_title(channel: Simulated, surface: Surface) -> str:
    name = capital(channel.name)
    if channel.in_time:
        return f"{name}: deformed at {surface.displacement:.3g} s"
    shown = quantities(channel.mode)
    reached = f"{float(f'{shown.at(surface.displacement):.3g}'):g}"
    unit = f" {shown.displacement_unit}" if shown.displacement_unit else ""
    return f"{name}: deformed at {'' if unit else 'stretch '}{reached}{unit}"


def _note(surface: Surface, deformed: bool = False) -> str:
    """Return the small print of a picture: where the body is cut, and that the scale is true."""
    low = surface.reference.reshape(-1, 3).min(axis=0)
    high = surface.reference.reshape(-1, 3).max(axis=0)
    scale = "true scale; dashed: before the load" if deformed else "true scale"
    if np.isclose(low[1], high[1]):
        twisted = deformed and is_twisted(surface)
        return f"{'a quarter is left open' if twisted else 'section'}; {scale}"
    small = 1e-3 * (high - low)
    ends = zip("xyz", low, high, small, strict=True)
    cut = [f"{axis} = 0" for axis, a, b, s in ends if abs(a) < s or abs(b) < s]
    return f"cut at {listed(cut)} by symmetry; {scale}" if cut else scale


def _same(one: Surface, other: Surface) -> bool:
    return one is other or (
        one.reference.shape == other.reference.shape and np.allclose(one.reference, other.reference)
    )
