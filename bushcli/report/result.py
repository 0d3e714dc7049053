"""Everything that a run of a command found, gathered for whoever shows it."""

from __future__ import annotations

import importlib
import importlib.metadata
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field

from bushcli import __version__
from bushcli.casefile import Case
from bushcli.condition import Condition
from bushcli.direct import Response, Simulated
from bushcli.inverse import Fit
from bushcli.misfit import Misfit, misfit


@dataclass(frozen=True)
class Result:
    """The answer of a command.

    Attributes
    ----------
    command : str
        "fit", "direct".
    case : Case
    response : Response or None
        Simulated channels.
    fit : Fit or None
        The identified law, also where `direct` had to identify it first.
    misfits
        Channel name -> misfit, for the channels with a recording that the simulation reached.
    problems : tuple of Condition
    versions
        Program -> version.
    timings
        Stage -> seconds.
    """

    command: str
    case: Case
    response: Response | None = None
    fit: Fit | None = None
    misfits: Mapping[str, Misfit] = field(default_factory=dict)
    problems: tuple[Condition, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)

    @property
    def channels(self) -> tuple[Simulated, ...]:
        """The simulated channels."""
        return self.response.channels if self.response else ()


def gather(
    command: str,
    case: Case,
    *,
    response: Response | None = None,
    fit: Fit | None = None,
    timings: Mapping[str, float] | None = None,
) -> Result:
    """Gather a result: compare every recorded channel, and collect the problems of all stages.

    Parameters
    ----------
    command
        Name of the command.
    case
        The case in hand, overrides applied.
    response, fit
        What was computed.
    timings
        Seconds by stage.
    """
    misfits: dict[str, Misfit] = {}
    problems = list(fit.conditions) if fit else []
    if response is not None:
        problems += response.conditions
        for channel in response.channels:
            if channel.recording is None:
                continue
            try:
                misfits[channel.name] = misfit(channel)
            except ValueError as error:
                problems.append(
                    Condition(
                        "not_compared",
                        f"{channel.name}: cannot be compared with its recording: {error}",
                        "see why the simulation stopped",
                    )
                )
    return Result(command, case, response, fit, misfits, tuple(problems), versions(), dict(timings or {}))


def versions() -> dict[str, str]:
    """Versions of what the numbers depend on."""
    found = {"bushcli": __version__, "python": platform.python_version()}
    for name in ("dolfinx", "gmsh", "numpy", "scipy"):
        module = importlib.import_module(name)
        found[name] = str(getattr(module, "__version__", "")) or importlib.metadata.version(name)
    petsc = importlib.import_module("petsc4py.PETSc")
    found["petsc"] = ".".join(map(str, petsc.Sys.getVersion()))
    return found
