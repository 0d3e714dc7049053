"""The tables of docs/case-file.md that list shapes, laws and modes, written from the code.

``setup/enter python docs/tables.py`` brings the page up to date after a shape, a law or a mode was added or changed;
tests/unit/test_docs.py says when that has been forgotten.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from cases.mode import modes
from forms.law import laws
from geometry.shape import Sleeve, shapes

PAGE = Path(__file__).with_name("case-file.md")
_UNIT = re.compile(r", (mm|MPa|degrees)\b")


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
        units = ("stretch - 1", "MPa") if coupon else ("degrees", "N mm") if mode.rotational else ("mm", "N")
        remark = "; needs a finite `bulk_modulus`" if mode.needs_compressibility else ""
        rows.append((f"`{mode.name}`", mode.specimen, *units, mode.summary + remark))
    return table(("mode", "specimen", "displacement", "force", "what is done"), rows)


def brought_up_to_date(page: str) -> str:
    """Return the page with what stands between its ``<!-- name -->`` and ``<!-- end -->`` marks written anew."""
    content = {
        "shapes": shapes_text(),
        "sleeve": fields(Sleeve.model_fields),
        "laws": laws_text(),
        "modes": modes_text(),
    }
    for name, text in content.items():
        start, end = f"<!-- {name} -->", f"<!-- end {name} -->"
        before, _, rest = page.partition(start)
        after = rest.partition(end)[2]
        page = f"{before}{start}\n\n{text}\n\n{end}{after}"
    return page


if __name__ == "__main__":
    PAGE.write_text(brought_up_to_date(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
