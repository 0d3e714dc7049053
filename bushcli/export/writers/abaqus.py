"""Abaqus: `*MATERIAL` with hyperelastic law, Prony series and Mullins effect.

The law is the long-term law (`MODULI=LONG TERM`). The Prony series gives shares of the stiffness in a sudden step:
g_i / (1 + sum g). The Mullins effect has the same formula as in bushcli, eta = 1 - (1/r) erf((Um - U) / (m
+ beta Um)); beside viscoelasticity it applies to the long-term law, as in bushcli.
"""

from __future__ import annotations

from bushcli.export.card import instantaneous_shares, joined, rubber
from bushcli.export.hyperelastic import LAWS, density, hyperelastic
from bushcli.export.writer import Order, Writer


def write(order: Order) -> str:
    """Return the material."""
    one, units = rubber(order), order.units
    lines = [f"*MATERIAL, NAME={order.name}"]
    if order.density is not None:
        lines.append(density(order).rstrip())
    lines.append(hyperelastic(order, "MODULI=LONG TERM" if one.series else ""))
    if one.series:
        lines.append("*VISCOELASTIC, TIME=PRONY")
        lines += [joined([share, 0.0, units.of_time(tau)]) for share, tau in instantaneous_shares(one)]
    if one.softening is not None:
        soft = one.softening
        lines += ["*MULLINS EFFECT", joined([1.0 / soft.inverse_r, units.of_stress(soft.m), soft.beta])]
    return "\n".join(lines)


WRITER = Writer(
    name="abaqus",
    title="Abaqus",
    kind="card",
    ending=".inp",
    comment=("**", ""),
    write=write,
    laws=LAWS,
    series="*VISCOELASTIC, TIME=PRONY",
    softening="*MULLINS EFFECT",
    remarks=(
        "D1 = 0 is an incompressible rubber: use hybrid elements; Abaqus/Explicit takes a bulk modulus of 20 mu",
    ),
    source="Abaqus Analysis User's Guide: Hyperelastic behavior of rubberlike materials; Time domain "
    "viscoelasticity; Mullins effect",
)
