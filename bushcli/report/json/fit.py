"""An identified law, and spectra of tables of dynamic moduli -> JSON-ready data."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from bushcli.report.json.common import faults_json, result_json, select
from bushcli.report.results import FitResult
from bushcli.report.views.fit import bulk_modulus_std

if TYPE_CHECKING:
    from bushcli.inverse import Fit, FittedCurve
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep


def fit_json(result: FitResult) -> dict[str, Any]:
    """Return an identified law, and what the tables of dynamic moduli say, as JSON-ready data."""
    fit, spectra = result.fit, result.spectra
    entries = {
        **({} if fit is None else {"data_faults": faults_json(fit.faults), **fit_part(fit)}),
        **({"dynamic": spectra_json(spectra)} if spectra else {}),
    }
    return result_json("fit", result.case, result.conditions, entries)


def fit_part(fit: Fit) -> dict[str, Any]:
    """Return the entries that every identified law has."""
    # Imported only if there is a fit, because it loads PETSc and DOLFINx.
    from bushcli.inverse.file_units import parameter_unit

    names = list(fit.parameters)
    return {
        **select(fit.material, "law bulk_modulus"),
        "bulk_modulus_std": bulk_modulus_std(fit),
        "bulk_modulus_from": "case" if "compliance" not in fit.parameters else "tests",
        "parameters": {
            name: {
                **select(estimate, "value std lower upper at_bound"),
                # An end that was not found is None.
                "interval": estimate.range95
                and [end if math.isfinite(end) else None for end in estimate.range95],
                "unit": parameter_unit(fit, name),
            }
            for name, estimate in fit.parameters.items()
        },
        "correlation": {
            name: dict(zip(names, row, strict=True)) for name, row in zip(names, fit.correlation, strict=True)
        },
        "misfit": {
            key: {
                "rms_percent": curve.rms_percent,
                "held_out": curve.held_out,
                **({"branch": curve.branch, "samples": curve.samples} if curve.branch else {}),
            }
            for key, curve in curves_by_mode(fit).items()
        },
        "weighting": fit.weighting,
        "stability": {mode: {"lower": low, "upper": high} for mode, (low, high) in fit.stability.items()},
        **select(fit, "forward_solves failed_solves sweeps iterations converged seconds"),
        "identifiability": {
            "singular_values": fit.singular_values,
            "undetermined": [
                select(combination, "weights singular_value text") for combination in fit.undetermined
            ],
        },
    }


def curves_by_mode(fit: Fit) -> dict[str, FittedCurve]:
    """Return the fitted curves by mode, or by name for modes that were tested more than once and for six motions."""
    count = Counter(curve.recording.mode for curve in fit.curves)
    return {
        mode if count[mode] == 1 and curve.recording.of_one_motion else curve.name: curve
        for curve in fit.curves
        for mode in [curve.recording.mode]
    }


def spectra_json(spectra: Iterable[TableSpectrum | TableSweep]) -> list[dict[str, Any]]:
    """Return spectra as JSON-ready data: moduli in MPa, times in s, g over the equilibrium modulus."""
    from bushcli.inverse.coupon_tables import TableSweep

    tables = []
    for table_fit in spectra:
        table = select(table_fit.table, "name mode quantity")
        if isinstance(table_fit, TableSweep):
            table["thinned"] = [
                select(fit, "temperature rows equilibrium modulus constants")
                | {"misfit": select(fit, "storage_percent loss_percent")}
                for fit in table_fit.fits
            ]
        else:
            fit, spectrum, pot = table_fit.fit, table_fit.fit.spectrum, table_fit.fit.spring_pot
            table |= {
                "rows": fit.rows,
                "equilibrium": spectrum.equilibrium,
                "terms": [
                    dict(zip(("g", "tau", "modulus"), term, strict=True))
                    for term in zip(spectrum.relative_moduli, spectrum.times, spectrum.moduli, strict=True)
                ],
                "reference_temperature": fit.reference,
                "shifts": [
                    {"temperature": t, "log10_aT": value, "std": std}
                    for t, value, std in zip(fit.temperatures, fit.shifts, fit.shift_errors, strict=True)
                    if not math.isnan(t)
                ],
                "shift_laws": {
                    "wlf": fit.wlf and dict(zip(("C1", "C2", "rms_decades"), fit.wlf, strict=True)),
                    "arrhenius": fit.arrhenius
                    and dict(zip(("E", "rms_decades"), fit.arrhenius, strict=True)),
                },
                "lag": {"value": fit.lag, "std": fit.lag_error, "unit": "s"} if fit.lag_error else None,
                "misfit": select(fit, "storage_percent loss_percent"),
                "spring_pot": select(pot, "equilibrium modulus exponent")
                | {"misfit": select(pot, "storage_percent loss_percent")},
            }
        tables.append(table)
    return tables
