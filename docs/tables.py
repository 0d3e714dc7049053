"""The tables of docs/{case-file,effects,diagnosis-details,exports}.md that list what there is, from the code.

``setup/enter python docs/tables.py`` brings the pages up to date after a shape, a law, a mode or an effect was added
or changed; tests/unit/test_docs.py says when that has been forgotten.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from bushcli.case.unit import case_file_unit
from bushcli.effects.effect import Effect, EffectParameter, effect_in_force_law, effects, effects_on
from bushcli.effects.prior import Prior
from bushcli.evidence import prior
from bushcli.export import SYSTEMS, all_writers
from cases.mode import modes
from forms.law import laws
from geometry.shape import Sleeve, Snubber, shapes

PAGES = [
    Path(__file__).with_name(name)
    for name in ("case-file.md", "effects.md", "diagnosis-details.md", "exports.md")
]
_ACTS = {"rubber": "In the rubber", "assembly": "In the assembly", "rig": "In the rig"}
ROOT = Path(__file__).resolve().parents[1]
# Rooms whose constants decide on a fit, a probability or a sentence of a diagnosis.
_WITH_CONSTANTS = ("likelihood", "evidence", "inverse", "selection", "mismatch", "diagnosis")
# A constant is a number or made of numbers, not a text.
_NUMBER, _WORD = re.compile(r"\d"), re.compile(r"[\"']|\bre\.|^[A-Z]\w*\(")
_UNIT = re.compile(r", (mm|MPa|degrees|kg/m3)\b")


def table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a Markdown table."""
    lines = [heads, tuple("---" for _ in heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def fields(model: Mapping[str, FieldInfo]) -> str:
    """Return the table of a pydantic model's keys: unit, default and meaning."""
    rows = []
    for name, field in model.items():
        meaning = field.description or ""
        unit = _UNIT.search(meaning)
        if get_origin(field.annotation) is Literal:
            meaning += "; one of " + ", ".join(f'`"{choice}"`' for choice in get_args(field.annotation))
        rows.append((f"`{name}`", unit[1] if unit else "", _default(field), _UNIT.sub("", meaning, count=1)))
    return table(("key", "unit", "default", "meaning"), rows)


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    shown: Any = field.default
    return "absent" if shown is None else f'`"{shown}"`' if isinstance(shown, str) else f"`{shown}`"


def shapes_text() -> str:
    """Return one section per shape."""
    parts = []
    for name, shape in shapes().items():
        keys = fields(shape.model_fields) if shape.model_fields else "It has no dimensions."
        parts.append(f'#### `shape = "{name}"`\n\n{shape.summary[0].upper()}{shape.summary[1:]}.\n\n{keys}')
    return "\n\n".join(parts)


def laws_text() -> str:
    """Return the laws' energies and parameters."""
    parts = []
    for law in laws().values():
        rows = [
            (
                f"`{p.name}`",
                "" if p.unit == "1" else p.unit,
                f"{p.lower:g} to {p.upper:g}",
                p.meaning + (" (optional)" if p.optional else ""),
            )
            for p in law.parameters
        ]
        keys = table(("parameter", "unit", "bounds", "meaning"), rows)
        parts.append(f'#### `law = "{law.name}"`\n\n`{law.summary}`. {law.source}.\n\n{keys}')
    return "\n\n".join(parts)


def modes_text() -> str:
    """Return the modes with the units of their curves."""
    rows = []
    for mode in modes().values():
        coupon = mode.specimen == "coupon"
        strain = "amount of shear" if mode.sheared else "stretch - 1"
        units = (strain, "MPa") if coupon else ("degrees", "N mm") if mode.rotational else ("mm", "N")
        remark = "; needs a finite `bulk_modulus`" if mode.needs_compressibility else ""
        rows.append((f"`{mode.name}`", mode.specimen, *units, mode.summary + remark))
    return table(("mode", "specimen", "displacement", "force", "what is done"), rows)


def effects_text() -> str:
    """Return the effects by where they act, each with what it means."""
    rows = []
    for acts, where in _ACTS.items():
        for effect in (one for one in effects().values() if one.acts == acts):
            amplitudes = ", ".join(f"`{p.name}`" for p in effect.amplitudes if not p.optional)
            rows.append((f"[`{effect.name}`](#{effect.name})", where.lower(), effect.summary, amplitudes))
    return table(("effect", "where", "what it means", "amplitudes"), rows)


def effect_text(effect: Effect) -> str:
    """Return the parameters of an effect, and what is to be known of it."""
    rows = [
        (
            f"`{p.name}`"
            + (f", or `{p.reciprocal[0]}` = 1/`{p.name}`" if p.reciprocal else "")
            + (f" (results also give `{p.exponential}` = exp(`{p.name}`))" if p.exponential else ""),
            _units(p),
            ", ".join(f'`"{choice}"`' for choice in p.choices) or f"{p.lower:g} to {p.upper:g}{_within(p)}",
            "" if p.off is None else f"{p.off:g}",
            p.meaning + (" (optional)" if p.optional else ""),
        )
        for p in effect.parameters
    ]
    acts = [mode for mode in modes() if effect.acts_on(mode, None)]
    where = "" if "static" in effect.kinds else "; on tables of dynamic stiffness alone"
    facts = [
        f"- in words: {effect.title}",
        f"- acts on: {'all modes' if len(acts) == len(modes()) else ', '.join(acts)}{where}",
        f"- a recording must contain: {effect.needs}",
        f"- looks like: {', '.join(f'[{name}](#{name})' for name in effect.rivals)}",
        f"- source: {effect.source}",
    ]
    return table(("parameter", "unit", "bounds", "off", "meaning"), rows) + "\n\n" + "\n".join(facts)


def _within(parameter: EffectParameter) -> str:
    if parameter.within is None:
        return ""
    name, share = parameter.within
    return f", at most {share:g} of the rubber's {name.replace('/', ' over its ')}"


def _units(parameter: EffectParameter) -> str:
    turned = case_file_unit(parameter, rotational=True)
    own = "" if parameter.unit == "1" else turned if parameter.unit.startswith("rad/") else parameter.unit
    other = parameter.reciprocal[1].replace("/rad", "/degree") if parameter.reciprocal else "1"
    return (
        own
        + (f" ({turned})" if turned not in (own, parameter.unit) else "")
        + (f", or {other}" if other != "1" else "")
    )


def odds_text() -> str:
    """Return the prior odds, the most common effects first."""
    by_odds: dict[float, list[str]] = {}
    for name in effects_on("static"):
        by_odds.setdefault(prior.effect_odds(name), []).append(f"[`{name}`](effects.md#{name})")
    rows = [(", ".join(names), f"{odds:g}") for odds, names in sorted(by_odds.items(), reverse=True)]
    in_tables: dict[float, list[str]] = {}
    for name in effects_on("dynamic"):
        odds = prior.effect_odds(name, in_tables=True)
        if name not in effects_on("static") or odds != prior.effect_odds(name):
            in_tables.setdefault(odds, []).append(f"[`{name}`](effects.md#{name})")
    rows += [
        (", ".join(n) + ", with tables of dynamic stiffness", f"{odds:g}") for odds, n in in_tables.items()
    ]
    rows += [
        ("`unknown`: something that is not in the catalogue", f"{prior.UNKNOWN:g}"),
        ("another law than the case's", f"{prior.OTHER_LAW:g}"),
        (
            "another law than the case's if that has a single parameter, beside recordings along a path",
            f"{prior.OTHER_THAN_ONE_PARAMETER:g}",
        ),
        ("a law identified from the recordings in place of the coupons'", f"{prior.FREED_LAW:g}"),
    ]
    return table(("what is added to the plain law", "prior odds"), rows)


def priors_text() -> str:
    """Return what is known of each parameter of an effect before any recording."""
    rows = [
        (f"`{effect.name}.{p.name}`", _density(p.prior, p.unit), p.prior.source)
        for effect in effects_on("static").values()
        for p in effect.parameters
        if p.prior is not None
    ]
    return table(("parameter", "prior", "source"), rows)


def _density(known: Prior, unit: str) -> str:
    """Say a prior in words."""
    if known.shape == "choice":
        return f"{known.low:g} choices, equally probable"
    of = f" times {known.of}" if known.of else "" if unit == "1" else f" {unit}"
    sign = ", either sign" if known.signed else ""
    if known.shape == "log_uniform":
        return f"log-uniform, {known.low:g} to {known.high:g}{of}{sign}"
    if known.shape == "log_normal":
        return f"log-normal, median {known.low:g}{of}, std of the logarithm {known.high:g}{sign}"
    return f"{known.shape.replace('_', '-')}, std {known.low:g}{of}"


def constants(file: Path) -> list[tuple[str, str]]:
    """Return the numeric constants of a module and the comment above them, which says what they are and their source.

    Constants below one comment, without a blank line between them, share it.
    """
    lines = file.read_text(encoding="utf-8").splitlines()
    groups: list[tuple[list[str], list[str], int]] = []
    for node in ast.parse("\n".join(lines)).body:
        text = ast.get_source_segment("\n".join(lines), node) or ""
        named = re.match(r"_?[A-Z][A-Z0-9_]*(, _?[A-Z][A-Z0-9_]*)*(: [^=]+)? = ", text)
        if named is None or not _NUMBER.search(text[named.end() :]) or _WORD.search(text[named.end() :]):
            continue
        first = node.lineno - 1
        while first and lines[first - 1].startswith("#"):
            first -= 1
        comment = [line.lstrip("#: ") for line in lines[first : node.lineno - 1]]
        shown = f"`{' '.join(text.split())}`".replace(", dtype=np.float64", "").replace("np.", "")
        if not comment and groups and groups[-1][2] == first:
            groups[-1] = ([*groups[-1][0], shown], groups[-1][1], node.end_lineno or 0)
        else:
            groups.append(([shown], comment, node.end_lineno or 0))
    return [("<br>".join(names), " ".join(comment)) for names, comment, _ in groups]


def constants_text() -> str:
    """Return the constants of the calculation by module."""
    rows = []
    for file in (file for room in _WITH_CONSTANTS for file in sorted((ROOT / "bushcli" / room).glob("*.py"))):
        module = f"`{file.parent.name}/{file.stem}`"
        for names, comment in constants(file):
            rows.append((module, names, comment.replace("|", "\\|")))
            module = ""
    return table(("module", "constants", "what they are, and their source"), rows)


def units_text() -> str:
    """Return the systems of units of exports."""
    rows = [
        (f"`{one.name}`", one.force_name, one.length_name, one.time_name, one.stress_name, one.density_name)
        for one in SYSTEMS.values()
    ]
    return table(("`--units`", "force", "length", "time", "stress", "density"), rows)


def cards_text() -> str:
    """Return what each program's card can express."""
    cards = [one for one in all_writers().values() if one.kind == "card"]
    heads = ("", *(f"`{one.name}`" for one in cards))
    rows = [(f"`{name}`", *(_called(one.laws.get(name, "")) for one in cards)) for name in laws()]
    series = (_called(one.series, one.series_laws, one.laws) for one in cards)
    softening = (_called(one.softening, one.softening_laws, one.laws) for one in cards)
    bulk = ("yes" if one.incompressible else "no" for one in cards)
    viscous, softens = (f"`{effect_in_force_law(part).name}`" for part in ("maxwell", "softening"))
    rows += [(viscous, *series), (softens, *softening), ("incompressible", *bulk)]
    return table(heads, rows)


def _called(name: str, only: frozenset[str] | None = None, known: Mapping[str, str] | None = None) -> str:
    if not name:
        return "no"
    lacking = [law for law in known or {} if only is not None and law not in only]
    return f"`{name}`" + (f", not with {', '.join(lacking)}" if lacking else "")


def brought_up_to_date(page: str) -> str:
    """Return the page with what stands between its ``<!-- name -->`` and ``<!-- end -->`` marks written anew."""
    content = {
        "shapes": shapes_text(),
        "sleeve": fields(Sleeve.model_fields),
        "snubber": fields(Snubber.model_fields),
        "laws": laws_text(),
        "modes": modes_text(),
        "effects": effects_text(),
        "odds": odds_text(),
        "priors": priors_text(),
        "constants": constants_text(),
        "units": units_text(),
        "cards": cards_text(),
    } | {f"effect {effect.name}": effect_text(effect) for effect in effects().values()}
    for name, text in content.items():
        start, end = f"<!-- {name} -->", f"<!-- end {name} -->"
        if start not in page:
            continue
        before, _, rest = page.partition(start)
        after = rest.partition(end)[2]
        page = f"{before}{start}\n\n{text}\n\n{end}{after}"
    return page


if __name__ == "__main__":
    for file in PAGES:
        file.write_text(brought_up_to_date(file.read_text(encoding="utf-8")), encoding="utf-8")
