"""Spectra of tables of dynamic moduli -> JSON-ready data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from bushcli.report.json.common import cleaned, head
from bushcli.runtime.condition import Condition

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep


def spectra_json(found: Iterable[TableSpectrum | TableSweep]) -> list[dict[str, Any]]:
    """Return spectra as JSON-ready data: moduli in MPa, times in s, g over the equilibrium modulus."""
    from bushcli.inverse.coupon_tables import TableSweep

    return [_sweep(one) if isinstance(one, TableSweep) else _shown(one) for one in found]


def _sweep(one: TableSweep) -> dict[str, Any]:
    return {
        "name": one.table.name,
        "mode": one.table.mode,
        "quantity": one.table.quantity,
        "thinned": [
            {
                "temperature": None if math.isnan(fit.temperature) else fit.temperature,
                "rows": fit.rows,
                "equilibrium": fit.equilibrium,
                "modulus": fit.modulus,
                "constants": fit.constants,
                "misfit": {"storage_percent": fit.storage_percent, "loss_percent": fit.loss_percent},
            }
            for fit in one.fits
        ],
    }


def tables_json(
    case: Case,
    found: Sequence[TableSpectrum | TableSweep],
    problems: Sequence[Condition],
) -> dict[str, Any]:
    """Return the result of `fit` where a case has tables of dynamic moduli and no other coupon tests.

    Parameters
    ----------
    case : Case
    found : sequence of TableSpectrum or TableSweep
    problems : sequence of Condition
    """
    return cleaned(head("fit", case, problems) | {"dynamic": spectra_json(found)})


def _shown(one: TableSpectrum) -> dict[str, Any]:
    fit, spectrum = one.fit, one.fit.spectrum
    lag = None if not fit.lag_error else {"value": fit.lag, "std": fit.lag_error, "unit": "s"}
    return {
        "name": one.table.name,
        "mode": one.table.mode,
        "quantity": one.table.quantity,
        "rows": fit.rows,
        "equilibrium": spectrum.equilibrium,
        "terms": [
            {"g": float(g), "tau": float(tau), "modulus": float(modulus)}
            for g, tau, modulus in zip(spectrum.relative, spectrum.times, spectrum.moduli, strict=True)
        ],
        "reference_temperature": None if math.isnan(fit.reference) else fit.reference,
        "shifts": [
            {"temperature": float(t), "log10_aT": float(value), "std": float(std)}
            for t, value, std in zip(fit.temperatures, fit.shifts, fit.shift_errors, strict=True)
            if not math.isnan(t)
        ],
        "shift_laws": {
            "wlf": fit.wlf and dict(zip(("C1", "C2", "rms_decades"), fit.wlf, strict=True)),
            "arrhenius": fit.arrhenius and dict(zip(("E", "rms_decades"), fit.arrhenius, strict=True)),
        },
        "lag": lag,
        "misfit": {"storage_percent": fit.storage_percent, "loss_percent": fit.loss_percent},
        "spring_pot": {
            "equilibrium": fit.spring_pot.equilibrium,
            "modulus": fit.spring_pot.modulus,
            "exponent": fit.spring_pot.exponent,
            "misfit": {
                "storage_percent": fit.spring_pot.storage_percent,
                "loss_percent": fit.spring_pot.loss_percent,
            },
        },
    }
