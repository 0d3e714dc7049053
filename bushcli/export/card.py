"""Numbers and parameters as material cards require them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from bushcli.errors import InputError, Problem
from bushcli.export.rubber import ExportedRubber
from bushcli.export.writer import Order

#: Laws of `*HYPERELASTIC`, in the format that Abaqus and CalculiX share.
LAWS = {
    "neo_hookean": "*HYPERELASTIC, NEO HOOKE",
    "mooney_rivlin": "*HYPERELASTIC, MOONEY-RIVLIN",
    "yeoh": "*HYPERELASTIC, YEOH",
    "ogden": "*HYPERELASTIC, OGDEN",
    "arruda_boyce": "*HYPERELASTIC, ARRUDA-BOYCE",
}


def rubber(order: Order) -> ExportedRubber:
    """Return the rubber of an order for a card."""
    assert order.rubber is not None
    return order.rubber


def stresses(order: Order, factor: float = 1.0) -> Mapping[str, float]:
    """Return the law's parameters in the order's units, the energy multiplied by a factor."""
    from forms.law import law

    material = rubber(order)
    model = law(material.law)
    return {
        name: order.units.of_stress(value) if model.parameter(name).unit == "MPa" else value
        for name, value in material.scaled_parameters(factor).items()
    }


def ogden_terms(values: Mapping[str, float]) -> list[tuple[float, float]]:
    """Return the pairs (mu_i, alpha_i) of an Ogden law, in the order of i."""
    return [(values[f"mu{i}"], values[f"alpha{i}"]) for i in (1, 2, 3) if f"mu{i}" in values]


def incompressibility(order: Order, factor: float = 1.0) -> float:
    """Return D = 2 / kappa of the energy 1/D (J - 1)^2, in the order's units; 0 for an incompressible rubber."""
    return 2.0 / order.units.of_stress(factor * rubber(order).bulk_modulus)


def poisson_field(order: Order, program: str, width: int) -> str:
    """Return Poisson's ratio right-aligned in a field; the program takes the bulk modulus from its distance from 0.5.

    Refused are digits that give another bulk modulus, and a ratio of zero, which counts as "not given".
    """
    shear, bulk = rubber(order).shear_modulus, rubber(order).bulk_modulus
    # As a difference from 0.5, so that a large bulk modulus neither overflows nor loses its digits.
    text = f"{0.5 - 1.5 * shear / (3 * bulk + shear):.{min(width - 2, 16)}f}".lstrip("0").rjust(width)
    ratio = float(text)
    if not 0.0 < ratio < 0.5 or not math.isclose(
        2 * shear * (1 + ratio) / (3 * (1 - 2 * ratio)), bulk, rel_tol=0.01
    ):
        raise bulk_refusal(order, program, f"takes Poisson's ratio, which would be written as {text.strip()}")
    return text


def bulk_refusal(order: Order, program: str, reason: str) -> InputError:
    """Return the error that a program would take another bulk modulus than that of the rubber."""
    what = f"the program {reason}: not the bulk modulus of {rubber(order).bulk_modulus:.6g} MPa"
    return InputError(
        Problem(f"--to {program}", what, "", "a rubber has some 2000: --set material.bulk_modulus=2000")
    )


def instantaneous_shares(material: ExportedRubber) -> list[tuple[float, float]]:
    """Return (share, tau in s) of each branch: the share of the instantaneous stiffness that relaxes with tau."""
    return [(g / material.instantaneous, tau) for g, tau in material.series]


def comma_lines(numbers: Sequence[float], per_line: int = 8) -> str:
    """Return numbers separated by commas, at most `per_line` on a line."""
    texts = [f"{number:.10g}" for number in numbers]
    return "\n".join(", ".join(texts[i : i + per_line]) for i in range(0, len(texts), per_line))


def field(number: float, width: int = 10) -> str:
    """Return a number right-aligned in a field, with as many digits as fit behind one blank."""
    if not math.isfinite(number):
        raise ValueError(f"{number} cannot be written into a card")
    best, error = "", math.inf
    for digits in range(min(width, 12), 0, -1):
        for text in (f"{number:.{digits}g}", f"{number:.{digits}e}", f"{number:.{digits}f}"):
            mantissa, e, exponent = text.partition("e")
            short = f"{mantissa}e{int(exponent)}" if e else text
            # Fortran takes a number with a decimal point as real.
            short = short if "." in short or "e" in short else f"{short}."
            if len(short) < width and abs(float(short) - number) < error:
                best, error = short, abs(float(short) - number)
    return best.rjust(width)


def hyperelastic(order: Order, moduli: str = "", absent: float = 0.0) -> str:
    """Return `*HYPERELASTIC` with its data lines; `absent` is the number for D_i of terms that the law lacks.

    Abaqus and CalculiX define the energy alike: invariants and stretches isochoric, D1 = 2/kappa, neo-Hookean,
    Mooney-Rivlin and Yeoh with 1/D1 (J - 1)^2, Ogden sum 2 mu_i/alpha_i^2 (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3),
    so that mu = sum mu_i, and Arruda-Boyce with 1/D ((J^2 - 1)/2 - ln J). bushcli's Ogden has mu_i/alpha_i: its mu_i is
    multiplied by alpha_i / 2 (Abaqus Analysis User's Guide, Hyperelastic behavior of rubberlike materials; Dhondt,
    CalculiX CrunchiX User's Manual, *HYPERELASTIC).
    """
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
