"""What a case simulates, in words: geometry, contact, law, effects, tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bushcli.case.case import DENSITY
from bushcli.case.unit import case_file_number, case_file_unit, parameters_in_degrees
from bushcli.report.quantity import number
from forms.law import laws

if TYPE_CHECKING:
    from bushcli.case import Case, Material
    from geometry.shape import Shape

# Bulk over shear modulus of heavily filled rubber, the least that rubber has (the prior of `compressibility`).
LEAST_RATIO = 50.0


def conditions(case: Case, material: Material | None = None, source: str = "") -> list[tuple[str, str]]:
    """Return the simulated conditions as pairs of name and value in words."""
    shape = case.geometry
    entries = shape.model_dump()
    numbers = {k: v for k, v in entries.items() if isinstance(v, int | float) and not isinstance(v, bool)}
    words = {k: v for k, v in entries.items() if isinstance(v, str) and k != "contact"}
    sizes = [f"{_words(k)} {v:g} {'degrees' if 'angle' in k else 'mm'}" for k, v in numbers.items()]
    sizes += [f"{_words(k)} {v}" for k, v in words.items()]
    rows = [("geometry", ": ".join([type(shape).name, *([", ".join(sizes)] if sizes else [])]))]
    if size := size_of(shape):
        rows.append(("size", size))
    units = {"thickness": " mm", "youngs_modulus": " MPa"}
    for name, sleeve in ((k, v) for k, v in entries.items() if k.endswith("sleeve")):
        texts = [
            f"{_words(k)} {v if isinstance(v, str) else f'{v:g}'}{units.get(k, '')}"
            for k, v in (sleeve or {}).items()
        ]
        rows.append((_words(name), "rigid" if sleeve is None else f"elastic: {', '.join(texts)}"))
    if "contact" in entries:
        rows.append(("contact", _contact(shape)))
    used = material or case.material
    parameters = ", ".join(f"{name} = {value:.4g}" for name, value in used.parameters.items())
    if not parameters:
        parameters = f"to be identified from the {'coupon tests' if case.coupons else 'recordings'}"
    elif source or not case.material.parameters:
        parameters += f" (identified from the {source or 'coupon tests'})"
    rows.append(("law", f"{used.law}: {parameters}"))
    finite = np.isfinite(used.bulk_modulus)
    bulk = f"{number(used.bulk_modulus, 4)} MPa" if finite else "infinite: incompressible"
    law = laws()[used.law]
    if {p.name for p in law.parameters if not p.optional} <= set(used.parameters):
        solid = used.bulk_modulus >= LEAST_RATIO * law.shear_modulus(**used.parameters)
        bulk += "" if solid else ": far more compressible than rubber, which has 1000 to 3000 MPa"
    rows.append(("bulk modulus", bulk))
    if case.vibrations:
        rows.append(("density", f"{used.density / DENSITY:.4g} kg/m3"))
    rows += _effects(case)
    if case.toleranced:
        ranges = (f"{key} {of.nominal:g} ± {of.deviation:g}" for key, of in case.toleranced.items())
        rows.append(("tolerances", ", ".join(ranges)))
    if case.tolerance != type(case.tolerance)():  # the default is not mentioned
        rows.append(("accepted", f"simulations within {case.tolerance.text} of the measurement"))
    return rows


def size_of(shape: Shape) -> str:
    """Return the overall size of a geometry file, and how thick the rubber is; empty for a shape by its dimensions."""
    wall = "" if shape.wall is None else f", rubber {shape.wall.thickness:.4g} mm between the bonds"
    return "" if shape.overall is None else f"{shape.overall:.4g} mm overall{wall}"


def _effects(case: Case) -> list[tuple[str, str]]:
    """Return a row for each effect of a case: values, and the channels that have it if it is not on all."""
    channels = [(recording.label, recording.mode) for recording in case.recordings]
    channels += [(load.mode, load.mode) for load in case.load_cases]
    rotational = parameters_in_degrees(case.effects, channels)
    rows = []
    for effect in case.effects:
        values = []
        for p in effect.parameters:
            if p.choices:
                values.append(_words(p.choices[round(effect.values[p.name])]))
                continue
            angular, text = effect.full_name(p) in rotational, "to be identified"
            if p.name in effect.values:
                value = case_file_number(p, effect.values[p.name], angular)
                text = f"{value:.4g} {case_file_unit(p, angular)}".removesuffix(" 1")
            values.append(f"{_words(p.name)} {text}")
        on = "" if effect.channels is None else f" (in {', '.join(effect.channels)})"
        rows.append(("effect", f"{_words(effect.effect.name)}{on}: {', '.join(values)}"))
    return rows


def _contact(shape: Shape) -> str:
    """Return whether contact is modelled, between which surfaces, and from when on it is active."""
    if not shape.contact_surfaces:
        return "not modelled (geometry.contact = false): surfaces that meet pass through each other"
    metal = shape.elastic_sleeves
    surfaces = "between the free surfaces of the rubber"
    surfaces += f" and of {', '.join(map(_words, metal))}" if metal else ""
    if shape.contact_surfaces == "sleeves":
        surfaces += ", and the rigid sleeves beyond their bonds"
    elif shape.beyond:
        surfaces += f", and the {' and the '.join(shape.beyond)} sleeve beyond the bond, as drawn"
    return f"{surfaces}, without friction; active from the step in which surfaces meet"


def _words(key: str) -> str:
    return key.replace("_", " ")
