"""Validate ``[[effects]]`` against the registry and the channels of the case."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from bushcli.case.finding import Finding, Keys, dotted_key, toml_text, unknown_name, wrong_key, wrong_value
from bushcli.case.schema import EffectTable
from bushcli.case.unit import case_file_number, case_file_unit, internal_value
from bushcli.effects.active import ActiveEffect, uniquely_named
from bushcli.effects.effect import Effect, EffectParameter, Kind, effects, reasons_against
from bushcli.errors import nearest
from cases.mode import modes
from geometry.shape import Shape

_OF_KIND: dict[Kind, str] = {
    "static": "recordings and load cases along a path",
    "dynamic": "tables of dynamic stiffness",
}


@dataclass(frozen=True)
class DeclaredChannel:
    """A channel on which an effect may act.

    Attributes
    ----------
    name, mode : str
    untimed : Keys
        Place of the load case if it certainly has no time; empty if it has time or if a file may contain it.
    kind : {"static", "dynamic"}
    temperature : float or None
        Degrees C; nan where a file may contain it.
    coupon : bool
        Whether it is a test in ``[[coupons]]``: an effect has it where it lists it, or acts on nothing else.
    """

    name: str
    mode: str
    untimed: Keys = ()
    kind: Kind = "static"
    temperature: float | None = None
    coupon: bool = False


def build(
    tables: Sequence[tuple[EffectTable, Keys]],
    channels: Sequence[DeclaredChannel],
    shape: Shape | None = None,
) -> tuple[list[ActiveEffect], list[Finding]]:
    """Validate the effects of a case and return them together with what is wrong with them."""
    active: list[ActiveEffect] = []
    findings: list[Finding] = []
    for table, keys in tables:
        effect = effects().get(table.name)
        if effect is None:
            findings.append(unknown_name((*keys, "name"), table.name, effects(), "effect"))
            continue
        twins = [other for other in active if other.effect.name == effect.name]
        names = None if table.channels is None else tuple(dict.fromkeys(table.channels))
        # A second use belongs to another rig if it has channels of its own, and so has every other one.
        occupied = {name for other in twins for name in other.channels or ()}
        apart = effect.of_rig and names and all(other.channels is not None for other in twins)
        if twins and not (apart and not set(names or ()) & occupied):
            expected = "list each effect once; channels = [...] says which channels have it"
            if effect.of_rig:
                expected = "list different channels in the two entries: channels = [...]"
            findings.append(wrong_value((*keys, "name"), effect.name, "is given twice", expected))
            continue
        findings += _channels(effect, table, keys, channels)
        known = [(c.name, c.temperature) for c in channels if c.temperature is not None]
        temperatures = dict(known) if effect.needs_temperature else {}
        without_values = ActiveEffect(effect, channels=names, temperatures=temperatures)
        acting = (c.mode for c in channels if without_values.acts_on(c.name, c.mode, c.kind))
        rotational = any(modes()[mode].rotational for mode in acting)
        values, value_findings = _values(effect, table, keys, rotational, shape)
        findings += value_findings
        other_names = [name for other, _ in tables if (name := other.name) != effect.name]
        for what, expected in () if shape is None else reasons_against(effect, shape, other_names, values):
            at = (*keys, "name")
            findings.append(wrong_value(at, effect.name, f": {what}", expected))
        active.append(replace(without_values, values=values))
    return list(uniquely_named(active)), findings


def _channels(
    effect: Effect, table: EffectTable, keys: Keys, channels: Sequence[DeclaredChannel]
) -> Iterator[Finding]:
    """Check that the effect acts on its channels, that these share units, and that they have time if it needs it."""
    acts = [mode for mode in modes() if effect.acts_on(mode, None)]
    expected = ", ".join(acts)
    if len(effect.kinds) == 1:
        expected += "; " + _OF_KIND[min(effect.kinds)]
    by_name = {channel.name: channel for channel in channels}
    acting = [channel for channel in channels if effect.acts_on(channel.mode, channel.kind)]
    for index, name in enumerate(table.channels or []):
        at = (*keys, "channels", index)
        if name not in by_name:
            yield unknown_name(at, name, by_name, "channel")
        elif by_name[name] not in acting:
            mode, kind = by_name[name].mode, by_name[name].kind
            on_what = f"mode {mode}" if mode not in acts else _OF_KIND[kind]
            yield wrong_value(at, name, f": {effect.name} does not act on {on_what}", expected)
    channels_of_effect = [channel for channel in acting if channel.name in (table.channels or [])]
    if table.channels is None:
        channels_of_effect = [channel for channel in acting if not channel.coupon] or acting
    if table.channels is None and not channels_of_effect:
        present = ", ".join(dict.fromkeys(channel.mode for channel in channels))
        present = present or "no recording and no load case"
        given = f"{dotted_key((*keys, 'name'))} = {toml_text(effect.name)}"
        what = f"{given} acts on nothing in this case, which has {present}"
        yield Finding((*keys, "name"), what, expected=expected)
    rotational = [channel for channel in channels_of_effect if modes()[channel.mode].rotational]
    if (
        rotational
        and len(rotational) < len(channels_of_effect)
        and any(case_file_unit(p, True) != p.unit for p in effect.parameters)
    ):
        straight = next(channel for channel in channels_of_effect if channel not in rotational)
        what = f"{dotted_key(keys)}: {effect.name} acts on {straight.name} in mm and on {rotational[0].name} in degrees"
        yield Finding((*keys, "channels"), what, expected="list channels of one kind only: channels = [...]")
    for channel in channels_of_effect if effect.needs_time else []:
        if channel.untimed:
            at = (*keys, "name")
            what = f"needs time, but {dotted_key(channel.untimed)} has none"
            expected = "give it a rate, or leave it out of channels = [...]"
            yield wrong_value(at, effect.name, what, expected)
    lacking = [channel.name for channel in channels_of_effect if channel.temperature is None]
    if effect.needs_temperature and lacking:
        at = (*keys, "name")
        what = f"{dotted_key(at)} = {toml_text(effect.name)} needs a temperature, which {', '.join(lacking)} "
        what += "has not" if len(lacking) == 1 else "have not"
        expected = "write temperature = 23.0 (degrees C) in its entry, or at the top of the case file for all"
        yield Finding(at, what, expected=expected)


def _values(
    effect: Effect, table: EffectTable, keys: Keys, rotational: bool, shape: Shape | None
) -> tuple[dict[str, float], list[Finding]]:
    """Return the given values by the parameters' own names, in internal units; a choice always has a value."""
    values: dict[str, float] = {}
    findings: list[Finding] = []
    by_name = {p.name: p for p in effect.parameters}
    reciprocal = {p.reciprocal[0]: p for p in effect.parameters if p.reciprocal}
    parameter_names = [
        name for p in effect.parameters for name in ([p.reciprocal[0]] if p.reciprocal else []) + [p.name]
    ]
    # A choice or a reference cannot be identified: if the case does not give one, the default is used.
    chosen = {p.name: p.start for p in effect.parameters if p.of_mesh and not p.scan}
    for name, raw in table.parameters.items():
        at = (*keys, "parameters", name)
        parameter = by_name.get(name) or reciprocal.get(name)
        if parameter is None:
            what = f"is not a parameter of {effect.name}"
            expected = ", ".join(parameter_names)
            findings.append(wrong_key(at, what, expected, suggested=nearest(name, parameter_names)))
        elif not _is_used(parameter, effect, table):
            words = " or ".join(p.name for p in effect.parameters if p.choices)
            expected = ", ".join(p.name for p in effect.parameters if _is_used(p, effect, table))
            what = f"has no meaning with this {words}"
            expected = f'{expected}; or {words} = "{parameter.under}"'
            findings.append(wrong_key(at, what, expected))
        elif parameter.not_with in table.parameters:
            what = f"has no meaning beside {parameter.not_with}"
            findings.append(wrong_key(at, what, "give one of them"))
        elif parameter.choices:
            if raw in parameter.choices:
                chosen[name] = float(parameter.choices.index(str(raw)))
            else:
                findings.append(unknown_name(at, raw, parameter.choices, f"choice of {name}"))
        elif isinstance(raw, str):
            findings.append(wrong_value(at, raw, "is not a number"))
        elif parameter.name in values:
            what = f"is given twice: {parameter.name} is 1/{parameter.reciprocal[0]}"  # type: ignore[index]
            findings.append(wrong_key(at, what, "give one of them"))
        else:
            inverted = name not in by_name
            own = raw if not inverted else 1.0 / raw if raw else math.inf
            value = internal_value(parameter, own, rotational)
            values[parameter.name] = value
            low, high = parameter.bounds(shape)
            if not parameter.admits(value) or not low <= value <= high:
                expected = _bounds(parameter, inverted, rotational, shape)
                findings.append(wrong_value(at, raw, "is out of bounds", expected))
    return chosen | values, findings


def _is_used(parameter: EffectParameter, effect: Effect, table: EffectTable) -> bool:
    """Whether a parameter is used with the choices that a table makes."""
    chosen = (p for p in effect.parameters if p.choices)
    return parameter.under in ("", *(table.parameters.get(p.name, p.choice(p.start)) for p in chosen))


def _bounds(parameter: EffectParameter, inverted: bool, rotational: bool, shape: Shape | None) -> str:
    if inverted and parameter.reciprocal is not None:
        unit = parameter.reciprocal[1].replace("/rad", "/degree")
        least = 1.0 / case_file_number(parameter, parameter.upper, rotational)
        return f"at least {least:g}{'' if unit == '1' else f' {unit}'}"
    units = "" if parameter.unit == "1" else f" {case_file_unit(parameter, rotational)}"
    low, high = (case_file_number(parameter, bound, rotational) for bound in parameter.bounds(shape))
    limit = ""
    if parameter.within is not None and (low, high) != (parameter.lower, parameter.upper):
        name, share = parameter.within
        limit = f": {share:.2g} of the rubber's {name}"
    return f"{low:g} to {high:g}{units}{limit}"
