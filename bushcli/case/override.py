"""``--set KEY=VALUE``: change single keys of a case before it is validated."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from bushcli.case.finding import Keys, dotted_key, toml_text
from bushcli.case.limits import DEEPEST
from bushcli.effects.names import effect_name, rig_of
from bushcli.errors import CaseError, Problem, nearest

_SEGMENT = re.compile(r"([A-Za-z0-9_-]+(?:@[^\[\]@]+)?)((?:\[\d+\])*)\Z")

_NEGATIVE = re.compile(r"-\d+")
_SHOWN = 300


@dataclass(frozen=True)
class Override:
    """One ``--set``.

    Attributes
    ----------
    text : str
        As the user wrote it.
    keys : Keys
        The path to the changed key.
    created : Keys
        The shallowest key that it created in the case; the whole path if the table existed before.
    """

    text: str
    keys: Keys
    created: Keys

    @property
    def where(self) -> str:
        """The override as a message names it."""
        return _where(self.text)

    def owns(self, keys: Keys) -> bool:
        """Whether the value at ``keys`` comes from this override."""
        return keys[: len(self.created)] == self.created


def apply(data: dict[str, Any], texts: Sequence[str]) -> tuple[dict[str, Any], list[Override]]:
    """Return a changed copy of a case's tables, and what was changed.

    Lists are addressed by a number from 0, ``load_cases.0.amplitude=5`` or ``load_cases[0].amplitude=5``,
    effects also by their name, ``effects.mullins.r=3``. A value is read as TOML, and as a text if it is not
    TOML. Absent tables are created; unknown keys are left to validation.

    Raises
    ------
    CaseError
        When an override has no key or value, or leads through something that is not a table.
    """
    data, applied = deepcopy(data), []
    for text in texts:
        name, equals, value = text.partition("=")
        segments = [_SEGMENT.match(segment.strip()) for segment in name.strip().split(".")]
        keys: Keys = ()
        if all(segments):
            for match in filter(None, segments):
                keys += (match[1], *(int(index) for index in re.findall(r"\d+", match[2])))
        if len(keys) > DEEPEST:
            what = f"has a key of {len(keys)} parts"
            raise CaseError(Problem(_where(text), what, expected=f"at most {DEEPEST}"))
        if not equals or not keys:
            raise CaseError(Problem(_where(text), "is not KEY=VALUE", expected="e.g. geometry.length=38"))
        keys, added_keys = _by_name(data, keys, text)
        content: Any = value.strip()
        with suppress(ValueError, RecursionError):
            table = tomllib.loads(f"value = {content}")
            # A line break in the text could smuggle in further keys.
            content = table["value"] if len(table) == 1 else content
        created = _put(data, keys, content, _where(text))
        applied.append(Override(text, keys, added_keys or created))
    return data, applied


def _where(text: str) -> str:
    """Return how a message names an override: as it was written, cut to a length that fits one."""
    return f"--set {text if len(text) <= _SHOWN else text[:_SHOWN] + ' ...'}"


def _by_name(data: dict[str, Any], keys: Keys, text: str) -> tuple[Keys, Keys]:
    """Return the place of an effect that is addressed by its name, and the key that was added if there was none.

    ``effects.mullins.r`` is ``effects[0].parameters.r`` where the first effect is mullins, and
    ``effects.offset@radial.force`` is that of the offset that has the channel radial.

    Raises
    ------
    CaseError
        When several effects have the name, or none has the channel.
    """
    entries = data.get("effects", [])
    if keys[0] != "effects" or len(keys) < 2 or not isinstance(entries, list):
        return keys, ()
    name, inner_keys = keys[1], keys[2:]
    if isinstance(name, int) or name.isdigit():
        return keys, ()
    if not inner_keys or inner_keys[0] not in ("name", "parameters", "channels"):
        inner_keys = ("parameters", *inner_keys)
    name, rig = effect_name(name), rig_of(name)
    indices = [i for i, entry in enumerate(entries) if isinstance(entry, dict) and entry.get("name") == name]
    channels = {i: names if isinstance(names := entries[i].get("channels"), list) else [] for i in indices}
    matching = [i for i in indices if not rig or not channels[i] or rig in channels[i]]
    if len(matching) == 1:
        return ("effects", matching[0], *inner_keys), ()
    if indices:
        expected_keys = ", ".join(f"effects.{name}@{few[0]}" for few in channels.values() if few)
        what = f"several effects are called {name}" if matching else f"no {name} has the channel {rig}"
        raise CaseError(Problem(_where(text), what, expected=expected_keys))
    added_keys: Keys = ("effects", len(entries)) if "effects" in data else ("effects",)
    data["effects"] = [*entries, {"name": name, **({"channels": [rig]} if rig else {})}]
    return ("effects", len(entries), *inner_keys), added_keys


def _put(data: dict[str, Any], keys: Keys, value: Any, where: str) -> Keys:
    """Set the value in place; return the outermost key that this created, or the whole key if all of it existed."""
    table: Any = data
    created: Keys | None = None
    path: Keys = ()
    for position, key in enumerate(keys):
        last = position == len(keys) - 1
        if isinstance(table, list):
            index = _index(table, key, path, keys, where)
            path += (index,)
            if last:
                table[index] = value
            table = table[index]
            continue
        if not isinstance(table, dict):
            what = f"{dotted_key(path)} = {toml_text(table)} has no keys"
            raise CaseError(Problem(where, what, expected=f"{dotted_key(path)}=VALUE"))
        key = str(key)
        path += (key,)
        if last:
            table[key] = value
        elif key not in table:
            following = keys[position + 1]
            if isinstance(following, int) or following.isdigit():
                raise CaseError(Problem(where, f"the case has no {dotted_key(path)}", nearest(key, table)))
            table[key] = {}
            created = created or path
        table = table[key]
    return created or path


def _index(table: list[Any], key: str | int, path: Keys, keys: Keys, where: str) -> int:
    name, several = dotted_key(path), f"entries 0 to {len(table) - 1}"
    entries = several if len(table) > 1 else "one entry, 0" if table else "no entries"
    if isinstance(key, str) and _NEGATIVE.fullmatch(key):
        what = f"{name}[{key}] does not exist: entries are counted from 0"
        raise CaseError(Problem(where, what, expected=f"{name} has {entries}"))
    if not (isinstance(key, int) or (key.isascii() and key.isdigit())):
        entries_named = ((i, entry) for i, entry in enumerate(table) if isinstance(entry, dict))
        called = (i for i, entry in entries_named if key in (entry.get("name"), entry.get("mode")))
        number = next(called, None)
        inner_keys = dotted_key(keys[len(path) + (number is not None) :])
        example = f"{name}.{number or 0}.{inner_keys}".rstrip(".")
        expected = f"give the number of the entry: {example}"
        raise CaseError(Problem(where, f"{name} is a list", expected=expected))
    if int(key) >= len(table):
        what = f"{name}[{int(key)}] does not exist"
        raise CaseError(Problem(where, what, expected=f"{name} has {entries}"))
    return int(key)
