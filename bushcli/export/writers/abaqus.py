"""Abaqus: `*MATERIAL` with hyperelastic law, Prony series or table of complex moduli, and Mullins effect.

The law is the long-term law (`MODULI=LONG TERM`), which the frequency domain requires. The Prony series gives shares of
the stiffness in a sudden step: g_i / (1 + sum g). `FREQUENCY=TABULAR` has at each frequency, in cycles per time, omega
Re g* = G''/Ginf and omega Im g* = 1 - G'/Ginf, Ginf being the long-term modulus, and the same of the bulk modulus,
which has no loss. With G* = Ginf (1 + s) these are Im s and -Re s. The Mullins effect has the same formula as in
bushcli, eta = 1 - (1/r) erf((Um - U) / (m + beta Um)); beside viscoelasticity it applies to the long-term law, as in
bushcli.
"""

from __future__ import annotations

import numpy as np

from bushcli.export.card import LAWS, comma_lines, density, hyperelastic, instantaneous_shares, rubber
from bushcli.export.writer import FREQUENCY_PRONY, FREQUENCY_TABULAR, TIME_PRONY, Order, Writer
from cases.dynamic.model import modulus

# A table reaches this many decades beyond the corner frequencies 1 / (2 pi tau) of the branches, beyond which Abaqus
# keeps its last values: the loss of a branch is then below 0.1 % of its stiffness. With h = ln 10 / 20 between points
# an interpolation that is linear in the frequency or its logarithm errs by at most about h^2 / 13 = 0.1 % of it.
_BEYOND, _PER_DECADE = 3, 20
_KEYWORDS = {
    TIME_PRONY: "*VISCOELASTIC, TIME=PRONY",
    FREQUENCY_PRONY: "*VISCOELASTIC, FREQUENCY=PRONY",
    FREQUENCY_TABULAR: "*VISCOELASTIC, FREQUENCY=TABULAR",
}


def write(order: Order) -> str:
    """Return the material."""
    material, units = rubber(order), order.units
    lines = [f"*MATERIAL, NAME={order.name}", density(order).rstrip()]
    lines.append(hyperelastic(order, "MODULI=LONG TERM" if material.series else ""))
    if material.series:
        lines.append(_KEYWORDS[order.form])
    if material.series and order.form == FREQUENCY_TABULAR:
        corners = np.log10([1.0 / (2.0 * np.pi * tau) for _, tau in material.series])
        low, high = corners.min() - _BEYOND, corners.max() + _BEYOND
        frequency = np.logspace(low, high, int(np.ceil(_PER_DECADE * (high - low))) + 1)
        s = modulus(frequency, material.series)
        rows = zip(s.imag, -s.real, units.of_frequency(1.0) * frequency, strict=True)
        lines += [comma_lines([loss, storage, 0.0, 0.0, f]) for loss, storage, f in rows]
    elif material.series:
        lines += [
            comma_lines([share, 0.0, units.of_time(tau)]) for share, tau in instantaneous_shares(material)
        ]
    if material.softening is not None:
        soft = material.softening
        lines += ["*MULLINS EFFECT", comma_lines([1.0 / soft.inverse_r, units.of_stress(soft.m), soft.beta])]
    return "\n".join(lines)


WRITER = Writer(
    name="abaqus",
    title="Abaqus",
    kind="card",
    ending=".inp",
    comment=("**", ""),
    write=write,
    laws=LAWS,
    series=_KEYWORDS[TIME_PRONY],
    forms=tuple(_KEYWORDS),
    softening="*MULLINS EFFECT",
    remarks_on={
        "incompressible": "D1 = 0 is an incompressible rubber: use hybrid elements; Abaqus/Explicit takes a bulk "
        "modulus of 20 mu",
    },
    source="Abaqus Analysis User's Guide: Hyperelastic behavior of rubberlike materials; Time domain "
    "viscoelasticity; Frequency domain viscoelasticity; Mullins effect",
)
