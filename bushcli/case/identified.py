"""A result -> the case that it identified: the case file's own tables, with the identified law and effects.

A later calculation starts from it: `bushcli direct OUT` of a results folder means this case.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from bushcli.case.as_json import relative_name
from bushcli.case.case import Case
from bushcli.case.schema import SECTIONS
from bushcli.effects.names import effect_name, rig_of

#: The case file in the folder of a result.
IDENTIFIED = "identified.toml"
#: Commands whose results identify a law.
IDENTIFYING = ("fit", "inverse", "diagnose", "batch")
# Tables of which the key names a file.
_FILES = {
    "geometry": ("file",),
    "load_cases": ("file", "force_file"),
    "recordings": ("file",),
    "coupons": ("file",),
}


def identified_tables(result: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables ``material`` and ``effects`` that a result means: with the identified law and effects.

    Parameters
    ----------
    result : mapping
        The JSON of `direct`, `dynamic`, `fit`, `inverse` or `diagnose`.
    """
    case_document = result["case"]
    command, effects = result["command"], [dict(effect) for effect in case_document.get("effects", [])]
    material = (
        _with_law(case_document, result.get("material", {}))
        if command in ("direct", "dynamic", "diagnose")
        else case_document["material"]
    )
    if command == "diagnose":
        effects = [
            {
                "name": effect["name"],
                "parameters": {name: value["value"] for name, value in effect["parameters"].items()},
                "channels": effect.get("channels"),
            }
            for effect in result.get("effects", [])
        ]
    elif "law" in result:  # a fit of tables alone has none
        material, effects = _with_parameters(case_document, result)
    identified_material = {key: value for key, value in material.items() if key != "hardness"}
    return {"material": identified_material, "effects": effects}


def _with_law(case_document: Mapping[str, Any], identified_law: Mapping[str, Any]) -> dict[str, Any]:
    material = {key: value for key, value in case_document["material"].items() if key != "terms"}
    keys = ("law", "bulk_modulus", "density", "parameters")
    return material | {key: identified_law[key] for key in keys if key in identified_law}


def _with_parameters(
    case_document: Mapping[str, Any], result: Mapping[str, Any]
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the identified law, and the effects of the case with the values identified with it."""
    values = {name: estimate["value"] for name, estimate in result.get("parameters", {}).items()}
    others = ("compliance", "density")
    law = {name: value for name, value in values.items() if "." not in name and name not in others}
    # Parameters that were fixed with --fix keep the value of the case.
    if result["law"] == case_document["material"]["law"]:
        law = {**(case_document["material"].get("parameters") or {}), **law}
    material = {"law": result["law"], "bulk_modulus": result.get("bulk_modulus"), "parameters": law}
    material |= {name: value for name, value in values.items() if name == "density"}
    effects = case_document.get("effects", [])
    effects = [dict(effect, parameters=dict(effect.get("parameters") or {})) for effect in effects]
    for full, value in values.items():
        owner, _, parameter = full.rpartition(".")
        for effect in effects:
            # "offset@radial" belongs to the rig of a channel; without one, the first effect of that name is meant.
            rig, channels = rig_of(owner), effect.get("channels")
            of_rig = not rig or (channels and channels[0] == rig)
            if owner and effect["name"] == effect_name(owner) and of_rig:
                effect["parameters"][parameter] = value
                break
    return _with_law(case_document, material), effects


def identified_case(case: Case, result: Mapping[str, Any], folder: Path) -> str | None:
    """Return the text of the case file that a result identified; None where it identified no law.

    Parameters
    ----------
    case : Case
        The case of the command.
    result : mapping
        Its JSON.
    folder : Path
        Folder of the case file to be, to which file names are relative.
    """
    sections = identified_tables(result)
    material = {key: value for key, value in sections["material"].items() if value is not None}
    if not case.tables or not material.get("parameters"):
        return None
    data = deepcopy(dict(case.tables)) | {"material": material, "effects": sections["effects"]}
    if result["command"] == "batch":
        data.pop("specimens")
    for section, keys in _FILES.items():
        tables = data.get(section, [])
        for table in [tables] if isinstance(tables, dict) else tables:
            for key in keys:
                if key in table:
                    # Relative to the folder, so that both can move together.
                    table[key] = relative_name(case.path.parent / str(table[key]), folder)
    if result["command"] == "batch":
        # The mean of the parts, which the law was identified from, in the folder of the result.
        data["recordings"] = [
            {"mode": curve["mode"], "file": f"{curve['mode']}-mean.csv"} for curve in result.get("curves", [])
        ]
    header = f"# Identified by bushcli {result['command']} from {case.path.name}; this folder given as a case means it."
    return f"{header}\n{toml_text(data)}"


def toml_text(data: Mapping[str, Any]) -> str:
    """Return the text of a case file with these tables."""
    order = sorted(data, key=lambda key: SECTIONS.index(key) if key in SECTIONS else len(SECTIONS))
    lists = {key: value if isinstance(value, list) else [value] for key, value in data.items()}
    plain = [key for key in order if not lists[key] or not all(isinstance(t, Mapping) for t in lists[key])]
    lines = [f"{key} = {inline(data[key])}" for key in plain if data[key] is not None and data[key] != []]
    for key in order:
        if key in plain:
            continue
        for table in [data[key]] if isinstance(data[key], Mapping) else data[key]:
            lines += ["", f"[{key}]" if isinstance(data[key], Mapping) else f"[[{key}]]"]
            lines += [f"{_key(name)} = {inline(value)}" for name, value in table.items() if value is not None]
    return "\n".join(lines) + "\n"


def inline(value: Any) -> str:
    """Write a value as TOML in one line, without keys that have no value."""
    if isinstance(value, Mapping):
        inside = ", ".join(f"{_key(k)} = {inline(v)}" for k, v in value.items() if v is not None)
        return f"{{{inside}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(inline, value))}]"
    if (isinstance(value, float) and math.isinf(value)) or value == "inf":
        return "inf"
    return json.dumps(value, ensure_ascii=False)


def _key(name: str) -> str:
    is_bare = name and all(c.isascii() and (c.isalnum() or c in "_-") for c in name)
    return name if is_bare else json.dumps(name)
