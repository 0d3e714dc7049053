"""A case, or the folder of a result -> the data that can be exported.

A case gives its material and effects. The folder of `direct` also gives curves and matrices, that of `dynamic` the
dynamic stiffness, that of `fit` or `inverse` the identified law and effects, that of `diagnose` the most probable one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bushcli.case import Case, load_case
from bushcli.case.identified import identified_tables
from bushcli.case.load import RESULT
from bushcli.case.rebuild import read_result, rebuilt_case
from bushcli.effects.active import require_values
from bushcli.errors import InputError, Problem, nearest
from bushcli.export.curves import Array, ForceCurve, curves_of, matrix_of
from bushcli.export.vibration import Vibration, vibrations_in
from bushcli.recording.table_cache import TableCache

_COMMANDS = ("direct", "dynamic", "fit", "inverse", "diagnose", "check")


@dataclass(frozen=True)
class ExportSource:
    """Source of an export."""

    case: Case  # with the identified material and effects, if there are any
    where: str  # case file or folder
    curves: tuple[ForceCurve, ...] = ()  # those that have been simulated already
    stiffness_matrix: Array | None = None  # (6, 6); N, mm, rad
    state: str = ""  # of the matrix: "relaxed", "unrelaxed", or empty where the result does not say
    vibrations: tuple[Vibration, ...] = ()  # dynamic stiffness that has been simulated already

    def without(self, names: Sequence[str]) -> ExportSource:
        """Return this source without some of its effects.

        Parameters
        ----------
        names : sequence of str
            Names of effects of the case.

        Raises
        ------
        InputError
            The case has no such effect.
        """
        present = [active.effect.name for active in self.case.effects]
        for name in names:
            if name not in present:
                expected = ", ".join(present) or "the case has no effects"
                what = f'"{name}" is not an effect of this case'
                raise InputError(Problem("--without", what, nearest(name, present), expected))
        remaining = tuple(active for active in self.case.effects if active.effect.name not in names)
        # What was simulated with the effect is wrong without it; a relaxed matrix has no effect that fades.
        curves, vibrations = ((), ()) if names else (self.curves, self.vibrations)
        fading = all(active.effect.fades for active in self.case.effects if active.effect.name in names)
        matrix = self.stiffness_matrix if self.state == "relaxed" and fading else None
        matrix = matrix if names else self.stiffness_matrix
        case = replace(self.case, effects=remaining)
        return replace(self, case=case, curves=curves, stiffness_matrix=matrix, vibrations=vibrations)


def read_source(path: Path, overrides: Sequence[str] = (), tables: TableCache | None = None) -> ExportSource:
    """Read a case file, or a folder of results.

    Parameters
    ----------
    path : Path
        Case file, or the folder that a command wrote with -o, or its result.json.
    overrides : sequence of str
        ``KEY=VALUE`` for a case file.
    tables : TableCache, optional
        Cache of the binary files that the caller reads.

    Raises
    ------
    InputError
        The path is neither, or an effect has a parameter without a value.
    """
    file = path / RESULT if path.is_dir() else path
    if file.name != RESULT:
        case = load_case(path, overrides, tables)
        source = ExportSource(case, str(path))
    elif overrides:
        what, remedy = (
            "changes a case file, but a result is given",
            "export the case file, or run again with --set",
        )
        raise InputError(Problem(f"--set {overrides[0]}", what, "", remedy))
    else:
        result = read_result(file, path)
        if result.get("command") not in _COMMANDS:
            expected = f"one of {', '.join(f'`bushcli {name}`' for name in _COMMANDS)}"
            raise InputError(Problem(str(file), "is not a result that can be exported", "", expected))
        try:
            case = rebuilt_case(dict(result["case"]) | identified_tables(result), file.parent)
            exported = curves_of(result), *matrix_of(result), vibrations_in(result)
            source = ExportSource(case, str(path), *exported)
        except (KeyError, TypeError, AttributeError, ValueError):
            what = "is not a complete result of bushcli"
            raise InputError(Problem(str(file), what, "", "run the command again")) from None
    require_values(source.case.effects, source.where)
    return source
