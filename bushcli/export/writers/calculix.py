"""CalculiX: `*MATERIAL` with a hyperelastic law; it has neither a Prony series nor a Mullins effect.

If D1 is zero, CalculiX assumes a Poisson's ratio of 0.475, so an incompressible rubber is refused.
"""

from __future__ import annotations

from bushcli.export.hyperelastic import LAWS, density, hyperelastic
from bushcli.export.writer import Order, Writer


def write(order: Order) -> str:
    """Return the material."""
    return f"*MATERIAL, NAME={order.name}\n{density(order)}{hyperelastic(order)}"


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
