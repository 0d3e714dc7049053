"""The available laws, shapes, modes and effects, as text and as data."""

from __future__ import annotations

from typing import Any

from bushcli.case.unit import case_file_unit
from bushcli.effects.effect import effects
from cases.mode import modes
from forms.law import laws
from geometry.shape import shapes


def as_json(kind: str) -> list[dict[str, Any]]:
    """Return the entries of a kind ("laws", "shapes", "modes", "effects") as JSON-ready data."""
    if kind == "laws":
        return [
            {
                "name": law.name,
                "summary": law.summary,
                "parameters": [
                    {
                        "name": p.name,
                        "unit": p.unit,
                        "meaning": p.meaning + (" (optional)" if p.optional else ""),
                        "bounds": f"[{p.lower:g}, {p.upper:g}]",
                    }
                    for p in law.parameters
                ],
                "source": law.source,
            }
            for law in laws().values()
        ]
    if kind == "shapes":
        result = []
        for shape in shapes().values():
            dimensions = []
            for name, field in shape.model_fields.items():
                is_float = isinstance(field.default, float)
                default = f"default {field.default:g}" if is_float else f"default {field.default}"
                default = "" if field.is_required() else "optional" if field.default is None else default
                dimensions.append({"name": name, "default": default, "meaning": field.description or ""})
            result.append({"name": shape.name, "summary": shape.summary, "dimensions": dimensions})
        return result
    if kind == "modes":
        return [
            {
                "name": mode.name,
                "summary": mode.summary,
                "specimen": mode.specimen,
                "displacement": "amount of shear"
                if mode.sheared
                else "stretch"
                if mode.specimen == "coupon"
                else "deg"
                if mode.rotational
                else "mm",
                "force": "MPa" if mode.specimen == "coupon" else "N mm" if mode.rotational else "N",
                "symmetry_planes": sorted(mode.solid.mirrors),
                "axisymmetric": mode.section is not None,
                "needs_compressibility": mode.needs_compressibility,
            }
            for mode in modes().values()
        ]
    return [
        {
            "name": effect.name,
            "title": effect.title,
            "summary": effect.summary,
            "acts": effect.acts,
            "modes": [mode for mode in modes() if effect.acts_on(mode, None)],
            "parameters": [
                {
                    "name": p.name,
                    "unit": "" if p.choices else p.unit,
                    "meaning": p.meaning + (" (optional)" if p.optional else ""),
                    "bounds": "" if p.choices else f"[{p.lower:g}, {p.upper:g}]",
                    "choices": list(p.choices),
                    "off": p.off,
                    "reciprocal": dict(zip(("name", "unit"), p.reciprocal, strict=True))
                    if p.reciprocal
                    else None,
                    "unit_rotational": case_file_unit(p, rotational=True),
                }
                for p in effect.parameters
            ],
            "needs": effect.needs,
            "rivals": list(effect.rivals),
            "needs_time": effect.needs_time,
            "source": effect.source,
        }
        for effect in effects().values()
    ]


def as_text(kind: str) -> str:
    """Return the entries of a kind ("laws", "shapes", "modes", "effects") as text to be read."""
    blocks = []
    for entry in as_json(kind):
        lines = [f"{entry['name']}  {entry['summary']}"]
        if "acts" in entry:
            lines[0] = f"{entry['name']}  {entry['title']}. {entry['summary']}"
            lines[0] += f"  ({entry['acts']}: {', '.join(entry['modes'])})"
        if "displacement" in entry:
            lines[0] += f"  ({entry['specimen']}: {entry['displacement']}, {entry['force']})"
        for item in entry.get("parameters", entry.get("dimensions", [])):
            keys = ("name", "unit", "default", "meaning", "bounds")
            words = [str(item[key]) for key in keys if item.get(key)]
            if item.get("choices"):
                words.append(f"one of {', '.join(item['choices'])}")
            if item.get("off") is not None:
                words.append(f"off = {item['off']:g}")
            if item.get("reciprocal"):
                other = item["reciprocal"]
                unit_of = "" if other["unit"] == "1" else f", {other['unit']}"
                words.append(f"or {other['name']} = 1/{item['name']}{unit_of}")
            lines.append("    " + "  ".join(words))
        if "needs" in entry:
            lines.append(f"    needs: {entry['needs']}")
            lines.append(f"    rivals: {', '.join(entry['rivals'])}")
        if "source" in entry:
            lines.append(f"    source: {entry['source']}")
        blocks.append("\n".join(lines))
    return "\n".join(blocks)
