"""Results that are more than one value, with what follows from them: computed once, told in views, JSON and plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from bushcli.faults import DataFault, condition
from bushcli.report.cycles import ChannelHistory, fit_histories, response_histories, with_hysteresis
from bushcli.report.verdict import DirectVerdict, judge
from bushcli.runtime.condition import Condition

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.inverse import Fit
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep
    from bushcli.recording import RecordedProgram, Recording
    from bushcli.recording.dynamic.table import DynamicTable
    from bushcli.simulate.dynamic_tables import ComparedTable
    from bushcli.simulate.meshes import Meshed
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response
    from bushcli.standards.protocol import Protocol


@dataclass(frozen=True)
class Checked:
    """A case that was checked.

    Attributes
    ----------
    curves, coupons : sequence of Recording
        Recordings of the bushing, and coupon tests.
    tests : Protocol
        What the tests are.
    faults : sequence of DataFault
        Faults of recordings and coupon tests.
    programs : sequence of RecordedProgram or None
        For each load case the program that it has in a file.
    problems : sequence of Condition
        Those that are no faults of recordings.
    tables : sequence of DynamicTable
        Measured tables of dynamic stiffness.
    """

    case: Case
    curves: Sequence[Recording]
    coupons: Sequence[Recording]
    tests: Protocol
    faults: Sequence[DataFault] = ()
    programs: Sequence[RecordedProgram | None] = ()
    problems: Sequence[Condition] = ()
    tables: Sequence[DynamicTable] = ()

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
    """A direct prediction beside what was measured.

    Attributes
    ----------
    misfits : mapping of str to Misfit
        By channel name, for the channels that were compared with a recording.
    fit : Fit, optional
        Fit to the coupons; None where the case gives the parameters.
    tables : sequence of ComparedTable, optional
        Tables of dynamic stiffness beside their simulation; None where the case has none.
    doubts : sequence of Condition
        What has to be known about the comparison with the tables.
    """

    response: Response
    misfits: Mapping[str, Misfit]
    fit: Fit | None = None
    tables: Sequence[ComparedTable] | None = None
    doubts: Sequence[Condition] = ()

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
        left = tuple(
            Condition(
                "not_compared",
                f"{channel.name}: the simulation ended before the recording could be compared with it",
                "see why the simulation stopped",
            )
            for channel in self.response.channels
            if channel.recording is not None and channel.name not in self.misfits
        )
        # What is unusual about the case is said by the fit to its coupons and by the simulation.
        first = self.fit.conditions if self.fit else ()
        known = tuple(dict.fromkeys((*first, *self.response.conditions, *left)))
        return (*with_hysteresis(known, self.histories), *self.doubts)


@dataclass(frozen=True)
class FitResult:
    """The law identified from the coupon tests of a case.

    Attributes
    ----------
    fit : Fit or None
        None where the case has no tests but tables.
    spectra : sequence of TableSpectrum or TableSweep
        What its tables of dynamic moduli say.
    problems : sequence of Condition
        Of the tables.
    """

    case: Case
    fit: Fit | None
    spectra: Sequence[TableSpectrum | TableSweep] = ()
    problems: Sequence[Condition] = ()

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """All conditions, those of the law first."""
        return (*(self.fit.conditions if self.fit else ()), *self.problems)


@dataclass(frozen=True)
class InverseResult:
    """Laws identified from the recordings of a case.

    Attributes
    ----------
    found : sequence of Fit
        The best first.
    """

    case: Case
    found: Sequence[Fit] = field(repr=False)

    @cached_property
    def fits(self) -> list[Fit]:
        """The laws with values in the units of the case file."""
        from bushcli.inverse.file_units import in_file_units

        return [in_file_units(fit) for fit in self.found]

    @property
    def best(self) -> Fit:
        """The first law."""
        return self.fits[0]

    @cached_property
    def histories(self) -> tuple[ChannelHistory, ...]:
        """The channels whose path reverses or has holds."""
        return fit_histories(self.best)

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """The conditions of the best law, and recorded loops that it does not have."""
        return with_hysteresis(self.best.conditions, self.histories)
