"""Relaxation spectra of a case's coupon tables of dynamic moduli, and their decrease with amplitude."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bushcli.case import Case
from bushcli.errors import count_of
from bushcli.faults import condition
from bushcli.faults.dynamic import table_faults
from bushcli.inverse.spectrum import SpectrumFit, fit_spectrum
from bushcli.inverse.thinned import ThinnedFit, fit_thinned
from bushcli.recording.dynamic.read import read_dynamic
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.recording.table_cache import TableCache
from bushcli.runtime.condition import Condition
from cases.mode import modes

#: Frequencies of a sweep below which it does not show a spectrum: two terms have four values. Amplitudes below which
#: storage and loss are fewer than the eight constants of a spectrum that amplitude thins.
_FEWEST, _AMPLITUDES = 4, 5
#: Temperatures closer together are one step of the chamber, K (judgement).
_KELVINS = 3.0
#: Misfit of storage or loss, rms relative in %, from which a spectrum does not describe a table.
_POOR = 10.0
#: Shear strain sqrt(2 dev eps : dev eps) per unit of a coupon's strain.
_SHEAR = {"uniaxial": np.sqrt(3.0), "equibiaxial": 2.0 * np.sqrt(3.0), "planar": 2.0}


@dataclass(frozen=True, eq=False)
class TableSpectrum:
    """A table, the rows of it that were fitted, and their spectrum."""

    table: DynamicTable
    fit: SpectrumFit


@dataclass(frozen=True, eq=False)
class TableSweep:
    """A table over amplitude, and what was identified at each temperature."""

    table: DynamicTable
    fits: tuple[ThinnedFit, ...]


def fit_tables(
    case: Case, tables: TableCache | None = None
) -> tuple[tuple[TableSpectrum | TableSweep, ...], tuple[Condition, ...]]:
    """Return the spectra of the tables of coupons, how amplitude thins them, and what prevented others.

    Rows that belong to no curve are left out. Of several amplitudes or preloads those rows are fitted that have the
    smallest ones: a spectrum is linear.

    Parameters
    ----------
    case : Case
    tables : TableCache, optional
        Cache of the binary files that the caller reads.
    """
    fits: list[TableSpectrum | TableSweep] = []
    conditions: list[Condition] = []
    for source in case.dynamic:
        if modes()[source.mode].specimen != "coupon":
            continue
        table = read_dynamic(source, tables)
        faults = table_faults(case.geometry, [table])
        conditions += [condition(fault) for fault in faults]
        faulty = np.zeros(len(table), dtype=bool)
        for fault in faults:
            faulty |= fault.samples & (not fault.fatal)
        lossless = table.loss <= 0.0
        if lossless.any():
            rows = count_of(int(np.count_nonzero(lossless)), "row")
            what = f"{source.label}: the loss is not positive in {rows}, which the fit leaves out"
            remedy = "rubber dissipates: these rows scatter, or the force is logged late"
            conditions.append(Condition("bad_samples", what, remedy))
        table = table.rows(~(faulty | lossless))
        if swept := _sweeps(table):
            fits.append(TableSweep(table, swept))
        # The rows of the smallest amplitude and of the preload nearest to zero: a spectrum is linear.
        linear = np.ones(len(table), dtype=bool)
        for values in (table.amplitude, np.abs(table.preload), np.abs(table.preload_force)):
            if not np.isnan(values).any():
                # The amplitudes of one sweep scatter by some per cent about the value asked.
                linear &= values <= 1.1 * values[linear].min() + 1e-12
        table = table.rows(linear)
        count = len(np.unique(np.round(np.log(table.frequency), 2)))
        if count < _FEWEST and not swept:
            what = f"{source.label}: {count} frequenc{'ies' if count > 1 else 'y'} at the smallest amplitude"
            remedy = f"a spectrum of relaxation times needs a sweep over at least {_FEWEST} frequencies"
            conditions.append(Condition("no_spectrum", what, remedy))
        if count < _FEWEST:
            continue
        fit = fit_spectrum(table)
        if max(fit.storage_percent, fit.loss_percent) > _POOR:
            what = f"{source.label}: the spectrum misses storage by {fit.storage_percent:.0f} % and loss by "
            what += f"{fit.loss_percent:.0f} % (rms)"
            remedy = "storage and loss contradict each other, or curves of other batches or amplitudes are among them"
            conditions.append(Condition("poor_spectrum", what, remedy))
        fits.append(TableSpectrum(table, fit))
    return tuple(fits), tuple(conditions)


def _sweeps(table: DynamicTable) -> tuple[ThinnedFit, ...]:
    """Return what the amplitudes of each temperature tell; none where there are too few."""
    if np.isnan(table.amplitude).any() or not ((table.storage > 0.0) & (table.loss > 0.0)).all():
        return ()
    shear = 1.0 if table.quantity == "G" else _SHEAR.get(table.mode, 1.0)
    step = np.round(np.nan_to_num(table.temperature) / _KELVINS)
    parts = [table.rows(step == k) for k in np.unique(step)]
    parts = [part for part in parts if len(np.unique(np.round(np.log(part.amplitude), 1))) >= _AMPLITUDES]
    return tuple(fit_thinned(part, float(shear)) for part in parts)
