"""The type of a branch: a contribution to the energy that depends on earlier deformation; and the list of branches.

A branch is written as the *incremental* energy of one step: a function of the deformation at its end and of internal
variables at its beginning, whose derivative with respect to the deformation is the stress at the end. Residual,
symmetric tangent and all derivatives then come from UFL, as for a law; `update` gives the internal variables at the
end, once the step is accepted. Each branch is one file in ``forms/branches``, which offers it as ``BRANCH``.

References
----------
Ortiz and Stainier (1999), The variational formulation of viscoplastic constitutive updates, Comput. Methods Appl. Mech.
Eng. 171:419-444, doi:10.1016/S0045-7825(98)00219-9.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Literal

import ufl

from forms.kinematics import Kinematics
from forms.law import Scalar
from forms.symmetric import Symmetric

Internal = Mapping[str, Scalar | Symmetric]


@dataclass(frozen=True)
class Step:
    """Input of a branch in one step, all UFL.

    Attributes
    ----------
    strain : Kinematics
        Deformation at the end of the step.
    law_energy : UFL scalar
        The law's isochoric energy there, MPa.
    shear_modulus : UFL scalar
        The law's initial shear modulus, MPa.
    internal : mapping
        Internal variables at the beginning of the step, by name.
    duration : UFL scalar
        Duration of the step, s.
    """

    strain: Kinematics
    law_energy: Scalar
    shear_modulus: Scalar
    internal: Internal
    duration: Scalar

    @property
    def metric(self) -> Symmetric:
        """Right Cauchy-Green tensor at the end of the step, volume included."""
        assert self.strain.metric is not None
        return self.strain.metric

    @property
    def isochoric(self) -> Symmetric:
        """Right Cauchy-Green tensor at the end of the step without its volume change: J^(-2/3) C."""
        return ufl.exp(-2 / 3 * ufl.ln(self.strain.J)) * self.metric


@dataclass(frozen=True)
class Contribution:
    """Contribution of a branch to the energy density of a step.

    Attributes
    ----------
    incremental : UFL scalar
        MPa; its derivative with respect to the strain at the end of the step is the branch's stress.
    measures : tuple of ufl.variable, or None
        All scalars by which it depends on the displacement; None = those of the law (`Kinematics.measures`).
    stored : UFL scalar
        Energy that the branch can give back, MPa, with the internal variables at the end of the step.
    """

    incremental: Scalar
    measures: tuple[Scalar, ...] | None
    stored: Scalar


@dataclass(frozen=True)
class Branch:
    """A path-dependent contribution to the rubber's energy.

    Attributes
    ----------
    name, summary : str
    parameters : tuple of str
        The first is the amplitude: where it is zero, the branch adds nothing.
    typical : mapping
        Typical values of the parameters for filled rubber (1, MPa, s); the tests of every branch use them.
    internal : mapping
        Internal variable -> "scalar" (zero in the virgin rubber) or "tensor" (the identity).
    contribution, update : callable
        ``contribution(step, **parameters)``, and ``update(step, **parameters)`` for the internal variables at the end
        of the step.
    timed : bool
        Whether the duration of a step matters.
    source : str
    clock : {"", "shown", "followed"}
        Whether it is no energy but a clock (`forms.branches.payne`, `forms.branches.activated`), or takes the duration
        of a step from the clock before it.
    """

    name: str
    summary: str
    parameters: tuple[str, ...]
    typical: Mapping[str, float]
    internal: Mapping[str, Literal["scalar", "tensor"]]
    contribution: Callable[..., Contribution]
    update: Callable[..., Internal]
    timed: bool
    source: str
    clock: Literal["", "shown", "followed"] = ""


def branches() -> Mapping[str, Branch]:
    """All branches found in ``forms/branches`` that are energies, by name."""
    return MappingProxyType({name: branch for name, branch in _found().items() if not branch.clock})


def clocks() -> Mapping[str, Branch]:
    """All clocks found there, by name."""
    return MappingProxyType({name: branch for name, branch in _found().items() if branch.clock == "shown"})


@cache
def _found() -> Mapping[str, Branch]:
    package = importlib.import_module("forms.branches")
    modules = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    found = [importlib.import_module(f"{package.__name__}.{name}").BRANCH for name in modules]
    return {branch.name: branch for branch in found}
