"""Definition of an identification, from which every worker builds its own least-squares problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
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
from bushcli.simulate.predict import rubber_of
from bushcli.simulate.recording_cache import RecordingCache
from cases.simulate import Prepare, prepare
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
        material, law = self.case.material, self.law
        same = material.law == law.name
        empty = replace(material, law=law.name, parameters={}, terms=material.terms if same else self.terms)
        names = material.parameter_names if same else empty.parameter_names
        values = {name: law.parameter(name).start for name in names}
        values |= material.parameters if same else {}
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
        tables = self._highest_frequencies.items()
        frequencies = [f for (name, mode), f in tables if active.acts_on(name, mode, "dynamic")]
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
        channels = [(source.label, source.mode) for source in self.case.recordings]
        channels += [(source.label, source.mode) for source in self.case.dynamic]
        return parameters_in_degrees(self.effects, channels)

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
        free += ["compliance"] if self.bulk_modulus else []
        return (*free, "density") if self.density else tuple(free)

    def vectors(self) -> tuple[Array, Bounds]:
        """Start, shape (parameters,), and bounds of the parameters that are identified."""
        material, logarithmic = self.material, set()
        compressibility = 1.0 / material.bulk_modulus if np.isfinite(material.bulk_modulus) else 1e-3
        low, high = COMPLIANCE_OF_TEST if self.source == "coupons" else COMPLIANCE
        # Start and bounds.
        rows = {
            "density": (material.density / DENSITY, *DENSITIES),
            "compliance": (min(max(compressibility, low), high), low, high),
        }
        for name, start in material.parameters.items():
            rows[name] = (start, self.law.parameter(name).lower, self.law.parameter(name).upper)
        for active, p in ((effect, p) for effect in self.effects for p in effect.parameters):
            start = active.values[p.name]
            _, low, high = p.fit_range(self.case.geometry, self.period(active))
            rows[active.full_name(p)] = (start, min(low, start), high)
            if p.off is None and p.lower >= 0.0 and p.prior is not None and p.prior.is_logarithmic:
                logarithmic.add(active.full_name(p))
        starts, lower, upper = np.array([rows[name] for name in self.names], dtype=float).reshape(-1, 3).T
        return starts, Bounds(
            lower, upper, np.array([name in logarithmic for name in self.names], dtype=bool)
        )

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
        measured : RecordingCache, optional
            Cache of the recordings that the caller reads.
        corrected : Corrected, optional
            Returns the correction of a channel's mesh.

        Raises
        ------
        InputError
            A file cannot be read, or nothing is left to fit.
        """
        case, rubber = self._case(coarse), rubber_of(self.material)
        if self.source == "coupons":
            if not case.coupons:
                what, expected = "there are no [[coupons]] to fit a law to", "[[coupons]] with mode and file"
                if case.needs_fit:
                    what, expected = f"{what}, and no [material.parameters]", "one of both"
                expected += "; or `bushcli inverse`, which identifies the parameters from [[recordings]]"
                raise InputError(Problem(str(case.path), what, "", case.expected_tables(expected)))
            if self.bulk_modulus:
                # An incompressible coupon could not be put to a volumetric test.
                rubber = replace(rubber, bulk_modulus=1.0 / float(self.vectors()[0][-1]))
            channels = coupon_channels(case, rubber, self.weighting, measured)
        else:
            if not case.recordings and not self._highest_frequencies:
                what = "there are no [[recordings]] to identify a law from"
                expected = case.expected_tables("[[recordings]] with mode and file")
                raise InputError(Problem(str(case.path), what, "", expected))
            channels = bushing_channels(case, rubber, self._sharing(comm), prepared, measured, corrected)
        names = [*(channel.name for channel in channels), *(source.label for source in case.dynamic)]
        for name in self.hold_out:
            if name not in names:
                what = f'"{name}" is not a channel of this case'
                raise InputError(Problem("--hold-out", what, nearest(name, names), ", ".join(names)))
        fitted = [channel for channel in channels if channel.name not in self.hold_out]
        if not fitted and not {name for name, _ in self._highest_frequencies} - set(self.hold_out):
            raise InputError(Problem("--hold-out", "leaves no channel to fit", "", ", ".join(names)))
        return fitted, [channel for channel in channels if channel.name in self.hold_out]

    def _case(self, coarse: bool) -> Case:
        """The case, with a coarse mesh if asked for."""
        elements = self.case.geometry.coarse
        mesh = MeshOptions(elements.across, elements.along, elements.around)
        return replace(self.case, mesh=mesh) if coarse else self.case

    def _sharing(self, comm: MPI.Comm) -> MPI.Comm:
        """Ranks that share a model. Contact is modelled in one process: each one then identifies the law by itself."""
        return MPI.COMM_SELF if self.case.geometry.contact_surfaces else comm

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
        coarse, comm, journal, progress
            As in `channels` and `pose`.
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
            rubber = rubber_of(self.material)
            dynamic = dynamic_channels(self._case(coarse), rubber, self._sharing(comm), tables)
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
        fitted, journal, progress, start, limits
            As `LeastSquaresProblem` has them.
        states : Array | None
            Principal stretches in which the law has to be stable, shape (n, 3); None for those that are typical.
        """
        values = {**self.material.parameters, **self.effect_values}
        fixed = {name: value for name, value in values.items() if self.is_fixed(name)}
        if states is None:
            stretches = [*STRETCHES, *(stretch for channel in fitted for stretch in channel.stretches)]
            states = coupon_states((min(stretches), max(stretches)))
        bounds, law, names = self.vectors()[1], self.law, self.names
        return LeastSquaresProblem(
            fitted, law, names, fixed, bounds, states, journal, progress, start=start, limits=limits
        )

    def identity(self) -> dict[str, Any]:
        """Return the values that must be equal for a run to resume another one."""
        digests = {"case": case_json(self.case), "start": dict(self.start), "data": self.case.data_digest()}
        options = {option.name: getattr(self, option.name) for option in fields(self)}
        without = {"case", "start", "workers", "terms", "tables"}
        return digests | {name: value for name, value in options.items() if name not in without}


def refuse_fixed(tasks: Sequence[Task]) -> None:
    """Refuse to keep parameters that none of the tasks, which have the same `fixed`, has, and to keep all of one."""
    names: dict[str, None] = {}
    for task in tasks:
        names |= dict.fromkeys([*task.material.parameters, *task.effect_values])
        names |= dict.fromkeys(name.rstrip("0123456789") for name in task.effect_values)
        names |= dict.fromkeys([active.name for active in task.effects])
        names |= dict.fromkeys(active.effect.name for active in task.effects)
    what, known = "no law or effect of this identification has", ", ".join(names)
    unknown = [name for name in tasks[0].fixed if name not in names]
    problems = [Problem("--fix", f"{what} {name}", nearest(name, names), known) for name in unknown]
    empty = [task.model for task in tasks if not unknown and not task.names]
    problems += [Problem("--fix", f"leaves no parameter of {model} to identify") for model in empty]
    if problems:
        raise InputError(*problems)
