"""An identified law -> its document: parameters, misfit by test, stable range; spectra of tables of dynamic moduli."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bushcli.errors import count_of
from bushcli.report.conditions import conditions
from bushcli.report.document import Document, Paragraph, Row, Section, Table, figures, note, paragraphs
from bushcli.report.quantity import channel_label, interval, join_names, number, percent, quantities, with_std
from bushcli.report.results import FitResult
from bushcli.report.verdict import doubt_lines, faulty_data
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.inverse import Fit
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep

_MISFITS = ("misfit storage", "misfit loss")
_NOTE = (
    "Stable means that Drucker's postulate holds: any further deformation at constant volume takes work. "
    "Standard errors are estimated from the remaining misfit."
)


def fit_document(result: FitResult) -> Document:
    """Return the document of an identified law, and of what the tables of dynamic moduli say."""
    fit, material = result.fit, None
    lines: list[str] = []
    if fit is None:
        names = {table_fit.table.name for table_fit in result.spectra}
        headline = f"Relaxation spectra of {count_of(len(names), 'table')} of dynamic moduli"
    else:
        worst = max(curve.rms_percent for curve in fit.curves if not curve.held_out)
        # Rounded up, because no curve is worse.
        accuracy = f"{math.ceil(10 * worst - 1e-6) / 10:.1f} % rms or better"
        headline, material = f"{fit.material.law} fits {curves_of(fit)} to {accuracy}", fit.material
        lines = [*doubt_lines(fit.faults), *([] if fit.converged else ["The fit did not converge."])]
        if any(fault.fatal for fault in fit.faults):
            lines = [f"{headline}: its values do not describe the rubber.", *lines]
            headline = faulty_data(fit.faults)
    return Document(
        headline,
        lines,
        "plain",
        [*([fit_section(fit)] if fit else []), *spectra_sections(result.spectra)],
        result.conditions,
        conditions(result.case, material),
        ends_with_verdict=fit is not None,
    )


def fit_section(fit: Fit) -> Section:
    """Return the section on a law fitted to coupon tests."""
    end = f"{'converged' if fit.converged else 'not converged'} after {count_of(fit.iterations, 'iteration')}"
    calls = f"{count_of(fit.sweeps, 'evaluation')}, {count_of(fit.forward_solves, 'simulation')} of one test"
    solved = Paragraph(f"{end}, {calls}, {fit.seconds:.1f} s", "note")
    tables, lines = (parameter_table(fit), fitted_table(fit)), paragraphs(fit_lines(fit))
    blocks = [*tables, *lines, solved, note(_NOTE), figures("coupons")]
    return Section(f"Law identified from {curves_of(fit)}", blocks)


def parameter_table(fit: Fit) -> Table:
    """Return the parameters of the identified law."""
    # Imported only if there is a fit, because it loads PETSc and DOLFINx.
    from bushcli.inverse.file_units import parameter_unit

    rows: list[Row] = []
    for name, estimate in fit.parameters.items():
        unit = parameter_unit(fit, name)
        bounds = f"{number(estimate.lower)} to {number(estimate.upper)}{' (at bound)' if estimate.at_bound else ''}"
        values = (number(estimate.value, 4), number(estimate.std, 2))
        rows.append((name, *values, "-" if unit == "1" else unit, bounds))
    return Table(f"Law {fit.material.law}", ("parameter", "value", "std", "unit", "bounds"), tuple(rows))


def fitted_table(fit: Fit) -> Table:
    """Return the curves of a fit: misfit, range tested, range in which the law is stable."""
    rows = []
    for curve in fit.curves:
        mode, units = curve.recording.mode, quantities(curve.recording.mode)
        q, unit = curve.recording.displacement, units.displacement_unit
        ends = f"{number(units.at(q.min()))} to {number(units.at(q.max()))}"
        tested = f"{ends} {unit}" if unit else f"{units.displacement} {ends}"
        # Simple shear reaches the states of a planar test.
        limits = fit.stability.get("planar" if modes()[mode].sheared else mode)
        stable = "-"
        if limits is not None:
            low, high = limits
            stable = interval(low if low > 0 else -math.inf, high, "{:.2f}".format)
        name = channel_label(curve.name, curve.held_out)
        rows.append((name, mode, percent(curve.rms_percent), tested, stable))
    heads = ("test", "mode", "rms misfit", "tested", "stable at stretch")
    weighting = f", {fit.weighting} weighting" if _all_coupons(fit) else ""
    return Table(f"Fitted to {curves_of(fit)}{weighting}", heads, tuple(rows), left=2)


def fit_lines(fit: Fit) -> list[str]:
    """Return sentences on the branches of the coupons that were fitted, and on where the bulk modulus comes from."""
    lines = []
    for curve in (curve for curve in fit.curves if curve.branch):
        part = f"{curve.branch} alone ({curve.samples} of {len(curve.recording.force)} samples)"
        part = "loading and unloading together" if curve.branch == "both" else part
        count = len({branch.cycle for branch in curve.recording.branches})
        cycles = f", of all {count} cycles (cycles chooses among them)" if count > 1 else ""
        other = "unloading" if curve.branch == "loading" else "loading"
        change = f'--branch {other} or branch = "{other}" changes it'
        lines.append(f"{curve.name}: fitted to {part}{cycles}; {change}")
    bulk, std = fit.material.bulk_modulus, bulk_modulus_std(fit)
    if not _all_coupons(fit):
        return lines
    if std is not None:
        return [*lines, f"bulk modulus {with_std(bulk, std)} MPa, identified from the volumetric tests"]
    value = "incompressible" if np.isinf(bulk) else f"bulk modulus {number(bulk, 4)} MPa"
    remedy = "no coupon test here can identify it, a volumetric one would"
    return [*lines, f"{value}, as the case gives it: {remedy}"]


def curves_of(fit: Fit) -> str:
    """Return the data to which a law was fitted, in words: "3 coupon tests", "1 recording and 2 tables"."""
    curves = sum(not curve.held_out for curve in fit.curves)
    tables = sum(not table.held_out for table in fit.tables)
    counts = ((curves, "coupon test" if _all_coupons(fit) else "recording"), (tables, "table"))
    words = [count_of(count, word) for count, word in counts if count]
    return join_names(words) or "no recording"


def bulk_modulus_std(fit: Fit) -> float | None:
    """Return the standard error of an identified bulk modulus, MPa; None where it was not identified."""
    compliance = fit.parameters.get("compliance")
    return None if compliance is None or not compliance.value > 0 else compliance.std / compliance.value**2


def _all_coupons(fit: Fit) -> bool:
    return all(modes()[curve.recording.mode].specimen == "coupon" for curve in fit.curves)


def spectra_sections(spectra: Sequence[TableSpectrum | TableSweep]) -> list[Section]:
    """Return a section for each spectrum: its misfit, its terms, the shifts with temperature, the master curve."""
    from bushcli.inverse.coupon_tables import TableSweep

    return [
        sweep_section(table_fit) if isinstance(table_fit, TableSweep) else spectrum_section(table_fit)
        for table_fit in spectra
    ]


def sweep_section(sweep: TableSweep) -> Section:
    """Return the fit of a table of amplitudes at each temperature."""
    from bushcli.effects.effect import effect_in_force_law  # here: few results need the effects

    first = ("temperature [°C]", f"{sweep.table.quantity}_inf [MPa]")
    heads = (*first, *sweep.fits[0].constants, *_MISFITS)
    rows = []
    for fit in sweep.fits:
        constants = (number(fit.equilibrium, 4), *map(number, fit.constants.values()))
        misfits = (percent(fit.storage_percent), percent(fit.loss_percent))
        rows.append((number(fit.temperature), *constants, *misfits))
    name = effect_in_force_law("clock").name
    lines = [f"Constants of the effect {name}, fitted at each temperature: a spectrum that amplitude thins."]
    plot, table = figures("sweep", channel=sweep.table.name), Table("", heads, tuple(rows), left=0)
    return Section(f"Amplitudes of {sweep.table.name}", [plot, table, *paragraphs(lines)])


def spectrum_section(table_fit: TableSpectrum) -> Section:
    """Return the relaxation spectrum of a table, with the shifts by temperature."""
    fit, spectrum, pot = table_fit.fit, table_fit.fit.spectrum, table_fit.fit.spring_pot
    heads = ("model", f"{table_fit.table.quantity}_inf [MPa]", "constants", *_MISFITS)
    branches = f"{len(spectrum.times)} Maxwell branches"
    total = f"sum g = {number(float(np.sum(spectrum.relative_moduli)))}"
    power = f"{number(pot.modulus)} MPa (i omega)^{number(pot.exponent)}"
    rows = tuple(
        (name, number(equilibrium, 4), constants, percent(of.storage_percent), percent(of.loss_percent))
        for name, equilibrium, constants, of in (
            (branches, spectrum.equilibrium, total, fit),
            ("spring-pot", pot.equilibrium, power, pot),
        )
    )
    columns = zip(spectrum.times, spectrum.relative_moduli, spectrum.moduli, strict=True)
    terms = tuple(tuple(number(float(value)) for value in row) for row in columns)
    tables = [
        Table("", heads, rows),
        Table("Branches", ("tau [s]", "g", "modulus [MPa]"), terms, left=0, most=12),
    ]
    if len(fit.temperatures) > 1:
        steps = tuple(
            (number(float(t)), with_std(float(value), float(std)))
            for t, value, std in zip(fit.temperatures, fit.shifts, fit.shift_errors, strict=True)
        )
        title = f"Shift of the times, from {number(fit.reference)} degrees C"
        tables.append(Table(title, ("temperature [°C]", "log10 a_T"), steps, left=0, most=12))
    lines = []
    if fit.wlf is not None and fit.arrhenius is not None:
        (C1, C2, wlf_error), (energy, arrhenius_error) = fit.wlf, fit.arrhenius
        lines.append(
            f"As a formula the shifts are WLF with C1 = {number(C1)} and C2 = {number(C2)} K to {number(wlf_error)} "
            f"decades (rms), or Arrhenius with E = {number(energy)} kJ/mol to {number(arrhenius_error)}: constants of "
            f"the effect temperature with reference = {number(fit.reference)}."
        )
    if fit.lag_error and abs(fit.lag) > 3.0 * fit.lag_error:
        lines.append(
            f"The rig's lag of {with_std(1e6 * fit.lag, 1e6 * fit.lag_error)} microseconds was identified with it: "
            "the loss angle grows with frequency alike at all temperatures."
        )
    plot = figures("spectrum", channel=table_fit.table.name)
    return Section(f"Spectrum of {table_fit.table.name}", [plot, *tables, *paragraphs(lines)])
