"""Definition of an identification, from which every worker builds its own least-squares problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case, Material, MeshOptions, case_json
from bushcli.case.case import DENSITY
from bushcli.case.unit import parameters_in_degrees
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import EffectParameter
from bushcli.effects.names import effect_name
from bushcli.errors import InputError, Problem, nearest
from bushcli.inverse.bounds import Bounds
from bushcli.inverse.channel import Channel, Corrected, FitChannel, StepLimit
from bushcli.inverse.channels import bushing_channels, coupon_channels, dynamic_channels, dynamic_tables
from bushcli.inverse.journal import Journal
from bushcli.inverse.local import Loss
from bushcli.inverse.problem import LeastSquaresProblem, Progress, coupon_states
from bushcli.inverse.result import Weighting
from bushcli.recording.table_cache import TableCache
from bushcli.simulate.recording_cache import RecordingCache
from cases.simulate import Prepare, Rubber, prepare
from forms.law import Law, law, laws

if TYPE_CHECKING:
    from bushcli.inverse.dynamic_channel import DynamicChannel
    from bushcli.recording.dynamic.table import DynamicTable

Array = NDArray[np.float64]

# Bounds of the bulk modulus's inverse, 1/MPa, when it is identified: from incompressible to kappa = 10 MPa.
COMPLIANCE = (0.0, 0.1)
# The same where a volumetric test of a coupon is fitted, which an incompressible rubber cannot be put to: up to
# kappa = 1e6 MPa; diamond has 4.4e5.
COMPLIANCE_OF_TEST = (1e-6, 0.1)
# Bounds of the rubber's density, kg/m^3: beyond unfilled natural rubber (920) and filled fluoroelastomers (2,000).
DENSITIES = (500.0, 3000.0)
# Principal stretches, typical of a bushing, between which the law has to be stable; coupons may widen the range.
STRETCHES = (0.6, 1.7)


@dataclass(frozen=True)
class Task:
    """Definition of an identification: law, recordings and options.

    Attributes
    ----------
    case : Case
    model : str
        Name of the law.
    source : {"recordings", "coupons"}
        Curves that the law is fitted to.
    start : mapping
        Start values; where one is absent, that of the case or of the law is used.
    fixed : tuple of str
        Parameters that keep their start value.
    bulk_modulus, density : bool
        Identify the bulk modulus, the density of the rubber too.
    hold_out : tuple of str
        Channels that are predicted instead of fitted.
    tables : tuple of DynamicTable, optional
        Of the bushing, where the caller has read them.
    """

    case: Case
    model: str
    source: Literal["recordings", "coupons"] = "recordings"
    start: Mapping[str, float] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()
    bulk_modulus: bool = False
    density: bool = False
    hold_out: tuple[str, ...] = ()
    weighting: Weighting = "relative"
    loss: Loss = "linear"
    starts: int = 1
    globally: bool = False
    seed: int = 0
    workers: int = 1
    terms: int | None = None
    tables: tuple[DynamicTable, ...] | None = None

    @property
    def law(self) -> Law:
        """The law.

        Raises
        ------
        InputError
            There is no such law.
        """
        if self.model not in laws():
            what = f'"{self.model}" is not a law'
            raise InputError(Problem("--model", what, nearest(self.model, laws()), ", ".join(laws())))
        return law(self.model)

    @property
    def material(self) -> Material:
        """Law with start values."""
        material = self.case.material
        law = self.law
        same = material.law == law.name
        empty = replace(material, law=law.name, parameters={}, terms=material.terms if same else self.terms)
        names = material.parameter_names if same else empty.parameter_names
        values = {name: law.parameter(name).start for name in names}
        if same:
            values |= material.parameters
        unknown = [name for name in self.start if name not in values]
        if unknown:
            what = f"{unknown[0]} is not a parameter of {law.name}"
            raise InputError(Problem("start values", what, nearest(unknown[0], values), ", ".join(values)))
        return replace(empty, parameters=values | dict(self.start))

    @property
    def effects(self) -> tuple[ActiveEffect, ...]:
        """The case's effects with start values of all their parameters."""
        return tuple(
            active.with_start_values(self.period(active))
            if any(p.name not in active.values for p in active.parameters)
            else active
            for active in self.case.effects
        )

    @cached_property
    def _highest_frequencies(self) -> dict[tuple[str, str], float]:
        """Highest frequency (Hz) of each table of the bushing, by name and mode."""
        if self.source == "coupons":
            return {}
        tables = dynamic_tables(self.case) if self.tables is None else self.tables
        return {(table.name, table.mode): float(table.frequency.max()) for table in tables}

    def period(self, active: ActiveEffect) -> float | None:
        """Return the period (s) of the highest frequency of the tables that an effect changes; None without any."""
        frequencies = [
            f
            for (name, mode), f in self._highest_frequencies.items()
            if active.acts_on(name, mode, "dynamic")
        ]
        return 1.0 / max(frequencies) if frequencies else None

    @property
    def effect_values(self) -> dict[str, float]:
        """Start values of the effects' parameters by full name, except choices, which are not numbers."""
        return {
            active.full_name(p): active.values[p.name]
            for active in self.effects
            for p in active.parameters
            if not p.choices
        }

    @property
    def rotational_parameters(self) -> dict[str, EffectParameter]:
        """Parameters of its effects that are in degrees in the case file."""
        static = [(source.label, source.mode) for source in self.case.recordings]
        return parameters_in_degrees(
            self.effects, [*static, *((source.label, source.mode) for source in self.case.dynamic)]
        )

    def is_fixed(self, name: str) -> bool:
        """Whether a parameter keeps its start value: it or its effect is named in `fixed`, or it changes the mesh."""
        meshed = {active.full_name(p) for active in self.effects for p in active.parameters if p.of_mesh}
        active = name.partition(".")[0]
        # "viscoelasticity.tau": the times of all branches.
        names = {name, name.rstrip("0123456789"), active, effect_name(active)}
        return bool(names & set(self.fixed)) or name in meshed

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that are identified, in the order of the vectors: the law's, then those of effects."""
        free = [name for name in (*self.material.parameters, *self.effect_values) if not self.is_fixed(name)]
        return (
            *free,
            *(("compliance",) if self.bulk_modulus else ()),
            *(("density",) if self.density else ()),
        )

    def vectors(self) -> tuple[Array, Bounds]:
        """Start, shape (parameters,), and bounds of the parameters that are identified."""
        material, rows = self.material, []
        ranges = {
            active.full_name(p): (
                active.values[p.name],
                *p.fit_range(self.case.geometry, self.period(active))[1:],
            )
            for active in self.effects
            for p in active.parameters
        }
        spread = {
            active.full_name(p)
            for active in self.effects
            for p in active.parameters
            if p.off is None and p.lower >= 0.0 and p.prior is not None and p.prior.is_logarithmic
        }
        for name in self.names:
            if name in ranges:
                value, low, high = ranges[name]
                rows.append((value, min(low, value), high))
            elif name == "density":
                rows.append((material.density / DENSITY, *DENSITIES))
            elif name == "compliance":
                compressibility = 1.0 / material.bulk_modulus if np.isfinite(material.bulk_modulus) else 1e-3
                bounds = COMPLIANCE_OF_TEST if self.source == "coupons" else COMPLIANCE
                rows.append((min(max(compressibility, bounds[0]), bounds[1]), *bounds))
            else:
                parameter = self.law.parameter(name)
                rows.append((material.parameters[name], parameter.lower, parameter.upper))
        start, lower, upper = np.array(rows, dtype=float).reshape(-1, 3).T
        return start, Bounds(lower, upper, np.array([name in spread for name in self.names], dtype=bool))

    def channels(
        self,
        coarse: bool = False,
        comm: MPI.Comm = MPI.COMM_WORLD,
        prepared: Prepare = prepare,
        measured: RecordingCache | None = None,
        corrected: Corrected | None = None,
    ) -> tuple[list[Channel], list[Channel]]:
        """Channels of curves to fit, and those to predict; `prepared` makes their finite-element models.

        Parameters
        ----------
        coarse : bool
            Use a coarse mesh.
        comm : MPI.Comm
            Ranks that share each model, unless its surfaces can meet.
        prepared : Prepare
            Makes the finite-element model of a channel.
        measured : RecordingCache, optional
            Cache of the recordings that the caller reads.
        corrected : Corrected, optional
            Returns the correction of a channel's mesh.

        Raises
        ------
        InputError
            A file cannot be read, or nothing is left to fit.
        """
        case = self._case(coarse)
        material = self.material
        bulk_modulus = material.bulk_modulus
        if self.bulk_modulus and self.source == "coupons":
            # An incompressible coupon could not be put to a volumetric test.
            bulk_modulus = 1.0 / float(self.vectors()[0][-1])
        rubber = Rubber(self.law, dict(material.parameters), bulk_modulus)
        if self.source == "coupons":
            if not case.coupons:
                what, expected = "there are no [[coupons]] to fit a law to", "[[coupons]] with mode and file"
                if case.needs_fit:
                    what, expected = f"{what}, and no [material.parameters]", "one of both"
                expected = case.expected_tables(
                    f"{expected}; or `bushcli inverse`, which identifies the parameters from [[recordings]]"
                )
                raise InputError(Problem(str(case.path), what, "", expected))
            all_channels = coupon_channels(case, rubber, self.weighting, measured)
        else:
            if not case.recordings and not self._highest_frequencies:
                what = "there are no [[recordings]] to identify a law from"
                expected = case.expected_tables("[[recordings]] with mode and file")
                raise InputError(Problem(str(case.path), what, "", expected))
            if case.geometry.contact_surfaces:
                # Contact is modelled in one process: each one identifies the law by itself.
                comm = MPI.COMM_SELF
            all_channels = bushing_channels(case, rubber, comm, prepared, measured, corrected)
        channel_names = [
            *(channel.name for channel in all_channels),
            *(source.label for source in case.dynamic),
        ]
        for name in self.hold_out:
            if name not in channel_names:
                what = f'"{name}" is not a channel of this case'
                raise InputError(
                    Problem("--hold-out", what, nearest(name, channel_names), ", ".join(channel_names))
                )
        fitted = [channel for channel in all_channels if channel.name not in self.hold_out]
        if not fitted and not {name for name, _ in self._highest_frequencies} - set(self.hold_out):
            raise InputError(Problem("--hold-out", "leaves no channel to fit", "", ", ".join(channel_names)))
        return fitted, [channel for channel in all_channels if channel.name in self.hold_out]

    def _case(self, coarse: bool) -> Case:
        """The case, with a coarse mesh if asked for."""
        if not coarse:
            return self.case
        coarse_elements = self.case.geometry.coarse
        return replace(
            self.case, mesh=MeshOptions(coarse_elements.across, coarse_elements.along, coarse_elements.around)
        )

    def problem(
        self,
        coarse: bool = False,
        journal: Journal | None = None,
        progress: Progress | None = None,
        comm: MPI.Comm = MPI.COMM_WORLD,
        tables: TableCache | None = None,
    ) -> tuple[LeastSquaresProblem, list[Channel], list[DynamicChannel]]:
        """The least-squares problem, then all its curves and tables of dynamic stiffness, those held out too.

        Parameters
        ----------
        coarse : bool
            Use a coarse mesh.
        journal : Journal | None
            Where evaluations are saved, if at all.
        progress : Progress | None
            Called after each evaluation, unless None.
        comm : MPI.Comm
            Ranks that share each model.
        tables : TableCache, optional
            Cache of the binary files that the caller reads.
        """
        curves, predicted = self.channels(coarse, comm, measured=RecordingCache(tables))
        dynamic: list[DynamicChannel] = []
        if self.density and not self._highest_frequencies:
            what = "the density acts in vibrations alone, and there is no table of dynamic stiffness of the bushing"
            expected = '[[recordings]] with kind = "dynamic"; or leave --density out'
            raise InputError(Problem("--density", what, "", expected))
        if self.source == "recordings":
            if self.case.geometry.contact_surfaces:
                comm = MPI.COMM_SELF
            rubber = Rubber(self.law, dict(self.material.parameters), self.material.bulk_modulus)
            dynamic = dynamic_channels(self._case(coarse), rubber, comm, tables)
        fitted = [*curves, *(channel for channel in dynamic if channel.table.name not in self.hold_out)]
        return self.pose(fitted, journal, progress), [*curves, *predicted], dynamic

    def pose(
        self,
        fitted: Sequence[FitChannel],
        journal: Journal | None = None,
        progress: Progress | None = None,
        states: Array | None = None,
        start: int = 0,
        limits: Sequence[StepLimit] = (),
    ) -> LeastSquaresProblem:
        """The least-squares problem of some channels.

        Parameters
        ----------
        fitted : Sequence[FitChannel]
            Channels that are fitted.
        journal : Journal | None
            Where evaluations are saved, if at all.
        progress : Progress | None
            Called after each evaluation, unless None.
        states : Array | None
            Principal stretches in which the law has to be stable, shape (n, 3); None for those that are typical.
        start : int
            Number of the start whose search it is.
        limits : Sequence[StepLimit]
            Failed steps after which marches are given up, by channel, as an earlier search left them.
        """
        material = self.material
        values = {**material.parameters, **self.effect_values}
        fixed = {name: value for name, value in values.items() if self.is_fixed(name)}
        if states is None:
            stretches = [*STRETCHES, *(stretch for channel in fitted for stretch in channel.stretches)]
            states = coupon_states((min(stretches), max(stretches)))
        return LeastSquaresProblem(
            fitted,
            self.law,
            self.names,
            fixed,
            self.vectors()[1],
            states,
            journal,
            progress,
            start=start,
            limits=limits,
        )

    def identity(self) -> dict[str, Any]:
        """Return the values that must be equal for a run to resume another one."""
        options = {
            key: getattr(self, key)
            for key in (
                "model",
                "source",
                "fixed",
                "bulk_modulus",
                "density",
                "hold_out",
                "weighting",
                "loss",
            )
        }
        return {
            "case": case_json(self.case),
            "start": dict(self.start),
            "data": self.case.data_digest(),
            **options,
            "starts": self.starts,
            "globally": self.globally,
            "seed": self.seed,
        }


def refuse_fixed(tasks: Sequence[Task]) -> None:
    """Refuse to keep parameters that none of the tasks has, and to keep all parameters of one.

    Parameters
    ----------
    tasks : sequence of Task
        At least one, with the same `fixed`.

    Raises
    ------
    InputError
    """
    parameter_names = dict.fromkeys(
        name
        for task in tasks
        for name in (
            *task.material.parameters,
            *task.effect_values,
            *(name.rstrip("0123456789") for name in task.effect_values),
            *(active.name for active in task.effects),
            *(active.effect.name for active in task.effects),
        )
    )
    problems = [
        Problem(
            "--fix",
            f"no law or effect of this identification has {name}",
            nearest(name, parameter_names),
            ", ".join(parameter_names),
        )
        for name in tasks[0].fixed
        if name not in parameter_names
    ]
    problems += [
        Problem("--fix", f"leaves no parameter of {task.model} to identify")
        for task in tasks
        if not problems and not task.names
    ]
    if problems:
        raise InputError(*problems)
