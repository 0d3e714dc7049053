"""Findings: the errors in a case, by key, and the translation of pydantic's errors into them."""

from __future__ import annotations

import json
import types
import typing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import AliasChoices, BaseModel, ValidationError

from bushcli.errors import nearest

Keys = tuple[str | int, ...]


@dataclass(frozen=True)
class Finding:
    """An error of a case: the key that it concerns, and the fields of `bushcli.errors.Problem`.

    For an unknown key, `among` holds the keys from which the most similar one is suggested. It is searched for only
    when the finding is reported, because a case file may have a hundred thousand wrong keys.
    """

    keys: Keys
    what: str
    suggested: str = ""
    expected: str = ""
    among: tuple[str, ...] = ()

    @property
    def nearest(self) -> str:
        """The name to suggest; empty where there is none."""
        return self.suggested or (nearest(str(self.keys[-1]), self.among) if self.among else "")


def dotted_key(keys: Keys) -> str:
    """Return a key path as a user writes it: ``load_cases[0].amplitude``."""
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text


def toml_text(value: object) -> str:
    """Return a value as in TOML, cut to a length that fits a message."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{" + ", ".join(map(str, value)) + "}" if len(value) < 8 else "{...}"
    if isinstance(value, list):
        text = "[" + ", ".join(toml_text(item) for item in value[:8]) + (", ...]" if len(value) > 8 else "]")
    elif isinstance(value, int) and abs(value) > 10**20:
        text = "a number of more than 20 digits"
    else:
        text = json.dumps(value, ensure_ascii=False) if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:56] + " ..."


def wrong_key(keys: Keys, what: str, expected: str = "", suggested: str = "") -> Finding:
    """Return the finding ``KEY what``, such as ``load_cases[0].rate has no meaning``, or ``KEY: what``."""
    space = "" if what.startswith(":") else " "
    return Finding(keys, f"{dotted_key(keys)}{space}{what}", suggested, expected)


def wrong_value(keys: Keys, value: object, what: str, expected: str = "", suggested: str = "") -> Finding:
    """Return the finding ``KEY = VALUE what``, for instance ``material.density = -1.0 is out of bounds``."""
    space = " " if what and not what.startswith(":") else ""
    return wrong_key(keys, f"= {toml_text(value)}{space}{what}", expected, suggested)


def unknown_key(keys: Keys, known: Iterable[str], section: str) -> Finding:
    """Return the finding for a key that a section does not have."""
    known, key = tuple(known), str(keys[-1])
    what = f"{dotted_key(keys)} is not a key of {section}"
    radius = key.replace("diameter", "radius")
    if radius != key and radius in known:
        return Finding(keys, what, expected=f"give {radius}, half the diameter, in mm")
    expected = ", ".join(known) or f"{section} takes no keys"
    return Finding(keys, what, expected=expected, among=known)


def unknown_name(keys: Keys, name: object, known: Iterable[str], kind: str) -> Finding:
    """Return the finding for a name that is not in a registry: ``material.law = "yeho" is not a law``."""
    known, what = tuple(known), f"is not {'an' if kind[0] in 'aeio' else 'a'} {kind}"
    suggested = nearest(name, known, cutoff=0.5) if isinstance(name, str) else ""
    return wrong_value(keys, name, what, ", ".join(known), suggested)


def explain(error: ValidationError, model: type[BaseModel], at: Keys, section: str) -> list[Finding]:
    """Translate pydantic's findings about one table into findings with the keys of the case file."""
    return [_finding_of(item, model, at, section) for item in error.errors(include_url=False)]


def _finding_of(item: Any, model: type[BaseModel], at: Keys, section: str) -> Finding:
    loc: Keys = tuple(item["loc"])
    keys, key, kind, context = at + loc, dotted_key(at + loc), item["type"], item.get("ctx", {})
    if kind == "extra_forbidden":
        owner = _model_at(model, loc[:-1])
        if loc[-1] in _keys_of(owner):
            return Finding(keys, f"{key} is given twice, under two of its names")
        return unknown_key(keys, _keys_of(owner), section if len(loc) == 1 else f"[{dotted_key(keys[:-1])}]")
    if kind == "missing":
        field = _model_at(model, loc[:-1]).model_fields.get(str(loc[-1]))
        return Finding(keys, f"{key} is missing", expected=(field.description or "") if field else "")
    if kind in ("value_error", "assertion_error"):
        words = str(context.get("error", item["msg"]))
        # A validator of the whole table names its keys in its message; that of a single key does not.
        return Finding(keys, f"{key}: {words}" if not loc else f"{key} = {toml_text(item['input'])}: {words}")
    if kind == "literal_error":
        # The key of an entry of a list is that of the list; `class`, which Python does not permit, is an alias.
        place = loc[:-1] if isinstance(loc[-1], int) else loc
        fields = _model_at(model, place[:-1]).model_fields
        field = next((f for name, f in fields.items() if place[-1] in (name, f.alias)), None)
        literals = [t for t in _types(field and field.annotation) if typing.get_origin(t) is typing.Literal]
        choices = [choice for t in literals for choice in typing.get_args(t) if isinstance(choice, str)]
        nearest_name = nearest(item["input"], choices, cutoff=0.5) if isinstance(item["input"], str) else ""
        what = f"{key} = {toml_text(item['input'])} is not allowed"
        return Finding(keys, what, nearest_name, ", ".join(map(toml_text, choices)))
    template = _REQUIREMENTS.get(kind)
    requirement = template.format(**context) if template else item["msg"].replace("Input should", "should")
    return Finding(keys, f"{key} = {toml_text(item['input'])} {requirement}")


_REQUIREMENTS = {
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "float_type": "is not a number",
    "int_type": "is not a whole number",
    "int_from_float": "is not a whole number",
    "string_type": "is not a text in quotes",
    "bool_type": "is neither true nor false",
    "list_type": "is not a list in brackets",
    "tuple_type": "is not a list in brackets",
    "dict_type": "is not a table of keys",
    "model_type": "is not a table of keys",
    "model_attributes_type": "is not a table of keys",
    "finite_number": "must be finite",
    "string_too_short": "must not be empty",
    "too_long": "must not have more than {max_length} entries",
    "too_short": "needs at least {min_length} entries",
}


def _keys_of(model: type[BaseModel]) -> list[str]:
    """Return the keys of a table as a user writes them."""
    keys = []
    for name, field in model.model_fields.items():
        aliases = field.validation_alias
        keys += (
            list(map(str, aliases.choices)) if isinstance(aliases, AliasChoices) else [field.alias or name]
        )
    return keys


def _model_at(model: type[BaseModel], loc: Keys) -> type[BaseModel]:
    """Return the model of the table that ``loc`` leads to, through optional and repeated tables."""
    for key in loc:
        if isinstance(key, str) and key in model.model_fields:
            types_of_key = _types(model.model_fields[key].annotation)
            tables = (t for t in types_of_key if isinstance(t, type) and issubclass(t, BaseModel))
            model = next(tables, model)
    return model


def _types(annotation: Any) -> list[Any]:
    """Return an annotation's types with unions, lists and tuples opened."""
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        return _types(typing.get_args(annotation)[0])
    if origin in (typing.Union, types.UnionType, list, tuple):
        return [t for argument in typing.get_args(annotation) for t in _types(argument)]
    return [annotation]
