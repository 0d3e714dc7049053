"""Role of each solid of a CAD file: rubber, a sleeve, a plate."""

from __future__ import annotations

import re
from collections.abc import Mapping

from geometry.cad.triangles import view_of
from geometry.errors import GeometryError
from geometry.session import model
from geometry.view import View

RUBBER, INNER, OUTER, IGNORED = "rubber", "inner_sleeve", "outer_sleeve", "ignore"
_WORDS = {
    RUBBER: r"rubber|elastomer|gummi|kautschuk|caoutchouc|silicone|\bnr\b|epdm|nbr",
    INNER: r"inner|innen|interieur|core|kern|bolt|pin\b",
    OUTER: r"outer|aussen|außen|exterieur|housing|eye\b|can\b|cage",
}


def roles_of(solids: Mapping[int, str], given_roles: Mapping[str, str], where: str) -> dict[int, str]:
    """Role of each solid: "rubber", "inner_sleeve", "outer_sleeve" or a plate's name.

    Parameters
    ----------
    solids
        Tag -> name in the file, or empty.
    given_roles
        Name, or number from 1, -> role, from the case.
    where
        File, for messages.

    Raises
    ------
    GeometryError
        The file does not show which solid is rubber.
    """
    if len(solids) == 1 and not given_roles:
        return dict.fromkeys(solids, RUBBER)
    roles: dict[int, str] = {}
    used_keys: set[str] = set()
    for number, (tag, name) in enumerate(solids.items(), start=1):
        key = next((k for k in given_roles if k.lower() == name.lower() or k == str(number)), None)
        if key is not None:
            used_keys.add(key)
            roles[tag] = given_roles[key]
        else:
            roles[tag] = next((role for role, words in _WORDS.items() if re.search(words, name, re.I)), "")
    for key in given_roles:
        if key not in used_keys:
            listed = _solids_text(solids)
            raise GeometryError(where, f'geometry.solids: there is no solid "{key}"', listed)
    if RUBBER not in roles.values():
        raise GeometryError(
            where,
            f"holds {len(solids)} solid{'s' * (len(solids) > 1)}, and no name says which one is the rubber",
            f'geometry.solids = {{"1" = "rubber", ...}} of {_solids_text(solids)}',
            _numbered_view(solids),
        )
    plates = 0
    for tag, role in roles.items():
        if not role:
            plates += 1
            roles[tag] = re.sub(r"\W+", "_", solids[tag]).strip("_").lower() or f"plate_{plates}"
    return roles


def _numbered_view(solids: Mapping[int, str]) -> View | None:
    """A picture of the solids with their numbers."""
    labels: dict[int, str] = {}
    for number, (tag, name) in enumerate(solids.items(), start=1):
        for _, face in model().getBoundary([(3, tag)], oriented=False):
            labels.setdefault(int(face), f"{number}: {name or 'no name'}")
    return view_of(labels)


def _solids_text(solids: Mapping[int, str]) -> str:
    return ", ".join(
        f"{number}: {name or 'no name'}, {model().occ.getMass(3, tag):.4g} mm3"
        for number, (tag, name) in enumerate(solids.items(), start=1)
    )
