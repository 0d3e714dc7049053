"""Plot of a spectrum: the rows of a table, shifted to one temperature, over the fitted curve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.document import Array, Panels, Plot, Series
from bushcli.report.plots.direct import colour
from bushcli.report.quantity import number

if TYPE_CHECKING:
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep


# Frequencies of a line.
_DENSE = 300


def master_columns(spectrum: TableSpectrum) -> dict[str, Array]:
    """Return the columns of a master curve: rows as measured, where they were shifted to, and as fitted."""
    table, fit = spectrum.table, spectrum.fit
    fitted = fit.at(table.frequency, table.temperature)
    return {
        "temperature_C": table.temperature,
        "frequency_Hz": table.frequency,
        "reduced_frequency_Hz": fit.reduced_frequencies(table.frequency, table.temperature),
        "storage_MPa": table.storage,
        "loss_MPa": table.loss,
        "storage_fitted_MPa": fitted.real,
        "loss_fitted_MPa": fitted.imag,
    }


def table_panels(spectrum: TableSpectrum | TableSweep, file: str) -> Panels:
    """Return the plots of what a table says: its master curve, or its moduli over amplitude."""
    from bushcli.inverse.coupon_tables import TableSweep

    return sweep_panels(spectrum, file) if isinstance(spectrum, TableSweep) else master_panels(spectrum, file)


def master_panels(spectrum: TableSpectrum, file: str) -> Panels:
    """Return the master curve of a table: dots in the colour of their temperature, lines of the spectrum."""
    fit, symbol = spectrum.fit, spectrum.table.quantity
    temperature, frequency, reduced, storage, loss, *_ = master_columns(spectrum).values()
    line = np.geomspace(reduced.min(), reduced.max(), _DENSE)
    curve = fit.spectrum.at(2.0 * np.pi * line)
    # The lag of the rig, which the line is without, turns each row by its own frequency.
    turned = (storage + 1j * loss) * np.exp(-2j * np.pi * frequency * fit.lag)
    step = np.abs(temperature[:, None] - fit.temperatures).argmin(axis=1)
    several = len(fit.temperatures) > 1
    at = f" at {number(fit.reference)} degrees C" if several else ""
    plots = []
    for part, of, mark, below in (
        ("storage", np.real, "'", ""),
        ("loss", np.imag, "''", f"log10 of the frequency{at} [Hz]"),
    ):
        series = []
        for k in np.unique(step):
            label = f"{number(float(fit.temperatures[k]))} degrees C" if several else "measured"
            at, rows = np.log10(reduced[step == k]), of(turned)[step == k]
            series.append(Series(colour(k), label, at, rows, "dots"))
        series.append(Series("after", f"{len(fit.spectrum.times)} branches", np.log10(line), of(curve)))
        plots.append([Plot(part, (below, f"{symbol}{mark} [MPa]"), series, log="y")])
    title = f"Master curve of {spectrum.table.name}{at}" if several else f"Moduli of {spectrum.table.name}"
    return Panels(f"{file}-master", "spectrum", title, plots, spectrum.table.name)


def sweep_panels(sweep: TableSweep, file: str) -> Panels:
    """Return storage and loss over the amplitude: dots as measured, lines as fitted, a colour for each temperature."""
    table, plots = sweep.table, []
    for part, mark, of in (("storage", "'", np.real), ("loss", "''", np.imag)):
        series = []
        for k, fit in enumerate(sweep.fits):
            nearest = np.argmin([abs(table.temperature - other.temperature) for other in sweep.fits], axis=0)
            selected = nearest == k if len(sweep.fits) > 1 else np.ones(len(table), dtype=bool)
            label = "" if np.isnan(fit.temperature) else f"{number(fit.temperature)} degrees C"
            key, at = colour(k), table.rows(selected)
            for f in np.unique(at.frequency):
                rows = at.rows(at.frequency == f)
                line = np.geomspace(rows.amplitude.min(), rows.amplitude.max(), 100)
                measured = rows.storage if part == "storage" else rows.loss
                series.append(Series(key, label, np.log10(100.0 * rows.amplitude), measured, "dots"))
                fitted = of(fit.at(line, np.full(len(line), f)))
                series.append(Series(key, "", np.log10(100.0 * line), fitted))
                label = ""
        below = "" if part == "storage" else "log10 of the amplitude [%]"
        plots.append([Plot(part, (below, f"{table.quantity}{mark} [MPa]"), series, log="y")])
    return Panels(f"{file}-amplitude", "sweep", f"Moduli of {table.name} over amplitude", plots, table.name)
