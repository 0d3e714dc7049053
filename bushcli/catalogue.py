"""What there is to choose from, as text and as data: laws, shapes, modes."""

from __future__ import annotations

from typing import Any

from cases.mode import modes
from forms.law import laws
from geometry.shape import shapes


def as_json(kind: str) -> list[dict[str, Any]]:
    """Entries of a kind ("laws", "shapes", "modes") as JSON-ready data."""
    return {"laws": _laws, "shapes": _shapes, "modes": _modes}[kind]()


def as_text(kind: str) -> str:
    """The same for people."""
    blocks = []
    for entry in as_json(kind):
        lines = [f"{entry['name']}  {entry['summary']}"]
        if "displacement" in entry:
            lines[0] += f"  ({entry['specimen']}: {entry['displacement']}, {entry['force']})"
        for item in entry.get("parameters", entry.get("dimensions", [])):
            lines.append("    " + "  ".join(str(value) for value in item.values() if value not in ("", None)))
        if "source" in entry:
            lines.append(f"    source: {entry['source']}")
        blocks.append("\n".join(lines))
    return "\n".join(blocks)


def _laws() -> list[dict[str, Any]]:
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


def _shapes() -> list[dict[str, Any]]:
    result = []
    for shape in shapes().values():
        dimensions = [
            {
                "name": name,
                "default": "" if field.is_required() else _default(field.default),
                "meaning": field.description or "",
            }
            for name, field in shape.model_fields.items()
        ]
        result.append({"name": shape.name, "summary": shape.summary, "dimensions": dimensions})
    return result


def _default(value: Any) -> str:
    if value is None:
        return "optional"
    return f"default {value:g}" if isinstance(value, float) else f"default {value}"


def _modes() -> list[dict[str, Any]]:
    return [
        {
            "name": mode.name,
            "summary": mode.summary,
            "specimen": mode.specimen,
            "displacement": "stretch" if mode.specimen == "coupon" else "deg" if mode.rotational else "mm",
            "force": "MPa" if mode.specimen == "coupon" else "N mm" if mode.rotational else "N",
            "symmetry_planes": sorted(mode.solid.mirrors),
            "axisymmetric": mode.section is not None,
            "needs_compressibility": mode.needs_compressibility,
        }
        for mode in modes().values()
    ]
