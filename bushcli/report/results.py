"""Results that are more than one value, with what follows from them: computed once, told in views, JSON and plots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from bushcli.faults import DataFault, condition
from bushcli.report.cycles import ChannelHistory, fit_histories, response_histories, with_hysteresis
from bushcli.report.verdict import DirectVerdict, judge
from bushcli.runtime.condition import Condition

if TYPE_CHECKING:
    from pathlib import Path

    from bushcli.case import Case
    from bushcli.diagnosis.result import Diagnosis
    from bushcli.inverse import Fit
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep
    from bushcli.recording import RecordedProgram, Recording
    from bushcli.recording.dynamic.table import DynamicTable
    from bushcli.simulate.dynamic import DynamicResponse
    from bushcli.simulate.dynamic_tables import ComparedTable
    from bushcli.simulate.meshes import Meshed
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response
    from bushcli.standards.protocol import Protocol
    from bushcli.study.batch import Batch
    from bushcli.study.compare import Comparison
    from bushcli.study.design import Design
    from bushcli.study.study import Study


@dataclass(frozen=True)
class CheckResult:
    """A case that was checked."""

    case: Case
    curves: Sequence[Recording]  # of the bushing
    coupons: Sequence[Recording]
    tests: Protocol  # what the tests are
    faults: Sequence[DataFault] = ()  # of recordings and coupon tests
    programs: Sequence[RecordedProgram | None] = ()  # for each load case the program that it has in a file
    problems: Sequence[Condition] = ()  # those that are no faults of recordings
    tables: Sequence[DynamicTable] = ()  # measured dynamic stiffness

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """All conditions, those of the faults first."""
        return (*map(condition, self.faults), *self.problems)


@dataclass(frozen=True)
class MeshResult:
    """The meshes of a case, in the order of the tables."""

    case: Case
    meshes: Sequence[Meshed]


@dataclass(frozen=True)
class DirectResult:
    """A direct prediction beside what was measured."""

    response: Response
    misfits: Mapping[str, Misfit]  # by name, of the channels that were compared with a recording
    fit: Fit | None = None  # to the coupons; None where the case gives the parameters
    tables: Sequence[ComparedTable] | None = None  # of dynamic stiffness; None where the case has none
    doubts: Sequence[Condition] = ()  # about the comparison with the tables

    @cached_property
    def verdict(self) -> DirectVerdict:
        """The verdict in words."""
        return judge(self.response, self.misfits)

    @cached_property
    def histories(self) -> tuple[ChannelHistory, ...]:
        """The channels whose path reverses or has holds."""
        return response_histories(self.response, self.misfits)

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """Problems of fit and marches, recordings that were not compared, recorded loops that are not simulated."""
        what = "the simulation ended before the recording could be compared with it"
        not_compared = [
            Condition("not_compared", f"{channel.name}: {what}", "see why the simulation stopped")
            for channel in self.response.channels
            if channel.recording is not None and channel.name not in self.misfits
        ]
        # What is unusual about the case is said by the fit to its coupons and by the simulation.
        fit_conditions = self.fit.conditions if self.fit else ()
        known_conditions = tuple(dict.fromkeys((*fit_conditions, *self.response.conditions, *not_compared)))
        return (*with_hysteresis(known_conditions, self.histories), *self.doubts)


@dataclass(frozen=True)
class DynamicResult:
    """Dynamic stiffness, and the fit to the coupons; None where the case gives the parameters."""

    response: DynamicResponse
    fit: Fit | None = None


@dataclass(frozen=True)
class FitResult:
    """The law identified from the coupon tests of a case, and what its tables of dynamic moduli say."""

    case: Case
    fit: Fit | None  # None where the case has no tests but tables
    spectra: Sequence[TableSpectrum | TableSweep] = ()
    problems: Sequence[Condition] = ()  # of the tables

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """All conditions, those of the law first."""
        return (*(self.fit.conditions if self.fit else ()), *self.problems)


@dataclass(frozen=True)
class InverseResult:
    """Laws identified from the recordings of a case, the best first."""

    case: Case
    fits_in_base_units: Sequence[Fit] = field(repr=False)

    @cached_property
    def fits(self) -> list[Fit]:
        """The laws with values in the units of the case file."""
        from bushcli.inverse.file_units import in_file_units

        return [in_file_units(fit) for fit in self.fits_in_base_units]

    @property
    def best_fit(self) -> Fit:
        """The first law."""
        return self.fits[0]

    @cached_property
    def histories(self) -> tuple[ChannelHistory, ...]:
        """The channels whose path reverses or has holds."""
        return fit_histories(self.best_fit)

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """The conditions of the best law, and recorded loops that it does not have."""
        return with_hysteresis(self.best_fit.conditions, self.histories)


@dataclass(frozen=True)
class StudyResult:
    """A study, and the function that writes its designs at a path, as Parquet."""

    study: Study
    write_rows: Callable[[Path], None]


Result: TypeAlias = (
    "CheckResult | MeshResult | DirectResult | DynamicResult | FitResult | InverseResult"
    " | Diagnosis | StudyResult | Design | Batch | Comparison"
)
