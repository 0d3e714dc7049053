"""Pictures of results: every figure of a command, drawn and saved as PNG and SVG in memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bushcli.inverse import Fit
from bushcli.report.cycles import response_histories
from bushcli.report.figures.body import deformed_figure, mesh_figure
from bushcli.report.figures.coupons import coupon_figure, coupon_title
from bushcli.report.figures.curves import curve_figure, curve_title
from bushcli.report.figures.cycles import history_figures
from bushcli.report.figures.geometry import geometry_figure
from bushcli.report.figures.picture import Picture, picture
from bushcli.report.figures.projection import is_twisted
from bushcli.report.figures.six import six_figure, six_title
from bushcli.report.quantity import listed, quantities
from bushcli.simulate.meshes import Meshed
from bushcli.simulate.misfit import Misfit
from bushcli.simulate.response import Response, Simulated
from cases.stretches import Surface
from geometry.view import View

# Title of the picture of a geometry file.
INTERPRETED = "How the file was interpreted"

__all__ = ["Picture", "direct_figures", "fit_figures", "geometry_picture", "mesh_figures"]


def direct_figures(
    response: Response, misfits: Mapping[str, Misfit], fit: Fit | None, names: Mapping[str, str]
) -> tuple[Picture, ...]:
    """Return curves, coupons, deformed shapes and meshes of a direct prediction.

    Parameters
    ----------
    response : Response
        The simulated channels.
    misfits : mapping of str to Misfit
        By channel name, for the channels that were compared with a recording.
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    names : mapping of str to str
        File name by channel name.
    """
    found: list[Picture] = []
    for channel in response.channels:
        if channel.six is not None and len(channel.six.time) > 1:
            figure = six_figure(channel.name, channel.six)
            title = six_title(channel.name)
            found.append(picture(f"{names[channel.name]}-six", "six", title, figure, channel.name))
        compared = misfits.get(channel.name)
        title = curve_title(channel, compared)
        figure = curve_figure(channel, compared)
        found.append(picture(f"{names[channel.name]}-curve", "curve", title, figure, channel.name))
    found += history_figures(response_histories(response, misfits), names)
    if fit is not None:
        found += fit_figures(fit)
    shape = response.case.geometry
    if shape.view is not None:
        found.append(geometry_picture(shape.view, INTERPRETED, shape.measures()))
    drawn: list[Surface] = []
    for channel in response.channels:
        if channel.surface is None:
            continue
        title = _deformed_title(channel)
        figure = deformed_figure(channel.surface, title, _note(channel.surface, deformed=True))
        found.append(picture(f"{names[channel.name]}-deformed", "deformed", title, figure, channel.name))
        if any(_same(channel.surface, other) for other in drawn):
            continue
        drawn.append(channel.surface)
        served = [
            c.name for c in response.channels if c.surface is not None and _same(channel.surface, c.surface)
        ]
        title = f"Mesh for {listed(served)}"
        figure = mesh_figure(channel.surface, title, _note(channel.surface))
        found.append(picture(f"{names[channel.name]}-mesh", "mesh", title, figure, channel.name))
    return tuple(found)


def fit_figures(fit: Fit) -> tuple[Picture, ...]:
    """Return the picture of the coupons of a fit."""
    return (picture("coupons", "coupons", coupon_title(fit), coupon_figure(fit)),)


def mesh_figures(meshes: Sequence[Meshed]) -> tuple[Picture, ...]:
    """Return one picture for each mesh."""
    found = []
    for mesh in meshes:
        if mesh.surface is None:
            continue
        title = f"Mesh for {listed(list(mesh.modes))}: {mesh.cells} elements"
        figure = mesh_figure(mesh.surface, title, _note(mesh.surface))
        found.append(picture(f"mesh-{mesh.name}", "mesh", title, figure))
    return tuple(found)


def geometry_picture(view: View, title: str, measures: Mapping[str, float]) -> Picture:
    """Return the picture of the interpretation of a geometry."""
    return picture("geometry", "geometry", title, geometry_figure(view, title, measures))


def _deformed_title(channel: Simulated) -> str:
    assert channel.surface is not None
    if channel.in_time:
        name = channel.name[:1].upper() + channel.name[1:]
        return f"{name}: deformed at {channel.surface.displacement:.3g} s"
    shown = quantities(channel.mode)
    reached = f"{float(f'{shown.at(channel.surface.displacement):.3g}'):g}"
    unit = f" {shown.displacement_unit}" if shown.displacement_unit else ""
    name = channel.name[:1].upper() + channel.name[1:]
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
    cut = [
        f"{axis} = 0"
        for axis, a, b, s in zip("xyz", low, high, small, strict=True)
        if abs(a) < s or abs(b) < s
    ]
    return f"cut at {listed(cut)} by symmetry; {scale}" if cut else scale


def _same(one: Surface, other: Surface) -> bool:
    return one is other or (
        one.reference.shape == other.reference.shape and np.allclose(one.reference, other.reference)
    )
