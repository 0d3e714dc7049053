"""A law with effects, and its fit to the recordings: the objects that a diagnosis compares."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.effects.active import ActiveEffect, uniquely_named
from bushcli.inverse.task import Task
from bushcli.recording import Recording
from bushcli.recording.dynamic.rows import RecordedTable

Array = NDArray[np.float64]
Key = tuple[str, ...]


@dataclass(frozen=True)
class Model:
    """A law, its start values, and effects.

    Attributes
    ----------
    start : mapping
        Of the law's parameters.
    fixed : bool
        Whether the law keeps them, as a law that was fitted to coupons does.
    effects : tuple of ActiveEffect
        With start values. An effect that occurs in several rigs gets unique names here.
    terms : int, optional
        Number of terms of a law that has optional ones.
    anchor : mapping, optional
        Parameters of the law alone. If given, bodies with memory get a coarse mesh, whose force is corrected to that
        of the default mesh at these parameters (`model_cache`): a march in three dimensions takes a minute otherwise.
    """

    law: str
    start: Mapping[str, float]
    fixed: bool = False
    effects: tuple[ActiveEffect, ...] = ()
    terms: int | None = None
    anchor: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", uniquely_named(self.effects))

    @property
    def identities(self) -> tuple[str, ...]:
        """Names of the effects, independent of the other effects of the model, by which models are compared."""
        return tuple(sorted(active.identity for active in self.effects))

    @property
    def structure(self) -> Key:
        """Name of the model: its law, whether that is fixed, its effects with their parameters and dimensions."""
        return self._name(sizes=True)

    @property
    def without_sizes(self) -> Key:
        """The same without the dimensions of the mesh, such as the thickness of sleeves."""
        return self._name(sizes=False)

    def _name(self, sizes: bool) -> Key:
        parts = []
        for active in self.effects:
            parts += [
                f"{active.identity}.{p.name}"
                + (f"={active.values[p.name]:g}" if p.of_mesh and (sizes or p.choices) else "")
                for p in active.parameters
            ]
        law = self.law if self.terms is None else f"{self.law} {self.terms}"
        return (f"{law}{' fixed' if self.fixed else ''}", *sorted(parts))

    @property
    def values(self) -> dict[str, float]:
        """All values by full name, the law's and the effects'."""
        values = dict(self.start)
        for active in self.effects:
            values |= {active.full_name(p): active.values[p.name] for p in active.parameters}
        return values

    def off_values(self, names: Sequence[str]) -> list[float]:
        """Return the off value of each of these parameters, 0 where it has none."""
        values = {
            active.full_name(p): float(p.off or 0.0) for active in self.effects for p in active.parameters
        }
        return [values.get(name, 0.0) for name in names]

    def contains(self, other: Model) -> bool:
        """Whether the other model is this one with some effects, or branches of them, switched off."""
        if (self.law, self.terms, self.fixed) != (other.law, other.terms, other.fixed):
            return False
        return set(other.structure) < set(self.structure)

    def at(self, values: Mapping[str, float]) -> Model:
        """Return the model with other values, by full name; values that are not given stay."""
        law = {name: float(values.get(name, value)) for name, value in self.start.items()}
        effects = tuple(
            replace(
                active,
                values={
                    p.name: float(values.get(active.full_name(p), active.values[p.name]))
                    for p in active.parameters
                },
            )
            for active in self.effects
        )
        return replace(self, start=law, effects=effects)

    def values_as(self, other: Model) -> dict[str, float]:
        """Values by full name with which this model is equivalent to another one that it contains."""
        known = other.structure
        by_name = dict(other.start)
        values = {
            f"{active.identity}.{p.name}": active.values[p.name]
            for active in other.effects
            for p in active.parameters
        }
        for active in self.effects:
            for p in active.parameters:
                name = f"{active.identity}.{p.name}"
                in_other = name in values and (not p.of_mesh or f"{name}={active.values[p.name]:g}" in known)
                off = p.lower if p.variant else active.values[p.name] if p.off is None else p.off
                value = values[name] if in_other else off
                by_name[active.full_name(p)] = float(value)
        return by_name

    def task(self, case: Case, recordings: Iterable[Recording] | None = None) -> Task:
        """Return the identification task of the model.

        Parameters
        ----------
        case : Case
        recordings : iterable of Recording, optional
            Tables of dynamic stiffness among them are not read again.
        """
        fixed = tuple(self.start) if self.fixed else ()
        return Task(
            replace(case, effects=self.effects),
            self.law,
            start=dict(self.start),
            fixed=fixed,
            terms=self.terms,
            tables=None
            if recordings is None
            else tuple(table.table for table in recordings if isinstance(table, RecordedTable)),
        )


@dataclass(frozen=True)
class Fitted:
    """A model with its best-fitting values.

    Attributes
    ----------
    model : Model
        With the identified values.
    names : tuple of str
        Of the p parameters that were identified.
    x : shape (p,)
    simulated : tuple of array, shape (n,) each
        Force of each channel at its samples.
    jacobians : tuple of array, shape (n, p) each
        Derivatives of these forces by the parameters.
    solves, failed : int
        Simulations of a channel, and evaluations that failed.
    states : shape (k, 3)
        Principal stretches in which the law was required to be stable.
    """

    model: Model
    names: tuple[str, ...]
    x: Array
    simulated: tuple[Array, ...]
    jacobians: tuple[Array, ...]
    converged: bool
    solves: int = 0
    failed: int = 0
    states: Array = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def values(self) -> dict[str, float]:
        """All values by full name."""
        return self.model.values
