"""Neighbours of a model by its law: with another law, or without effects; and the name of a model in words."""

from __future__ import annotations

from dataclasses import replace

from bushcli.case import Case
from bushcli.effects.names import readable_name
from bushcli.selection.model import Model
from forms.law import laws

# Number of terms of a law with optional ones; a coupon is solved at once and shows all that a law can do.
TERMS, TERMS_OF_COUPON = 2, 3


def other_laws(case: Case, model: Model) -> list[Model]:
    """The model with other laws of at least as many parameters, or with a law from coupons freed from them."""
    if model.fixed:
        free = tuple(active for active in model.effects if not active.effect.needs_fixed_law)
        return [replace(model, fixed=False, effects=free)]
    coupon = case.geometry.specimen == "coupon"
    terms = TERMS_OF_COUPON if coupon else TERMS
    models = []
    for name, other in laws().items():
        optional = any(p.optional for p in other.parameters)
        start = {p.name: p.start for p in other.parameters if not p.optional or int(p.name[-1]) <= terms}
        if name == model.law or len(start) < max(len(model.start), 2):
            continue
        models.append(replace(model, law=name, start=start, terms=terms if optional else None, anchor=None))
    return models


def with_law_of(plain: Model, model: Model) -> Model:
    """The effects of a model with the law of another one."""
    return replace(plain, effects=model.effects, anchor=None)


def without_effects(model: Model) -> Model:
    """The model's law alone."""
    return replace(model, effects=(), anchor=None)


def label(model: Model, variants: bool = False) -> str:
    """Return a model in words: "yeoh + mullins + offset (radial)".

    Parameters
    ----------
    model : Model
    variants : bool
        Whether to distinguish models with the same effects: "debonding (inner top)".
    """
    if not variants:
        return " + ".join([model.law, *map(readable_name, model.identities)])
    parts = {active.identity: f" ({active.variant})" if active.variant else "" for active in model.effects}
    return " + ".join([model.law, *(readable_name(name) + parts[name] for name in model.identities)])
