"""Ansys Mechanical APDL: TB,HYPER, TB,PRONY and TB,CDM.

TB,HYPER has the same energies as bushcli, with d = 2/kappa (1/d (J - 1)^2; Arruda-Boyce and Gent
1/d ((J^2 - 1)/2 - ln J)). With TB,PRONY the law is that of a sudden step, so the energy is multiplied by 1 + sum g and
the shares are g_i / (1 + sum g). d belongs to the bulk modulus, which does not relax. TB,CDM,,,,PSE2 is Ogden and
Roxburgh's model with m + beta Wm. Its energies are those of the virgin hyperelastic material, that is of TB,HYPER; with
TB,PRONY they are 1 + sum g times the long-term ones that m belongs to, so m is multiplied by the same factor.
"""

from __future__ import annotations

from bushcli.export.card import incompressibility, instantaneous_shares, ogden_terms, rubber, stresses
from bushcli.export.writer import Order, Writer

# Law -> option of TB,HYPER and its number of terms; for Ogden the terms are counted.
_OPTIONS = {
    "neo_hookean": ("NEO", 2),
    "mooney_rivlin": ("MOONEY", 2),
    "yeoh": ("YEOH", 3),
    "ogden": ("OGDEN", 0),
    "arruda_boyce": ("BOYCE", 3),
    "gent": ("GENT", 3),
}
_MATERIAL = 1


def write(order: Order) -> str:
    """Return the commands for material 1."""
    material, units = rubber(order), order.units
    lines = [f"/COM, {order.name}: material {_MATERIAL}"]
    lines.append(f"MP,DENS,{_MATERIAL},{units.of_density(material.density):.10g}")
    option, count = _OPTIONS[material.law]
    values, D = stresses(order, material.instantaneous), incompressibility(order)
    numbers = [*values.values(), D]
    if material.law == "neo_hookean":
        # The initial shear modulus, W = mu/2 (I1 - 3).
        numbers = [2.0 * values["C10"], D]
    elif material.law == "yeoh":
        numbers = [values["C10"], values["C20"], values["C30"], D, 0.0, 0.0]
    elif material.law == "ogden":
        terms = ogden_terms(values)
        count = len(terms)
        numbers = [n for term in terms for n in term] + [D] + [0.0] * (count - 1)
    lines += [f"TB,HYPER,{_MATERIAL},1,{count},{option}", *_data(numbers)]
    if material.series:
        lines.append(f"TB,PRONY,{_MATERIAL},1,{len(material.series)},SHEAR")
        lines += _data([n for a, tau in instantaneous_shares(material) for n in (a, units.of_time(tau))])
    if material.softening is not None:
        soft = material.softening
        lines.append(f"TB,CDM,{_MATERIAL},1,3,PSE2")
        lines += _data([1.0 / soft.inverse_r, units.of_stress(material.instantaneous * soft.m), soft.beta])
    return "\n".join(lines)


def _data(numbers: list[float]) -> list[str]:
    """Return TBDATA commands of six constants each."""
    return [
        ",".join([f"TBDATA,{i + 1}", *(f"{number:.10g}" for number in numbers[i : i + 6])])
        for i in range(0, len(numbers), 6)
    ]


WRITER = Writer(
    name="ansys",
    title="Ansys Mechanical APDL",
    kind="card",
    ending=".mac",
    comment=("!", ""),
    write=write,
    laws={law: f"TB,HYPER,,,,{option}" for law, (option, _) in _OPTIONS.items()},
    series="TB,PRONY",
    softening="TB,CDM,,,,PSE2",
    remarks_on={
        "incompressible": "d = 0 is an incompressible rubber: use elements with mixed u-P formulation",
        "series": "with TB,PRONY the constants of TB,HYPER, and m of TB,CDM, are the instantaneous ones",
    },
    source="Ansys Mechanical APDL Material Reference: Hyperelasticity; Viscoelasticity; Mullins effect",
)
