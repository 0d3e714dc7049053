"""Marc: a Mentat procedure that makes the material; values that no public command sets are listed to be typed in.

The fields of Marc's input file are in volume C of its manual, which was not available, so no input deck is written.
Mentat's commands that set a material's Mooney and Ogden constants and its density are public in many scripts that run
them; commands for the bulk modulus, for the Arruda-Boyce and Gent laws and for viscoelastic terms were found in none.
Those values stand in comments, under the names of the manual, and the material's name then ends in ``_incomplete``.
Nothing was tested in Marc. Marc's energies (manual, volume A): MOONEY C10 (I1-3) + C01 (I2-3) + C11 (I1-3)(I2-3) + C20
(I1-3)^2 + C30 (I1-3)^3, OGDEN sum mu_n/alpha_n (l1^alpha_n + l2^alpha_n + l3^alpha_n - 3), ARRUDBOYCE with nkT = mu and
N = lambda_m^2, GENT -E Im/6 ln(1 - (I1 - 3)/Im), so E = 3 mu. VISCELMOON and VISCELOGDEN take the shares of the
stiffness in a sudden step that relax, and the law is then that of a sudden step.
"""

from __future__ import annotations

from bushcli.export.card import instantaneous_shares, ogden_terms, rubber, stresses
from bushcli.export.writer import Order, Writer

_TYPES = {"MOONEY": "mooney", "OGDEN": "ogden"}


def write(order: Order) -> str:
    """Return commands, and comments with the values that remain to be typed in."""
    by_hand = _by_hand(order)
    name = f"{order.name}_incomplete" if by_hand else order.name
    lines = [
        "*new_mater standard",
        "*mater_option general:state:solid",
        "*mater_option general:skip_structural:off",
        f"*mater_name {name}",
        *_law(order),
    ]
    lines.append(f"*mater_param general:mass_density {order.units.of_density(rubber(order).density):.10g}")
    if by_hand:
        width = max(len(name) for name, _ in by_hand)
        lines.append("| to be typed in by hand, after which the material is complete:")
        lines += [
            f"| {name:{width}s} = {value if isinstance(value, str) else f'{value:.10g}'}"
            for name, value in by_hand
        ]
    return "\n".join(lines)


def _law(order: Order) -> list[str]:
    """Return the commands for the law's constants; none where no public command sets them."""
    material = rubber(order)
    values, kind = stresses(order, material.instantaneous), _TYPES.get(WRITER.laws[material.law])
    if kind is None:
        return []
    lines = [f"*mater_option structural:type:{kind}"]
    if kind == "ogden":
        terms = ogden_terms(values)
        lines.append(f"*mater_param structural:ogden_nterm {len(terms)}")
        for i, (mu, alpha) in enumerate(terms, start=1):
            lines.append(f"*mater_param structural:ogden_modulus_{i} {mu:.10g}")
            lines.append(f"*mater_param structural:ogden_exp_{i} {alpha:.10g}")
        return lines
    lines.append("*mater_option structural:mooney_model:five_term")
    constants = [(name, values.get(name, 0.0)) for name in ("C10", "C01", "C11", "C20", "C30")]
    return lines + [
        f"*mater_param structural:mooney_{name.lower()} {value:.10g}" for name, value in constants
    ]


def _by_hand(order: Order) -> list[tuple[str, float | str]]:
    """Return names and values of the constants that no public command sets."""
    material, units = rubber(order), order.units
    entries: list[tuple[str, float | str]] = []
    if WRITER.laws[material.law] not in _TYPES:
        values = stresses(order, material.instantaneous)
        entries.append(("model", WRITER.laws[material.law]))
        if material.law == "arruda_boyce":
            entries += [("nkT", values["mu"]), ("N", values["lambda_m"] ** 2)]
        else:
            entries += [("E", 3.0 * values["mu"]), ("Im", values["Jm"])]
    if material.bulk_modulus != float("inf"):
        entries.append(("bulk modulus", units.of_stress(material.bulk_modulus)))
    if material.series:
        entries.append(("viscoelastic", "VISCELOGDEN" if material.law == "ogden" else "VISCELMOON"))
    for i, (share, tau) in enumerate(instantaneous_shares(material), start=1):
        entries.append((f"term {i}: deviatoric multiplier", share))
        entries.append((f"term {i}: deviatoric relaxation time", units.of_time(tau)))
    return entries


WRITER = Writer(
    name="marc",
    title="Marc (procedure for Mentat)",
    kind="card",
    ending=".proc",
    comment=("|", ""),
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
        "run it in Mentat; values that no public command sets are in comments at its end, to be typed in",
    ),
    remarks_on={
        "series": "with viscoelastic terms the law is the instantaneous one",
        "incompressible": "of an incompressible rubber no bulk modulus is given: the program takes its own default",
    },
    source="Marc manual, volume A: Theory and User Information, Elastomer; Time-dependent behavior of elastomers; "
    "commands of Mentat in public scripts that run them",
)
