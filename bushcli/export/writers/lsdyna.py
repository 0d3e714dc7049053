"""LS-DYNA: *MAT_077_H, *MAT_077_O and *MAT_127, each with a Prony series.

*MAT_077_H has W = sum C_pq (J1 - 3)^p (J2 - 3)^q, *MAT_077_O W = sum mu_j/alpha_j (l1^alpha_j + l2^alpha_j +
l3^alpha_j - 3) as bushcli, *MAT_127 the five-term series of Arruda and Boyce with G = mu and N = lambda_m^2. The
bulk modulus is given by Poisson's ratio (in *MAT_127 directly). The Prony series is added to the law, which is the
long-term law: shear moduli G_i and decay constants BETA_i = 1/tau_i.
"""

from __future__ import annotations

from bushcli.export.card import field, ogden_terms, poisson_field, rubber, stresses
from bushcli.export.writer import Order, Writer

_H = ("c10", "c01", "c11", "c20", "c02", "c30")


def write(order: Order) -> str:
    """Return the keyword for material 1."""
    material, values, units = rubber(order), stresses(order), order.units
    ro = units.of_density(material.density)
    if material.law == "arruda_boyce":
        numbers = (ro, units.of_stress(material.bulk_modulus), values["mu"], values["lambda_m"] ** 2)
        lines = [
            "*MAT_127_TITLE",
            order.name,
            "$      mid        ro         k         g         n",
            f"{1:10d}" + "".join(map(field, numbers)),
            "$     lcid     tramp        nt",
            f"{0:10d}{field(0.0)}{field(0.0)}",
        ]
    else:
        kind, blocks = "H", [{name: values.get(name.upper(), 0.0) for name in _H}]
        if material.law == "ogden":
            terms = ogden_terms(values)
            kind, terms = "O", terms + [(0.0, 0.0)] * (8 - len(terms))
            blocks = [
                {f"{name}{k}": term[i] for k, term in enumerate(terms, start=1)}
                for i, name in enumerate(("mu", "alpha"))
            ]
        lines = [
            f"*MAT_077_{kind}_TITLE",
            order.name,
            # N = 0: constants are given.
            "$      mid        ro        pr         n        nv         g      sigf       ref",
            f"{1:10d}{field(ro)}{poisson_field(order, 'lsdyna', 10)}{0:10d}{0:10d}",
        ]
        for block in blocks:
            lines.append("$" + "".join(name.rjust(10) for name in block)[1:])
            lines.append("".join(map(field, block.values())))
    if material.series:
        # A line per branch: shear modulus and decay constant.
        modulus = units.of_stress(material.shear_modulus)
        lines.append("$       gi     betai")
        lines += [field(g * modulus) + field(1.0 / units.of_time(tau)) for g, tau in material.series]
    return "\n".join(lines)


WRITER = Writer(
    name="lsdyna",
    title="LS-DYNA",
    kind="card",
    ending=".k",
    comment=("$", ""),
    write=write,
    laws={
        "neo_hookean": "*MAT_077_H",
        "mooney_rivlin": "*MAT_077_H",
        "yeoh": "*MAT_077_H",
        "ogden": "*MAT_077_O",
        "arruda_boyce": "*MAT_127",
    },
    series="Gi, BETAi",
    incompressible=False,
    remarks_on={
        "series": "the Prony series is linear in the Green strain: the same as bushcli's at small strain",
        "arruda_boyce": "N of *MAT_127 is lambda_m squared, a real number; check that your program does not read it "
        "as an integer",
    },
    source="LS-DYNA Keyword User's Manual, volume II: *MAT_077_H, *MAT_077_O, *MAT_127",
)
