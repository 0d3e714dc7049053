"""Checks that need more than one key: the law's parameters, and modes against the shape."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from annotated_types import Ge, Gt

from bushcli.case.case import Material, parameter_terms
from bushcli.case.finding import Finding, Keys, dotted_key, toml_text, unknown_name, wrong_key, wrong_value
from bushcli.case.hardness import HIGHEST, LOWEST
from bushcli.case.limits import MOST_SHEAR
from bushcli.case.typical import SHEAR_WORDS
from bushcli.errors import nearest
from cases.mode import modes
from forms.law import Parameter, laws
from geometry.shape import Shape, Sleeve
from geometry.size import LARGEST

_PARAMETERS: Keys = ("material", "parameters")
# MPa; four decades beyond any rubber on both sides, so that residuals and tolerances stay well above rounding.
SHEAR = (1e-5, 1e5)
# kg/m3: cellular rubber, and rubber filled with lead.
DENSITIES = (100.0, 5000.0)
# Bulk over shear modulus at a Poisson's ratio of zero.
LEAST_BULK = 2.0 / 3.0
# mm: if the largest dimension is below this, the dimensions are in metres.
SMALLEST_SHAPE = 0.5
# mm, MPa: below these a mesh has elements that no solver resolves.
SMALLEST_DIMENSION, SOFTEST_SLEEVE = 1e-3, 1.0
# mm, rad, or stretch - 1: below it forces drown in the rounding of displacements.
SMALLEST_TRAVEL = 1e-6


def density(value: float) -> Iterator[Finding]:
    """Check that a density in kg/m3 can be that of a rubber."""
    if not DENSITIES[0] <= value <= DENSITIES[1]:
        what = f"material.density = {value:g} kg/m3 is not that of a rubber"
        expected = f"{DENSITIES[0]:g} to {DENSITIES[1]:g} kg/m3; a density in g/cm3 is multiplied by 1000"
        yield Finding(("material", "density"), what, expected=expected)


def parameters(material: Material) -> Iterator[Finding]:
    """Check that the law's parameters are known, complete, within bounds and give a stiff rubber at rest."""
    law = laws()[material.law]
    terms, keys = parameter_terms(material.law), ("material", "terms")
    if material.terms is not None and len(terms) == 1:
        yield Finding(keys, f"material.terms: law {material.law} has no terms to choose")
    elif material.terms is not None and material.terms > len(terms):
        what = f"material.terms = {material.terms} is too many"
        yield Finding(keys, what, expected=f"{material.law} has 1 to {len(terms)}")
    elif material.terms is not None and material.parameters:
        what = "material.terms is for a law without parameters, but material.parameters are given"
        yield Finding(keys, what, expected="give one of them")
    if not material.parameters:
        return
    sound = True
    for name, value in material.parameters.items():
        parameter = next((p for p in law.parameters if p.name == name), None)
        if parameter is None:
            sound = False
            names = [p.name for p in law.parameters]
            what = f"is not a parameter of {law.name}"
            yield wrong_key((*_PARAMETERS, name), what, ", ".join(names), suggested=nearest(name, names))
        elif not parameter.admits(value):
            sound = False
            yield wrong_value((*_PARAMETERS, name), value, "is out of bounds", _bounds(parameter))
    # Required ones, and the rest of each term of which one is given.
    started = [group for group in terms[1:] if any(name in material.parameters for name in group)]
    for name in (name for group in (terms[0], *started) for name in group if name not in material.parameters):
        sound = False
        parameter = law.parameter(name)
        expected = f"{law.name}: {parameter.meaning}, {_bounds(parameter)}"
        yield wrong_key((*_PARAMETERS, name), "is missing", expected)
    if sound:
        yield from moduli(material)


def moduli(material: Material) -> Iterator[Finding]:
    """Check the shear and the bulk modulus at rest of a material with parameters."""
    shear = laws()[material.law].shear_modulus(**material.parameters)
    what = f"material.parameters give an initial shear modulus of {shear:.3g} MPa"
    if not shear > 0:
        yield Finding(_PARAMETERS, what, expected="it must be positive, or the rubber is unstable at rest")
    elif not SHEAR[0] <= shear <= SHEAR[1]:
        expected = f"{SHEAR[0]:g} to {SHEAR[1]:g} MPa: {SHEAR_WORDS}; are the parameters in MPa?"
        yield Finding(_PARAMETERS, what, expected=expected)
    elif material.bulk_modulus < LEAST_BULK * shear:
        keys = ("material", "bulk_modulus")
        given = f"{dotted_key(keys)} = {toml_text(material.bulk_modulus)}"
        what = f"{given} is too small for a shear modulus of {shear:.3g} MPa"
        expected = f"at least {LEAST_BULK * shear:.3g} MPa, or Poisson's ratio is negative; rubber has 1000 to 3000 MPa"
        yield Finding(keys, what, expected=expected)


