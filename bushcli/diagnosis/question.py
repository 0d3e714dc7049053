"""Input of a diagnosis: recordings, plain law, effects to consider; and the likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.case.typical import unusual
from bushcli.effects.effect import Effect, effects_on
from bushcli.errors import InputError, Problem, nearest
from bushcli.faults import DataFault, find_faults, masks
from bushcli.inverse.identify import fit_coupons
from bushcli.likelihood.form import Likelihood
from bushcli.likelihood.level import all_levelled
from bushcli.likelihood.noise import noise_model
from bushcli.recording import Recording, read_recording
from bushcli.recording.table_cache import TableCache
from bushcli.runtime.condition import Condition
from bushcli.runtime.workers import Workers
from bushcli.selection.fit import FittedSamples, fit
from bushcli.selection.model import Fitted, Model
from bushcli.selection.model_cache import ModelCache
from bushcli.selection.plain import all_features
from bushcli.selection.state import CommonData, State
from forms.law import law, laws

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Question:
    """Input of a diagnosis.

    Attributes
    ----------
    case : Case
        As it was loaded.
    bare : Case
        Without effects and without the channels that are held out.
    whole, recordings : tuple of Recording
        All recordings of the case, and those of the bare case.
    used : tuple of array of bool, shape (n,) each
        Samples of the bare case's recordings that count.
    faults : tuple of DataFault
        Of all recordings, the fatal ones first.
    plain : Model
        The law to begin with.
    law_from : {"recordings", "coupons"}
        Where the law comes from.
    material : Material
        The case's material with that law.
    effects : list of Effect
        To be considered.
    requested : tuple of str or None
        Their names, where the user gave them.
    """

    case: Case
    bare: Case
    whole: tuple[Recording, ...]
    recordings: tuple[Recording, ...]
    used: tuple[Mask, ...]
    faults: tuple[DataFault, ...]
    plain: Model
    law_from: Literal["recordings", "coupons"]
    material: Material
    effects: list[Effect]
    requested: tuple[str, ...] | None

    @property
    def unusual(self) -> tuple[Condition, ...]:
        """A condition for each number of the case and of its recordings that bushings do not have."""
        return unusual(self.case, self.case.material, self.whole)

    @property
    def fatal(self) -> bool:
        """Whether a recording that is not held out has a fault that rules out a diagnosis."""
        names = [one.name for one in self.recordings]
        return any(fault.fatal and fault.channel in names for fault in self.faults)


def question(
    case: Case,
    model: str | None,
    effects: Sequence[str] | None,
    hold_out: Sequence[str],
    tables: TableCache,
) -> Question:
    """Read the recordings, find their faults, and choose the law to begin with.

    Parameters
    ----------
    case : Case
    model : str or None
        Law to begin with; the case's where None.
    effects : sequence of str or None
        Names of the effects to be considered; all where None.
    hold_out : sequence of str
        Names of channels that are left out of fits and evidence.
    tables : TableCache

    Raises
    ------
    InputError
        There are no recordings, one cannot be read, or a name is unknown.
    """
    whole = _checked(case, model, effects, hold_out, tables)
    faults = find_faults(case, whole)
    plain, source, material = _plain(case, model, tables)
    bare, recordings = _without(case, whole, hold_out)
    used = tuple(~masks(faults, one) for one in recordings)
    requested, considered = None if effects is None else tuple(effects), _considered(bare, effects)
    return Question(
        case, bare, whole, recordings, used, faults, plain, source, material, considered, requested
    )


def _checked(
    case: Case,
    model: str | None,
    only: Sequence[str] | None,
    hold_out: Sequence[str],
    tables: TableCache,
) -> tuple[Recording, ...]:
    """Return the recordings of the case, after all names have been checked."""
    if not case.recordings:
        wanted = case.expected("[[recordings]] with mode and file")
        raise InputError(Problem(str(case.path), "there are no [[recordings]] to diagnose", "", wanted))
    recordings = tuple(read_recording(source, tables=tables) for source in case.recordings)
    if model is not None and model not in laws():
        raise InputError(
            Problem("--model", f'"{model}" is not a law', nearest(model, laws()), ", ".join(laws()))
        )
    names = [one.name for one in recordings]
    for given, known, option, kind in (
        (
            only or (),
            list(effects_on("static")),
            "--effects",
            "an effect that a diagnosis can find in recordings",
        ),
        (hold_out, names, "--hold-out", "a channel of this case"),
    ):
        wrong = [name for name in given if name not in known]
        if wrong:
            # The list of valid names is long, so that it is shown only once.
            lists = [""] * (len(wrong) - 1) + [", ".join(known)]
            raise InputError(
                *(
                    Problem(option, f'"{name}" is not {kind}', nearest(name, known), expected)
                    for name, expected in zip(wrong, lists, strict=True)
                )
            )
    if hold_out and set(names) <= set(hold_out):
        raise InputError(Problem("--hold-out", "leaves no channel to diagnose", "", ", ".join(names)))
    return recordings


def _without(
    case: Case, recordings: Sequence[Recording], hold_out: Sequence[str]
) -> tuple[Case, tuple[Recording, ...]]:
    """Return the case without effects and held-out channels, and its recordings."""
    kept_ = [(s, r) for s, r in zip(case.recordings, recordings, strict=True) if r.name not in hold_out]
    bare = replace(case, effects=(), recordings=tuple(source for source, _ in kept_))
    return bare, tuple(recording for _, recording in kept_)


def _considered(case: Case, only: Sequence[str] | None) -> list[Effect]:
    """Return the effects to be considered, among those that the specimen can have."""
    specimen = "coupon" if case.geometry.specimen == "coupon" else "bushing"
    return [
        effect
        for name, effect in effects_on("static").items()
        if specimen in effect.specimens and (only is None or name in only)
    ]


def _plain(
    case: Case, name: str | None, tables: TableCache
) -> tuple[Model, Literal["recordings", "coupons"], Material]:
    """The law to begin with, where it comes from, and the case's material with that law."""
    material = (
        case.material
        if name in (None, case.material.law)
        else Material(str(name), case.material.bulk_modulus)
    )
    chosen = law(material.law)
    if case.coupons:
        fitted = fit_coupons(case, material.law, tables=tables).material
        return Model(material.law, dict(fitted.parameters), fixed=True, terms=fitted.terms), "coupons", fitted
    names = material.parameter_names
    start = {key: chosen.parameter(key).start for key in names} | dict(material.parameters)
    return Model(material.law, start, terms=material.terms), "recordings", material


