"""The type of a hyperelastic law, and the list of laws.

A law is its isochoric strain energy, written once in UFL in ``forms/laws/<name>.py`` and offered there as
``LAW``. Stress, tangent and parameter derivatives are derived from it by UFL. This module does not import
UFL, so that a case file can be checked against the registry before the finite-element stack is loaded.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, Literal, Protocol, TypeVar

#: A UFL scalar expression (or a plain number where one is allowed). UFL carries no type information.
Scalar = Any

Basis = Literal["I1", "I1,I2", "stretches"]


class UnknownName(ValueError):
    """A name that is not in a registry; the message lists the known names and suggests the nearest."""

    def __init__(self, name: str, kind: str, known: tuple[str, ...]) -> None:
        self.name, self.known = name, known
        import difflib  # importing it takes 4 ms: only for wrong names

        matches = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.5)
        self.nearest: str | None = matches[0] if matches else None
        hint = f'; did you mean "{self.nearest}"?' if self.nearest else "; known:"
        super().__init__(f'"{name}" is not a {kind}{hint} ({", ".join(known)})')


class Named(Protocol):
    """A parameter."""

    @property
    def name(self) -> str:
        """Name within the law or effect."""


N = TypeVar("N", bound=Named)


def find_parameter(parameters: Sequence[N], name: str, owner: str) -> N:
    """Return the parameter called ``name``.

    Parameters
    ----------
    parameters : sequence of parameters
        Those of the owner.
    name : str
    owner : str
        Law or effect, for the message.

    Raises
    ------
    UnknownName
        When there is no such parameter.
    """
    for parameter in parameters:
        if parameter.name == name:
            return parameter
    raise UnknownName(name, f"parameter of {owner}", tuple(p.name for p in parameters))


class Strain(Protocol):
    """The isochoric measures of deformation that an energy may be written in."""

    @property
    def I1(self) -> Scalar:
        """First invariant of the isochoric right Cauchy-Green tensor."""

    @property
    def I2(self) -> Scalar:
        """Second invariant of the isochoric right Cauchy-Green tensor."""

    def power_trace(self, alpha: Scalar) -> Scalar:
        """Sum of the isochoric principal stretches, each to the power ``alpha``."""


@dataclass(frozen=True)
class Parameter:
    """One material parameter.

    Attributes
    ----------
    name : str
        As in the case file and in the law's energy.
    unit : str
        "MPa" or "1".
    meaning : str
        One line for ``bushcli list laws``.
    start : float
        Where a fit may begin when nothing is known.
    lower, upper : float
        Closed interval of admissible values, finite or infinite.
    optional : bool
        Whether the parameter may be absent (its term is then left out of the energy).
    """

    name: str
    unit: str
    meaning: str
    start: float
    lower: float
    upper: float
    optional: bool = False

    def admits(self, value: float) -> bool:
        """Whether ``value`` is a finite number within the bounds."""
        return math.isfinite(value) and self.lower <= value <= self.upper


@dataclass(frozen=True)
class Law:
    """An isotropic hyperelastic law: the isochoric strain energy per reference volume, in MPa = N mm / mm^3.

    Attributes
    ----------
    name : str
    summary : str
        One line.
    parameters : tuple of Parameter
    energy : callable
        ``energy(strain, **parameters) -> UFL scalar``; ``strain`` is a `Strain`, the parameters are UFL
        scalars (``fem.Constant`` or ``ufl.variable``), so that one compiled kernel serves all values.
    shear_modulus : callable
        ``shear_modulus(**parameters) -> float``: the initial shear modulus in MPa. It uses arithmetic only, so that it
        can be differentiated by a complex step.
    basis : {"I1", "I1,I2", "stretches"}
        Measures that the energy is a function of.
    linear : tuple of str
        Names of the parameters in which the energy is linear (jointly, the others held fixed).
    source : str
        Reference with DOI.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    energy: Callable[..., Scalar]
    shear_modulus: Callable[..., float]
    basis: Basis
    linear: tuple[str, ...]
    source: str

    def parameter(self, name: str) -> Parameter:
        """Return the parameter called ``name``.

        Raises
        ------
        UnknownName
            When the law has no such parameter.
        """
        return find_parameter(self.parameters, name, self.name)

    @property
    def start(self) -> dict[str, float]:
        """Start values of all parameters that are not optional."""
        return {p.name: p.start for p in self.parameters if not p.optional}


@cache
def laws() -> Mapping[str, Law]:
    """Return all laws found in ``forms/laws``, by name, in alphabetical order."""
    package = importlib.import_module("forms.laws")
    modules = (
        importlib.import_module(f"{package.__name__}.{m.name}")
        for m in pkgutil.iter_modules(package.__path__)
    )
    return MappingProxyType(
        {law.name: law for law in sorted((m.LAW for m in modules), key=lambda law: law.name)}
    )


def law(name: str) -> Law:
    """Return the law called ``name``.

    Raises
    ------
    UnknownName
        When there is no such law; the message names the nearest.
    """
    try:
        return laws()[name]
    except KeyError:
        raise UnknownName(name, "law", tuple(laws())) from None
