"""Input of a diagnosis: recordings, plain law, effects to consider; and the likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.case.typical import unusual_values
from bushcli.effects.effect import Effect, effects
from bushcli.errors import InputError, Problem, nearest
from bushcli.faults import DataFault, find_faults, masks
from bushcli.faults.dynamic import table_faults
from bushcli.inverse.identify import fit_coupons
from bushcli.inverse.table_channel import recorded_tables
from bushcli.likelihood.form import Likelihood
from bushcli.likelihood.level import all_levelled
from bushcli.likelihood.noise import noise_model
from bushcli.recording import Recording, read_recording
from bushcli.recording.dynamic.rows import RecordedTable
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
        paths = [recording for recording in self.whole if recording.kind == "static"]
        return unusual_values(self.case, self.case.material, paths)

    @property
    def fatal(self) -> bool:
        """Whether a recording that is not held out has a fault that rules out a diagnosis."""
        names = [recording.name for recording in self.recordings]
        return any(fault.fatal and fault.channel in names for fault in self.faults)


def question(
    case: Case, model: str | None, effects: Sequence[str] | None, hold_out: Sequence[str], tables: TableCache
) -> Question:
    """Read the recordings, find their faults, and choose the law to begin with.

    `model` is that law, the case's where None; `effects` are to be considered, all where None; the channels `hold_out`
    are left out of fits and evidence.

    Raises
    ------
    InputError
        There are no recordings, one cannot be read, or a name is unknown.
    """
    whole = _checked_recordings(case, model, effects, hold_out, tables)
    vibrating = [recording for recording in whole if isinstance(recording, RecordedTable)]
    faults = find_faults(case, tuple(recording for recording in whole if recording.kind == "static"))
    # Each row of a table has two samples.
    faults += tuple(
        replace(fault, samples=np.tile(fault.samples, 2))
        for fault in table_faults(case.geometry, [recording.table for recording in vibrating])
    )
    plain, source, material = _plain_law(case, model, tables)
    bare = replace(
        case,
        effects=(),
        recordings=tuple(source for source in case.recordings if source.label not in hold_out),
        dynamic=tuple(source for source in case.dynamic if source.label not in hold_out),
    )
    recordings = tuple(recording for recording in whole if recording.name not in hold_out)
    used = tuple(~masks(faults, recording) for recording in recordings)
    requested, considered = None if effects is None else tuple(effects), _considered_effects(bare, effects)
    return Question(
        case, bare, whole, recordings, used, faults, plain, source, material, considered, requested
    )


def _checked_recordings(
    case: Case, model: str | None, only: Sequence[str] | None, hold_out: Sequence[str], tables: TableCache
) -> tuple[Recording, ...]:
    """Return the recordings of the case, after all names have been checked."""
    recordings = (
        *(read_recording(source, tables=tables) for source in case.recordings),
        *recorded_tables(case, tables),
    )
    if not recordings:
        wanted = case.expected_tables("[[recordings]] with mode and file")
        raise InputError(Problem(str(case.path), "there are no [[recordings]] to diagnose", "", wanted))
    if model is not None and model not in laws():
        raise InputError(
            Problem("--model", f'"{model}" is not a law', nearest(model, laws()), ", ".join(laws()))
        )
    names, kinds = [recording.name for recording in recordings], {recording.kind for recording in recordings}
    for given, known, option, kind in (
        (
            only or (),
            [name for name, effect in effects().items() if effect.kinds & kinds],
            "--effects",
            "an effect that a diagnosis can find in recordings",
        ),
        (hold_out, names, "--hold-out", "a channel of this case"),
    ):
        wrong = [name for name in given if name not in known]
        if wrong:
            # The list of valid names is long, so that it is shown only once.
            lists = [""] * (len(wrong) - 1) + [", ".join(known)]
            problems = (
                Problem(option, f'"{name}" is not {kind}', nearest(name, known), expected)
                for name, expected in zip(wrong, lists, strict=True)
            )
            raise InputError(*problems)
    if hold_out and set(names) <= set(hold_out):
        raise InputError(Problem("--hold-out", "leaves no channel to diagnose", "", ", ".join(names)))
    return recordings


def _considered_effects(case: Case, only: Sequence[str] | None) -> list[Effect]:
    """Return the effects to be considered, among those that the specimen can have.

    How the bushing is assembled changes a stiffness as the law's modulus does: tables alone hardly show it, so that it
    is considered with them only where the user asks for it.
    """
    specimen = "coupon" if case.geometry.specimen == "coupon" else "bushing"
    return [
        effect
        for name, effect in effects().items()
        if specimen in effect.specimens
        and (name in only if only is not None else case.recordings or _is_shown_by_tables(effect))
        and (case.dynamic or "static" in effect.kinds)
    ]


def _is_shown_by_tables(effect: Effect) -> bool:
    """Whether tables alone can show an effect: relaxation and its temperature, and effects of a dynamic rig."""
    if effect.acts == "rig":
        return effect.kinds == {"dynamic"} or effect.may_be_shared or effect.is_factor
    return effect.acts == "rubber" and ((effect.needs_time and effect.fades) or effect.needs_temperature)


def _plain_law(
    case: Case, name: str | None, tables: TableCache
) -> tuple[Model, Literal["recordings", "coupons"], Material]:
    """The law to begin with, where it comes from, and the case's material with that law."""
    material = case.material
    if name not in (None, material.law):
        material = Material(str(name), material.bulk_modulus)
    if case.coupons:
        fitted = fit_coupons(case, material.law, tables=tables).material
        return Model(material.law, dict(fitted.parameters), fixed=True, terms=fitted.terms), "coupons", fitted
    chosen = law(material.law)
    start = {key: chosen.parameter(key).start for key in material.parameter_names} | dict(material.parameters)
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

    What the plain law leaves is what effects may explain. It is fitted twice: with the misfit that `plain` leaves as
    its error, then with that of the first fit.
    """
    noises = tuple(noise_model(recording, m) for recording, m in zip(recordings, used, strict=True))
    features = all_features(cache, case, plain.model, used, noises)
    left = [
        feature.of(force - recording.force)
        for feature, force, recording in zip(features, plain.simulated, recordings, strict=True)
    ]
    noises = all_levelled(noises, features, left)
    features = all_features(cache, case, plain.model, used, noises)
    empty = CommonData(case, recordings, noises, used, Likelihood(features, tuple(0.0 for _ in features)))

    def with_misfit_of(fitted: Fitted) -> CommonData:
        excess = State(empty, fitted).evidence.left.excess
        return replace(empty, likelihood=Likelihood(features, tuple(map(float, excess))))

    fitted, problem = plain, with_misfit_of(plain)
    for _ in range(2 if plain.names else 0):
        measured = FittedSamples(used, problem.likelihood.plain, noises)
        fitted = crew.run(fit, [(case, fitted.model, measured)])[0] or fitted
        problem = with_misfit_of(fitted)
    return problem, State(problem, fitted)
