"""Contact in reports: surfaces that can meet, and surfaces that met."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bushcli.report.quantity import number, quantities
from bushcli.report.tables import ReportTable

if TYPE_CHECKING:
    from bushcli.simulate.response import Response, Simulated


def contact_json(channel: Simulated) -> dict[str, Any]:
    """Return which surfaces of a channel met, as JSON-ready data.

    Parameters
    ----------
    channel : Simulated
        A simulated channel.
    """
    shown = quantities(channel.mode)
    return {
        "contact": [
            {
                "surfaces": list(one.surfaces),
                "first": one.first if channel.in_time else shown.at(one.first),
                "largest_force": one.force,
                "at": one.at if channel.in_time else shown.at(one.at),
                "radius": one.radius,
                "height": one.height,
            }
            for one in channel.touched
        ]
    }


def contact_tables(response: Response) -> list[ReportTable]:
    """Return where surfaces met; an empty list where none did.

    Parameters
    ----------
    response : Response
        The simulated channels.
    """
    rows = []
    for channel in response.channels:
        shown = quantities(channel.mode)
        unit = "s" if channel.in_time else shown.displacement_unit
        for one in channel.touched:
            first, at = ((q if channel.in_time else shown.at(q)) for q in (one.first, one.at))
            between = one.surfaces[0] + (
                " with itself" if len(set(one.surfaces)) == 1 else f" and {one.surfaces[1]}"
            )
            rows.append(
                (
                    channel.name,
                    between.replace("_", " "),
                    f"{number(first)} {unit}",
                    f"{number(one.force)} N",
                    f"{number(at)} {unit}",
                    f"{number(one.radius)} mm",
                    f"{number(one.height)} mm",
                )
            )
    if not rows:
        return []
    heads = ("channel", "surfaces", "met by", "largest force*", "at", "radius", "z")
    title = (
        "Contact (*pressure integrated over the area; radius and z of where it acts in the deformed rubber)"
    )
    return [ReportTable(title, heads, tuple(rows), left=2)]
