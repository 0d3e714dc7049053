"""Radioss: /MAT/LAW42, LAW92, LAW94, LAW100, with a Prony series or Mullins softening.

LAW42 (Ogden) has W = sum mu_p/alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3) + kappa/2 (J - 1)^2 as bushcli,
with G_i and tau_i in addition. Neo-Hookean and Mooney-Rivlin are Ogden with exponents 2 and -2: mu_1 = 2 C10,
mu_2 = -2 C01. LAW92 is the five-term series of Arruda and Boyce, LAW94 Yeoh's cubic, both with D = 2/kappa.
/FAIL/MULLINS_OR, whose formula equals bushcli's, is documented for LAW92, LAW95 and LAW100: with it the polynomial
laws become LAW100, which takes no Prony series.

Zeros that the starter replaces (OpenRadioss, starter/source/materials/mat, hm_read_mat42.F, hm_read_mat92.F,
hm_read_mat94.F): Poisson's ratio and D1 by a ratio of 0.495, so neither is written as zero; the cut-off stress by
1e20 and the scale factors by 1, which is meant. D2 = D3 = 0 of LAW94 are terms that are absent.
"""

from __future__ import annotations

from bushcli.errors import InputError, Problem
from bushcli.export.card import field, incompressibility, ogden_terms, poisson_field, rubber, stresses
from bushcli.export.writer import Order, Writer

# Law -> Flag_HE of LAW100.
_HYPERELASTIC = {"neo_hookean": 3, "mooney_rivlin": 4, "yeoh": 5}


def write(order: Order) -> str:
    """Return the material with id 1; refuse a Prony series beside Mullins softening, which only LAW92 takes."""
    material = rubber(order)
    if material.softening is not None and material.series and material.law != "arruda_boyce":
        what = f"Radioss combines a Prony series with Mullins softening for arruda_boyce only, not for {material.law}"
        remedy = "leave one of them out: --without viscoelasticity or --without mullins"
        raise InputError(Problem("--to radioss", what, "", remedy))
    if material.law == "arruda_boyce":
        lines = _boyce(order)
    elif material.softening is not None:
        lines = [
            *_head(order, "LAW100"),
            "#    N_NET   FLAG_HE   FLAG_CR",
            f"{0:10d}{_HYPERELASTIC[material.law]:10d}{0:10d}",
            "#  constants of the law, then D1",
            _row(*stresses(order).values(), incompressibility(order)),
        ]
    elif material.law == "yeoh":
        lines = [
            *_head(order, "LAW94"),
            "",
            "#                C10                 C20                 C30",
            _row(*(stresses(order)[name] for name in ("C10", "C20", "C30"))),
            "#                 D1                  D2                  D3",
            _row(incompressibility(order), 0.0, 0.0),
        ]
    else:
        lines = _ogden(order)
    if material.softening is not None:
        soft = material.softening
        lines += [
            "/FAIL/MULLINS_OR/1",
            "#                  R                BETA                   m",
            _row(1.0 / soft.inverse_r, soft.beta, order.units.of_stress(soft.m)),
        ]
    return "\n".join(lines)


def _row(*numbers: float) -> str:
    return "".join(field(number, 20) for number in numbers)


def _head(order: Order, law: str) -> list[str]:
    ro = order.units.of_density(rubber(order).density)
    return [f"/MAT/{law}/1", order.name, "#              RHO_I", _row(ro)]


def _ogden(order: Order) -> list[str]:
    material, values, units = rubber(order), stresses(order), order.units
    terms = ogden_terms(values) if material.law == "ogden" else [(2.0 * values["C10"], 2.0)]
    if material.law == "mooney_rivlin":
        terms.append((-2.0 * values["C01"], -2.0))
    padded = terms + [(0.0, 0.0)] * (5 - len(terms))
    lines = _head(order, "LAW42")
    lines += [
        "#                 NU           SIGMA_CUT           FUNIDBULK         FSCALE_BULK         M",
        f"{poisson_field(order, 'radioss', 20)}{_row(0.0)}{'':10s}{0:10d}{field(0.0, 20)}{len(material.series):10d}",
        "#               MU_1                MU_2                MU_3                MU_4                MU_5",
        _row(*(mu for mu, _ in padded)),
        "",
        "#            ALPHA_1             ALPHA_2             ALPHA_3             ALPHA_4             ALPHA_5",
        _row(*(alpha for _, alpha in padded)),
        # The two blank lines are part of the format; the line after them keeps the second from being stripped.
        "",
        "#",
    ]
    if material.series:
        modulus = units.of_stress(material.shear_modulus)
        lines += [
            "#                G_i",
            _row(*(g * modulus for g, _ in material.series)),
            "#              TAU_i",
            _row(*(units.of_time(tau) for _, tau in material.series)),
        ]
    return lines


def _boyce(order: Order) -> list[str]:
    material, values, units = rubber(order), stresses(order), order.units
    lines = [
        *_head(order, "LAW92"),
        "#                 MU                   D            LAMBDA_M",
        _row(values["mu"], incompressibility(order), values["lambda_m"]),
        "#    ITYPE    FCT_ID                  NU              FSCALE",
        f"{0:10d}{0:10d}{_row(0.0, 0.0)}",
    ]
    if material.series:
        modulus = units.of_stress(material.shear_modulus)
        lines += ["/VISC/PRONY/1", "#        M                            K_v"]
        lines.append(f"{len(material.series):10d}{'':10s}{field(0.0, 20)}")
        lines.append("#                G_i              BETA_i                 K_i             BETA_ki")
        lines += [_row(g * modulus, 1.0 / units.of_time(tau), 0.0, 0.0) for g, tau in material.series]
    return lines


WRITER = Writer(
    name="radioss",
    title="Radioss",
    kind="card",
    ending="_0000.rad",
    comment=("#", ""),
    write=write,
    laws={
        "neo_hookean": "/MAT/LAW42",
        "mooney_rivlin": "/MAT/LAW42",
        "ogden": "/MAT/LAW42",
        "yeoh": "/MAT/LAW94",
        "arruda_boyce": "/MAT/LAW92",
    },
    series="a Prony series",
    softening="/FAIL/MULLINS_OR",
    series_laws=frozenset({"neo_hookean", "mooney_rivlin", "ogden", "arruda_boyce"}),
    softening_laws=frozenset({"neo_hookean", "mooney_rivlin", "yeoh", "arruda_boyce"}),
    incompressible=False,
    remarks=("the deck's /BEGIN states the units; no unit_ID is given here",),
    source="Altair Radioss Reference Guide 2021: /MAT/LAW42, LAW92, LAW94, LAW100, /VISC/PRONY, /FAIL/MULLINS_OR",
)
