"""Spectra of tables of dynamic moduli -> JSON-ready data."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from bushcli.report.json.common import part

if TYPE_CHECKING:
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep


def spectra_json(found: Iterable[TableSpectrum | TableSweep]) -> list[dict[str, Any]]:
    """Return spectra as JSON-ready data: moduli in MPa, times in s, g over the equilibrium modulus."""
    from bushcli.inverse.coupon_tables import TableSweep

    shown = []
    for one in found:
        table = part(one.table, "name mode quantity")
        if isinstance(one, TableSweep):
            table["thinned"] = [
                part(fit, "temperature rows equilibrium modulus constants")
                | {"misfit": part(fit, "storage_percent loss_percent")}
                for fit in one.fits
            ]
        else:
            fit, spectrum, pot = one.fit, one.fit.spectrum, one.fit.spring_pot
            table |= {
                "rows": fit.rows,
                "equilibrium": spectrum.equilibrium,
                "terms": [
                    {"g": g, "tau": tau, "modulus": modulus}
                    for g, tau, modulus in zip(
                        spectrum.relative, spectrum.times, spectrum.moduli, strict=True
                    )
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
                "misfit": part(fit, "storage_percent loss_percent"),
                "spring_pot": part(pot, "equilibrium modulus exponent")
                | {"misfit": part(pot, "storage_percent loss_percent")},
            }
        shown.append(table)
    return shown