def dimensions(shape: Shape) -> Iterator[Finding]:
    """Check that the dimensions are plausible in millimetres."""
    sizes = {
        name: value
        for name, field in type(shape).model_fields.items()
        if isinstance(value := getattr(shape, name), float)
        and "mm" in (field.description or "")
        # Of a coordinate, which has no lower bound, zero and negative values mean a place like any other.
        and any(isinstance(bound, (Gt, Ge)) for bound in field.metadata)
    }
    plates = shape.elastic_sleeves.items()
    sleeves = {f"{name}.thickness": plate.thickness for name, plate in plates if isinstance(plate, Sleeve)}
    for name, value in (sizes | sleeves).items():
        if 0.0 < abs(value) < SMALLEST_DIMENSION:
            what = f"geometry.{name} = {toml_text(value)} is too small to mesh"
            expected = f"at least {SMALLEST_DIMENSION:g} mm"
            yield Finding(("geometry", *name.split(".")), what, expected=expected)
            return
    for name, sleeve in shape.elastic_sleeves.items():
        if sleeve.youngs_modulus < SOFTEST_SLEEVE:
            given = toml_text(sleeve.youngs_modulus)
            what = f"geometry.{name}.youngs_modulus = {given} is softer than rubber"
            expected = f"at least {SOFTEST_SLEEVE:g} MPa; aluminium has 70000"
            yield Finding(("geometry", name, "youngs_modulus"), what, expected=expected)
            return
    if not sizes:
        return
    name, largest = max(sizes.items(), key=lambda size: abs(size[1]))
    if abs(largest) < SMALLEST_SHAPE:
        what = f"geometry.{name} = {toml_text(largest)} is the largest dimension: no bushing is so small"
        expected = f"dimensions are in mm; if this one is in metres, write {1e3 * largest:g}"
        yield Finding(("geometry", name), what, expected=expected)
    elif abs(largest) > LARGEST:
        what = f"geometry.{name} = {toml_text(largest)}: no bushing is so large"
        yield Finding(("geometry", name), what, expected=f"dimensions are in mm, at most {LARGEST:g}")


def hardness(shore_a: float, other_keys: Sequence[str], coupons: bool) -> Iterator[Finding]:
    """Check a hardness that is given for the law's parameters, and that nothing better is given beside it.

    Parameters
    ----------
    shore_a : float
        Shore A hardness, a number without a unit.
    other_keys : sequence of str
        Keys of ``[material]`` that are given as well and determine the law.
    coupons : bool
        Whether there are coupon tests.
    """
    keys = ("material", "hardness")
    if not LOWEST <= shore_a <= HIGHEST:
        what = f"material.hardness = {shore_a:g} is no hardness for which Gent's relation holds"
        yield Finding(keys, what, expected=f"Shore A, {LOWEST:g} to {HIGHEST:g}")
    sources = [f"material.{name}" for name in other_keys] + ["[[coupons]]"] * coupons
    if sources:
        what = f"material.hardness and {' and '.join(sources)} are given: a hardness says less than they do"
        yield Finding(keys, what, expected="leave material.hardness out")


def _bounds(parameter: Parameter) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    if math.isinf(parameter.upper):
        return "a finite number" if math.isinf(parameter.lower) else f"at least {parameter.lower:g}{unit}"
    if math.isinf(parameter.lower):
        return f"at most {parameter.upper:g}{unit}"
    return f"{parameter.lower:g} to {parameter.upper:g}{unit}"


