"""`*HYPERELASTIC` in the format that Abaqus and CalculiX share.

Both define the energy alike: invariants and stretches isochoric, D1 = 2/kappa, neo-Hookean, Mooney-Rivlin and Yeoh
with 1/D1 (J - 1)^2, Ogden sum 2 mu_i/alpha_i^2 (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3), so that mu = sum mu_i,
and Arruda-Boyce with 1/D ((J^2 - 1)/2 - ln J). bushcli's Ogden has mu_i/alpha_i: its mu_i is multiplied by alpha_i /
2.

References
----------
Abaqus Analysis User's Guide, Hyperelastic behavior of rubberlike materials. Dhondt, CalculiX CrunchiX User's Manual,
*HYPERELASTIC.
"""

from __future__ import annotations

from bushcli.export.card import comma_lines, incompressibility, ogden_terms, rubber, stresses
from bushcli.export.writer import Order

LAWS = {
    "neo_hookean": "*HYPERELASTIC, NEO HOOKE",
    "mooney_rivlin": "*HYPERELASTIC, MOONEY-RIVLIN",
    "yeoh": "*HYPERELASTIC, YEOH",
    "ogden": "*HYPERELASTIC, OGDEN",
    "arruda_boyce": "*HYPERELASTIC, ARRUDA-BOYCE",
}


def hyperelastic(order: Order, moduli: str = "", absent: float = 0.0) -> str:
    """Return the keyword with its data lines; `absent` is the number for D_i of volumetric terms that the law lacks."""
    law, values, D = rubber(order).law, stresses(order), incompressibility(order)
    keyword, numbers = LAWS[law], [*values.values(), D]
    if law == "yeoh":
        numbers = [values["C10"], values["C20"], values["C30"], D, absent, absent]
    if law == "ogden":
        terms = ogden_terms(values)
        keyword += f", N={len(terms)}"
        numbers = [number for mu, alpha in terms for number in (mu * alpha / 2.0, alpha)]
        numbers += [D] + [absent] * (len(terms) - 1)
    line = f"{keyword}, {moduli}" if moduli else keyword
    return f"{line}\n{comma_lines(numbers)}"


def density(order: Order) -> str:
    """Return `*DENSITY` with its data line and a line break."""
    return f"*DENSITY\n{order.units.of_density(rubber(order).density):.10g}\n"