def pose_problem(
    case: Case,
    plain: Fitted,
    recordings: tuple[Recording, ...],
    used: tuple[Mask, ...],
    crew: Workers,
    cache: ModelCache,
) -> tuple[CommonData, State]:
    """Return the likelihood, and the plain law fitted under it.

    What the plain law leaves is what effects may explain. Its first fit begins with the error that `begin` assumed, its
    second one with the misfit of the first.

    Parameters
    ----------
    case : Case
        Without effects.
    plain : Fitted
        The plain law as `selection.plain.begin` fitted it.
    recordings : tuple of Recording
    used : tuple of array of bool, shape (n,) each
        Samples that count.
    crew : Workers
        Runs the fits.
    cache : ModelCache
        Of this process.
    """
    noises = tuple(noise_model(one, m) for one, m in zip(recordings, used, strict=True))
    features = all_features(cache, case, plain.model, used, noises)
    left = [
        one.of(force - recording.force)
        for one, force, recording in zip(features, plain.simulated, recordings, strict=True)
    ]
    noises = all_levelled(noises, features, left)
    features = all_features(cache, case, plain.model, used, noises)
    empty = CommonData(case, recordings, noises, used, Likelihood(features, tuple(0.0 for _ in features)))

    def explaining(fitted: Fitted) -> CommonData:
        excess = State(empty, fitted).evidence.left.excess
        return replace(empty, likelihood=Likelihood(features, tuple(map(float, excess))))

    fitted, problem = plain, explaining(plain)
    for _ in range(2 if plain.names else 0):
        measured = FittedSamples(used, problem.likelihood.plain, noises)
        fitted = crew.run(fit, [(case, fitted.model, measured)])[0] or fitted
        problem = explaining(fitted)
    return problem, State(problem, fitted)