def mode(
    keys: Keys, name: str, specimen: str, shape: str | None, bulk_modulus: float | None
) -> Iterator[Finding]:
    """Check that a mode exists, that it suits the specimen, and that the rubber's bulk modulus permits it.

    Yield a finding for the first of these checks that fails.

    Parameters
    ----------
    keys : Keys
        Place of the table that names the mode, such as ``("load_cases", 0)``.
    name : str
        Name of the mode as written in the case file.
    specimen : str
        "bushing" or "coupon", which the mode has to suit.
    shape : str or None
        Name of the shape that demands this specimen; None where the section of the case file demands it.
    bulk_modulus : float or None
        MPa, inf for an incompressible rubber; None where the material is not known.
    """
    mode_of_name = modes().get(name)
    fitting = [other.name for other in modes().values() if other.specimen == specimen]
    if mode_of_name is None:
        yield unknown_name((*keys, "mode"), name, fitting, "mode")
    elif mode_of_name.specimen != specimen:
        owner = f'shape "{shape}"' if shape else f"[[{keys[0]}]]"
        setting = f"{dotted_key((*keys, 'mode'))} = {toml_text(name)}"
        what = f"{setting} is a mode of a {mode_of_name.specimen}, but {owner} is a {specimen}"
        yield Finding((*keys, "mode"), what, expected=", ".join(fitting))
    elif (
        mode_of_name.needs_compressibility
        and bulk_modulus is not None
        and math.isinf(bulk_modulus)
        and keys[0] != "coupons"  # from which it is identified
    ):
        what = "needs a finite material.bulk_modulus"
        yield wrong_value((*keys, "mode"), name, what, "e.g. bulk_modulus = 2000.0, MPa")


def travel(keys: Keys, mode: str, path: Sequence[float], shape: Shape) -> Iterator[Finding]:
    """Check that a path neither closes the gap between the sleeves nor is too small to simulate.

    Parameters
    ----------
    keys : Keys
        Place of the path or amplitude in the case file.
    mode : str
        Name of the mode.
    path : sequence of float
        Displacements in mm, rad or stretch - 1.
    shape : Shape
        The specimen; its rubber thickness (mm) bounds a radial path.
    """
    kind, amplitude = modes()[mode], max(map(abs, path), default=0.0)
    if 0.0 < amplitude < SMALLEST_TRAVEL:
        unit = "rad" if kind.rotational else "mm"
        unit = {True: "of shear", False: "of stretch"}[kind.sheared] if kind.specimen == "coupon" else unit
        what = f": a travel of {amplitude:g} {unit} is too small to simulate"
        expected = f"at least {SMALLEST_TRAVEL:g} {unit}, enough for the initial stiffness"
        yield wrong_key(keys, what, expected)
    if kind.specimen == "coupon" and not kind.sheared and min(path, default=0.0) <= -1.0:
        what = f"= {min(path):g} compresses the specimen to zero length"
        yield wrong_key(keys, what, "stretch - 1, above -1")
    if kind.specimen == "bushing":
        along, angle = (0.0, amplitude) if kind.rotational else (amplitude, 0.0)
        lever = 0.0 if shape.wall is None else shape.wall.facing
        yield from too_far(keys, shape, kind.moves_across(amplitude, lever), along, angle)


def too_far(keys: Keys, shape: Shape | None, across: float, along: float, angle: float) -> Iterator[Finding]:
    """Yield the first reason for which a sleeve cannot move so far.

    Parameters
    ----------
    keys : Keys
        Place of the path in the case file.
    shape : Shape
    across, along, angle : float
        Largest displacement of the inner sleeve's axis across itself where the bonds face each other, and of its
        centre in any direction, mm; largest angle, rad.
    """
    if shape is None:
        return
    annulus = shape.annulus
    if shape.gap is not None and across >= shape.gap:
        what = f"= {across:g} closes the gap between the sleeves"
        if angle:
            moved = f"= {math.degrees(angle):g} moves an end of the sleeve by {across:.4g} mm"
            what = f"{moved}, which closes the gap between the sleeves"
        expected = f"a displacement below the rubber's thickness, {shape.gap:g} mm"
        yield wrong_key(keys, what, expected)
    elif annulus is not None and along > MOST_SHEAR * annulus.thickness:
        most = MOST_SHEAR * annulus.thickness
        what = f"= {along:g} is {along / annulus.thickness:.0f} times the rubber's thickness"
        expected = f"at most {most:g} mm: beyond that rubber tears"
        yield wrong_key(keys, what, expected)
    elif angle > math.pi:
        what = f"= {math.degrees(angle):g} turns the sleeve by more than 180 degrees"
        expected = "an angle in degrees, at most 180"
        yield wrong_key(keys, what, expected)
