"""Spectra of tables of dynamic moduli -> a section of a document."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.document import Section, Table, figures, paragraphs
from bushcli.report.quantity import number, percent, with_std

if TYPE_CHECKING:
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep


def spectra_sections(found: Sequence[TableSpectrum | TableSweep]) -> list[Section]:
    """Return a section for each spectrum: its misfit, its terms, the shifts with temperature, the master curve."""
    from bushcli.inverse.coupon_tables import TableSweep

    return [sweep_section(one) if isinstance(one, TableSweep) else spectrum_section(one) for one in found]


def sweep_section(one: TableSweep) -> Section:
    """Return the fit of a table of amplitudes at each temperature."""
    symbol = one.table.quantity
    heads = (
        "temperature [°C]",
        f"{symbol}_inf [MPa]",
        *one.fits[0].constants,
        "misfit storage",
        "misfit loss",
    )
    rows = tuple(
        (
            number(fit.temperature),
            number(fit.equilibrium, 4),
            *map(number, fit.constants.values()),
            percent(fit.storage_percent),
            percent(fit.loss_percent),
        )
        for fit in one.fits
    )
    from bushcli.effects.effect import effect_in_force_law  # few results have such a table

    name = effect_in_force_law("clock").name
    lines = [f"Constants of the effect {name}, fitted at each temperature: a spectrum that amplitude thins."]
    own = figures("sweep", channel=one.table.name)
    return Section(
        f"Amplitudes of {one.table.name}", [own, Table("", heads, rows, left=0), *paragraphs(lines)]
    )


def spectrum_section(one: TableSpectrum) -> Section:
    """Return the relaxation spectrum of a table, with the shifts by temperature."""
    fit, spectrum, pot = one.fit, one.fit.spectrum, one.fit.spring_pot
    symbol = one.table.quantity
    heads = ("model", f"{symbol}_inf [MPa]", "constants", "misfit storage", "misfit loss")
    rows = (
        (
            f"{len(spectrum.times)} Maxwell branches",
            number(spectrum.equilibrium, 4),
            f"sum g = {number(float(np.sum(spectrum.relative)))}",
            percent(fit.storage_percent),
            percent(fit.loss_percent),
        ),
        (
            "spring-pot",
            number(pot.equilibrium, 4),
            f"{number(pot.modulus)} MPa (i omega)^{number(pot.exponent)}",
            percent(pot.storage_percent),
            percent(pot.loss_percent),
        ),
    )
    terms = tuple(
        (number(float(tau)), number(float(g)), number(float(modulus)))
        for tau, g, modulus in zip(spectrum.times, spectrum.relative, spectrum.moduli, strict=True)
    )
    shown = [
        Table("", heads, rows),
        Table("Branches", ("tau [s]", "g", "modulus [MPa]"), terms, left=0, most=12),
    ]
    if len(fit.temperatures) > 1:
        steps = tuple(
            (number(float(t)), with_std(float(value), float(std)))
            for t, value, std in zip(fit.temperatures, fit.shifts, fit.shift_errors, strict=True)
        )
        title = f"Shift of the times, from {number(fit.reference)} degrees C"
        shown.append(Table(title, ("temperature [°C]", "log10 a_T"), steps, left=0, most=12))
    lines = []
    if fit.wlf is not None and fit.arrhenius is not None:
        C1, C2, missed = fit.wlf
        energy, off = fit.arrhenius
        lines.append(
            f"As a formula the shifts are WLF with C1 = {number(C1)} and C2 = {number(C2)} K to {number(missed)} "
            f"decades (rms), or Arrhenius with E = {number(energy)} kJ/mol to {number(off)}: constants of the effect "
            f"temperature with reference = {number(fit.reference)}."
        )
    if fit.lag_error and abs(fit.lag) > 3.0 * fit.lag_error:
        lines.append(
            f"The rig's lag of {with_std(1e6 * fit.lag, 1e6 * fit.lag_error)} microseconds was identified with it: "
            "the loss angle grows with frequency alike at all temperatures."
        )
    own = figures("spectrum", channel=one.table.name)
    return Section(f"Spectrum of {one.table.name}", [own, *shown, *paragraphs(lines)])
