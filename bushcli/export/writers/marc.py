"""Marc: a sheet of values in Marc's convention, to be typed into Mentat.

The fixed fields of Marc's input file are documented in a manual that is not public, and were tried on no Marc, so no
card is written. Marc's energies (manual, volume A): MOONEY C10 (I1-3) + C01 (I2-3) + C11 (I1-3)(I2-3) + C20 (I1-3)^2
+ C30 (I1-3)^3, OGDEN sum mu_n/alpha_n (l1^alpha_n + l2^alpha_n + l3^alpha_n - 3), ARRUDBOYCE with nkT = mu and N =
lambda_m^2, GENT -E Im/6 ln(1 - (I1 - 3)/Im), so E = 3 mu. VISCELMOON and VISCELOGDEN take the shares of the
stiffness in a sudden step that relax, and the law is then that of a sudden step.
"""

from __future__ import annotations

from collections.abc import Mapping

from bushcli.export.card import instantaneous_shares, ogden_terms, rubber, stresses
from bushcli.export.writer import Order, Writer


def write(order: Order) -> str:
    """Return lines of name and value."""
    one, units = rubber(order), order.units
    values = stresses(order, one.instantaneous)
    rows: list[tuple[str, float | str]] = [
        ("model", WRITER.laws[one.law].lower()),
        *_constants(one.law, values),
    ]
    bulk = one.bulk_modulus
    rows.append(("bulk modulus", "incompressible" if bulk == float("inf") else units.of_stress(bulk)))
    if order.density is not None:
        rows.append(("mass density", units.of_density(order.density)))
    for i, (share, tau) in enumerate(instantaneous_shares(one), start=1):
        rows += [
            (f"term {i}: deviatoric multiplier", share),
            (f"term {i}: deviatoric relaxation time", units.of_time(tau)),
        ]
    if one.series:
        rows.insert(0, ("viscoelastic", "viscelogden" if one.law == "ogden" else "viscelmoon"))
    width = max(len(name) for name, _ in rows)
    return "\n".join(
        f"{name:{width}s} = {value}" if isinstance(value, str) else f"{name:{width}s} = {value:.10g}"
        for name, value in rows
    )


def _constants(law: str, known: Mapping[str, float]) -> list[tuple[str, float]]:
    if law == "ogden":
        numbered = enumerate(ogden_terms(known), start=1)
        return [pair for i, (mu, a) in numbered for pair in ((f"mu_{i}", mu), (f"alpha_{i}", a))]
    if law == "arruda_boyce":
        return [("nkT", known["mu"]), ("N", known["lambda_m"] ** 2)]
    if law == "gent":
        return [("E", 3.0 * known["mu"]), ("Im", known["Jm"])]
    return [(name, known.get(name, 0.0)) for name in ("C10", "C01", "C11", "C20", "C30")]


WRITER = Writer(
    name="marc",
    title="Marc (sheet of values for Mentat)",
    kind="card",
    ending=".txt",
    comment=("$", ""),
    write=write,
    laws={
        "neo_hookean": "MOONEY",
        "mooney_rivlin": "MOONEY",
        "yeoh": "MOONEY",
        "ogden": "OGDEN",
        "arruda_boyce": "ARRUDBOYCE",
        "gent": "GENT",
    },
    series="VISCELMOON, VISCELOGDEN",
    series_laws=frozenset({"neo_hookean", "mooney_rivlin", "yeoh", "ogden"}),
    remarks=(
        "not an input deck: values to be typed into Mentat (material properties, hyperelastic)",
        "with viscoelastic terms the law is that of a sudden step",
    ),
    source="Marc manual, volume A: Theory and User Information, Elastomer; Time-dependent behavior of elastomers",
)
