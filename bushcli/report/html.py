"""Results -> one HTML page that opens offline: it contains pictures, style and script, and fetches nothing.

Jinja escapes all text from a case or a recording. A page with zoomable plots runs one script, which the page's content
policy permits by its digest: no other script that might get into the page is run.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import jinja2
from markupsafe import Markup

from bushcli.case import Case, Material
from bushcli.inverse import Fit
from bushcli.report.conditions import conditions
from bushcli.report.contact import contact_tables
from bushcli.report.cycles import ChannelHistory, response_histories
from bushcli.report.cycles_tables import history_tables
from bushcli.report.document import Picture
from bushcli.report.drawing.zoom import figure, script, style
from bushcli.report.six import six_tables
from bushcli.report.tables import (
    ReportTable,
    channel_table,
    curves_of,
    fitted_table,
    measure_table,
    parameter_table,
    solution_table,
)
from bushcli.report.verdict import judge
from bushcli.simulate.misfit import Misfit
from bushcli.simulate.response import Response


@dataclass(frozen=True)
class PageSection:
    """A part of the page: a heading, and under it paragraphs, zoomable plots, tables and pictures.

    Attributes
    ----------
    heading : str
    pictures, tables : sequences
    note : str
        Small print under the tables.
    lines : sequence of str
        Paragraphs under the heading.
    plots : sequence of Markup
        SVG with its legend, all text escaped.
    fold : str
        Label to be clicked to unfold the tables in `folded`.
    folded : sequence of ReportTable
        Tables at the end, folded at first.
    """

    heading: str
    pictures: Sequence[Picture] = ()
    tables: Sequence[ReportTable] = ()
    note: str = ""
    lines: Sequence[str] = ()
    plots: Sequence[Markup] = ()
    fold: str = ""
    folded: Sequence[ReportTable] = ()


def direct_html(
    result: Mapping[str, Any],
    response: Response,
    misfits: Mapping[str, Misfit],
    fit: Fit | None,
    pictures: Iterable[Picture],
) -> str:
    """Return the page of a direct prediction.

    Parameters
    ----------
    result : mapping of str to object
        What `direct_json` returned.
    response : Response
        The simulated channels.
    misfits : mapping of str to Misfit
        By channel name, for the channels that were compared with a recording.
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    pictures : iterable of Picture
        What `direct_figures` returned.
    """
    verdict = judge(response, misfits)
    kinds = by_kind(pictures)
    sections = [PageSection("Channels", tables=[channel_table(response, misfits)])]
    heading = "Simulated and recorded curves" if misfits else "Simulated curves"
    sections.append(PageSection(heading, kinds.get("curve", [])))
    if tables := tuple(six_tables(response)):
        sections.append(PageSection("Six motions", kinds.get("six", []), tables))
    sections += history_sections(response_histories(response, misfits), kinds)
    if fit is not None:
        sections.append(_fitted(fit, kinds))
    if met := contact_tables(response):
        sections.append(PageSection("Contact", tables=met))
    shape = response.case.geometry
    if shape.notes:
        heading, seen = "How the geometry file was interpreted", kinds.get("geometry", [])
        sections.append(PageSection(heading, seen, [measure_table(shape)], lines=shape.notes))
    sections.append(PageSection("Deformed shape at the largest displacement", kinds.get("deformed", [])))
    sections.append(PageSection("Mesh and solution", kinds.get("mesh", []), [solution_table(response)]))
    return page(
        result,
        response.case,
        response.material,
        verdict.headline,
        verdict.lines,
        {True: "good", False: "bad", None: "plain"}[verdict.within],
        sections,
    )


def fit_html(result: Mapping[str, Any], case: Case, fit: Fit, pictures: Iterable[Picture]) -> str:
    """Return the page of an identified law.

    Parameters
    ----------
    result : mapping of str to object
        What `fit_json` returned.
    case : Case
        The case with the coupon tests.
    fit : Fit
        The identified law.
    pictures : iterable of Picture
        What `fit_figures` returned.
    """
    worst = max(curve.rms_percent for curve in fit.curves)
    headline = f"{fit.material.law} fits {curves_of(fit)} to {worst:.1f} % rms or better"
    lines = [] if fit.converged else ["The fit did not converge."]
    return page(result, case, fit.material, headline, lines, "plain", [_fitted(fit, by_kind(pictures))])


def _fitted(fit: Fit, kinds: Mapping[str, list[Picture]]) -> PageSection:
    note = (
        "Stable means that Drucker's postulate holds: any further deformation at constant volume takes work. "
        "Standard errors are estimated from the remaining misfit."
    )
    return PageSection(
        f"Law identified from {curves_of(fit)}",
        kinds.get("coupons", []),
        [parameter_table(fit), fitted_table(fit)],
        note,
    )


def history_sections(
    histories: Sequence[ChannelHistory], kinds: Mapping[str, Sequence[Picture]]
) -> list[PageSection]:
    """Return the section on cycles and holds; an empty list where no path comes back or holds.

    Parameters
    ----------
    histories : sequence of ChannelHistory
        Channels with cycles or holds.
    kinds : mapping of str to sequence of Picture
        Pictures by kind, as `by_kind` returned them.
    """
    note = (
        "Energy is the net work of a cycle, the area of its loop where it closes; loss is that energy over the work "
        "done while loading. ± is one standard error from the noise of the recording. A law without memory has "
        "neither loops nor relaxation."
    )
    pictures = [*kinds.get("cycles", []), *kinds.get("holds", [])]
    tables = history_tables(histories, brief=False)
    return [PageSection("Cycles and holds", pictures, tables, note)] if tables else []


def page(
    result: Mapping[str, Any],
    case: Case,
    material: Material | None,
    headline: str,
    lines: Sequence[str],
    tone: str,
    sections: Sequence[PageSection],
    source: str = "",
    warning: PageSection | None = None,
) -> str:
    """Return the page of a result: verdict, warning, problems, conditions, sections, provenance.

    Parameters
    ----------
    result : mapping of str to object
        The result as JSON-ready data.
    case : Case
        The validated case.
    material : Material or None
        Material that was used, where it is not that of the case.
    headline : str
        The verdict in one sentence.
    lines : sequence of str
        Sentences below the headline.
    tone : str
        "good", "bad" or "plain", which selects the colour of the verdict.
    sections : sequence of PageSection
        Parts of the page; empty ones are left out.
    source : str
        Origin of the law's parameters, where that is not the coupon tests.
    warning : PageSection or None
        Section in a box above everything else.
    """
    shown = [s for s in sections if s.pictures or s.tables or s.lines or s.plots or s.folded]
    code = script() if any(section.plots or section.pictures for section in shown) else Markup("")
    return (
        _environment()
        .get_template("report.html")
        .render(
            title=case.title,
            command=result["command"],
            headline=headline,
            lines=lines,
            tone=tone,
            warning=warning,
            problems=result["problems"],
            conditions=conditions(case, material, source),
            path=str(case.path),
            sections=shown,
            script=code,
            plot_style=style(),
            digest=base64.b64encode(hashlib.sha256(code.encode()).digest()).decode(),
            case=json.dumps(result["case"], indent=2, ensure_ascii=False),
            versions=result["versions"],
            timings=result["timings_s"],
        )
    )


def by_kind(pictures: Iterable[Picture]) -> dict[str, list[Picture]]:
    """Return pictures by kind, in their order."""
    kinds: dict[str, list[Picture]] = {}
    for picture in pictures:
        kinds.setdefault(picture.kind, []).append(picture)
    return kinds


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("bushcli.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["figure"] = figure
    return environment
