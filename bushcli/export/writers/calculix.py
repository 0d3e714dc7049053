"""CalculiX: `*MATERIAL` with a hyperelastic law; it has neither a Prony series nor a Mullins effect.

CalculiX replaces each D_i whose value is below 1e-10, whatever the units are (hyperelastics.f: D_i = (0.1/mu)^i, a
Poisson's ratio of 0.475). An incompressible rubber is therefore refused, and so is a bulk modulus beyond 2e10 units. D2
and D3 belong to terms 1/D_i (J - 1)^(2 i) that the law does not have: they are written so large that the terms vanish.
"""

from __future__ import annotations

from bushcli.export.card import LAWS, bulk_refusal, density, hyperelastic, incompressibility
from bushcli.export.writer import Order, Writer

# Below it a D_i counts as not given; and a D_i whose term is below rounding in every system of units.
_LEAST, _ABSENT = 1e-10, 1e30


def write(order: Order) -> str:
    """Return the material; refuse a bulk modulus that the program would replace by its default."""
    D = incompressibility(order)
    if D < _LEAST:
        raise bulk_refusal(
            order, "calculix", f"replaces D1 = {D:.3g}, which is below {_LEAST:g}, by its default"
        )
    return f"*MATERIAL, NAME={order.name}\n{density(order)}{hyperelastic(order, absent=_ABSENT)}"


WRITER = Writer(
    name="calculix",
    title="CalculiX",
    kind="card",
    ending=".inp",
    comment=("**", ""),
    write=write,
    laws=LAWS,
    incompressible=False,
    remarks=(
        "a stiff bulk modulus locks linear elements and fully integrated quadratic ones: use C3D20R, CAX8R",
    ),
    source="Dhondt, CalculiX CrunchiX User's Manual: *HYPERELASTIC",
)
