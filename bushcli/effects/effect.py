"""The type of an effect, and the registry of effects.

An effect is physics that the plain model leaves out, as a small change to it that vanishes with its amplitude. It
is defined in one file, ``bushcli/effects/library/<name>.py``, as ``EFFECT``, and serves simulation,
identification and diagnosis alike. It acts on the finite-element model (``feature``) or on the curve (``rig``).

This module imports nothing of the finite-element stack, so that a case file can be checked against the registry
before that is loaded. Effects are found at run time; nothing here depends on any of them.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.change import RigChange
from bushcli.effects.exported import CardPart, ForceLawPart
from bushcli.effects.names import effect_name
from bushcli.effects.prior import Prior
from cases.mode import modes
from forms.law import UnknownName, find_parameter
from geometry.shape import Mirrors, Shape, Sleeve

if TYPE_CHECKING:
    from cases.feature import Feature

Array = NDArray[np.float64]

#: Of a channel: a force along a path, or a table of dynamic stiffness (a load case with vibrations).
Kind = Literal["static", "dynamic"]

_SLEEVE = Sleeve(thickness=1.0)


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    Attributes
    ----------
    name : str
        As in the case file.
    unit : str
        "1" for a parameter without a unit.
    meaning : str
        One line for ``bushcli list effects``.
    start_and_bounds : (float, float, float)
        Start value of a fit if nothing better is known, for an amplitude a small, typical value other than ``off``;
        lowest and highest admissible value.
    off : float or None
        For an amplitude, the value at which the effect is absent; None for a shape parameter, such as a time or a gap.
    optional : bool
        Whether the parameter may be absent, as may those of a second and third branch, or one that refines the effect.
    belongs_to : str
        Name of the optional parameter with which it comes: a model has both or neither.
    motions : frozenset of str
        For an optional parameter, the motions ("uy") whose reactions it changes to first order: where one of them was
        recorded, a diagnosis gives it to the effect from the start, and it tries it nowhere else.
    scan : tuple of float
        Values of a shape parameter that a diagnosis tries, in units of ``scale``.
    in_tables : (float, float) or None
        Start value and lowest value of a fit to tables of dynamic stiffness, in periods of their highest frequency; for
        a time.
    in_curves : float
        Lowest value of a fit to curves alone.
    scale : {"", "duration", "amplitude"}
        What ``scan`` and ``sizes`` are relative to: the duration of the recording, or its largest displacement; where
        empty nothing, for ``sizes`` the rubber's thickness.
    sizes : tuple of float
        Finite amplitudes to be tried where the curve takes another form as they grow.
    reciprocal : (str, str) or None
        Name and unit of 1/value, which the case file may give instead, because it is usual in the literature.
    exponential : str
        Name of exp(value) in results, for a value that is the logarithm of what people think of.
    per_time : str
        Name of the parameter that is the power of a time, in s, by which the value is multiplied.
    adds_to : str
        Attribute of the material to whose reciprocal the value is added, such as a bulk modulus for a compliance.
    of_channel : bool
        Whether the parameter belongs to one channel. In a rotational mode a displacement (mm), a force (N, N/s) or a
        stiffness (N/mm) becomes an angle, a moment or N mm per angle; degrees in the case file, rad inside.
    of_mesh : bool
        Whether each of its values makes a model of its own, as does a dimension of the mesh, a choice or a reference:
        a fit keeps its value.
    choices : tuple of str
        For a parameter that is a choice, the words that replace a number in the case file; its value is the index of
        one of them. Such a parameter is ``of_mesh`` and has no unit.
    twins : tuple of (str, str)
        Choices that are each other's mirror image about z = 0.
    under : str
        The choice of the effect with which the parameter is used; empty for any.
    searched : bool
        Whether a diagnosis may add it to a model; else only a case file gives it.
    variant : bool
        For an optional shape parameter: whether a diagnosis tries the effect both with it and without it. At its lowest
        value the effect is as without it.
    not_with : str
        Name of an optional parameter beside which it has no meaning.
    along_path : bool
        Whether it has no meaning in a vibration, so that a diagnosis gives it to recordings along a path alone.
    of_amplitude : bool
        Whether it refines how the effect depends on the amplitude, so that tables of several amplitudes show it.
    within : (str, float) or None
        "thickness" or "length" of the rubber or their quotient, and the share of it that the value's size must not
        exceed: beyond it there is no such bushing.
    prior : Prior
        Knowledge of its value before any recording.
    """

    name: str
    unit: str
    meaning: str
    start_and_bounds: tuple[float, float, float]
    off: float | None = None
    optional: bool = False
    belongs_to: str = ""
    motions: frozenset[str] = frozenset()
    scan: tuple[float, ...] = ()
    in_tables: tuple[float, float] | None = None
    in_curves: float = -math.inf
    scale: Literal["", "duration", "amplitude"] = ""
    sizes: tuple[float, ...] = ()
    reciprocal: tuple[str, str] | None = None
    exponential: str = ""
    per_time: str = ""
    adds_to: str = ""
    of_channel: bool = False
    of_mesh: bool = False
    choices: tuple[str, ...] = ()
    twins: tuple[tuple[str, str], ...] = ()
    under: str = ""
    searched: bool = True
    variant: bool = False
    not_with: str = ""
    along_path: bool = False
    of_amplitude: bool = False
    within: tuple[Literal["thickness", "length", "thickness/length"], float] | None = None
    prior: Prior | None = None

    @property
    def start(self) -> float:
        """Start value of a fit."""
        return self.start_and_bounds[0]

    @property
    def lower(self) -> float:
        """Lowest admissible value."""
        return self.start_and_bounds[1]

    @property
    def upper(self) -> float:
        """Highest admissible value."""
        return self.start_and_bounds[2]

    @property
    def stem(self) -> str:
        """The name without the number of a branch."""
        return self.name.rstrip("0123456789")

    @property
    def branch(self) -> str:
        """Key of the branch: the number at the end of the name, or the optional parameter that it is or belongs to."""
        number = self.name[len(self.stem) :]
        return number or self.belongs_to or (self.name if self.optional else "")

    @property
    def is_of_branch(self) -> bool:
        """Whether a diagnosis may add it to an effect that a model already has."""
        return self.optional and self.searched and not self.motions and not self.variant

    def admits(self, value: float) -> bool:
        """Whether ``value`` is a finite number within the bounds, and the index of a choice where there are choices."""
        if self.choices and value not in range(len(self.choices)):
            return False
        return math.isfinite(value) and self.lower <= value <= self.upper

    def bounds(self, shape: Shape | None) -> tuple[float, float]:
        """Return the lowest and the highest value that a specimen can have; that any can have if `shape` is None."""
        wall = None if shape is None or self.within is None else shape.wall
        if self.within is None or wall is None:
            return self.lower, self.upper
        most = self.within[1] * wall.size(self.within[0])
        return max(self.lower, -most), min(self.upper, most)

    def grid(self, scales: Mapping[str, float]) -> list[float]:
        """Return the values of `scan` in its unit, within the bounds.

        Parameters
        ----------
        scales : mapping of str to float
            Sizes of "duration" (s), "amplitude" (mm or rad) and "shear" (MPa) for the recordings and their rubber.
        """
        # A grid of stresses is meant for a rubber of about 1 MPa.
        factor = scales["shear"] if self.unit == "MPa" else scales[self.scale] if self.scale else 1.0
        return [float(np.clip(value * factor, self.lower, self.upper)) for value in self.scan]

    def fit_range(self, shape: Shape | None, period: float | None = None) -> tuple[float, float, float]:
        """Return start, lowest and highest value of a fit.

        Parameters
        ----------
        shape : Shape or None
            As for `bounds`.
        period : float or None
            s, of the highest frequency of the tables of dynamic stiffness that the effect changes; None without any.
        """
        low, high = self.bounds(shape)
        if self.in_tables is not None and period is not None:
            return self.in_tables[0] * period, max(low, self.in_tables[1] * period), high
        return self.start, max(low, self.in_curves), high

    def choice(self, value: float) -> str:
        """Return the word for a value of a parameter that is a choice."""
        return self.choices[round(value)]

    def distinct_choices(
        self, shape: Shape, acting: Collection[str], broken: Mirrors = frozenset()
    ) -> tuple[str, ...]:
        """Return the choices that differ in at least one of the modes `acting`; of two mirror images only the first.

        Parameters
        ----------
        shape : Shape
            Specimen, whose planes of symmetry count.
        acting : collection of str
            Names of modes.
        broken : Mirrors
            Planes of symmetry that other effects break.
        """
        planes = shape.mirror_planes - broken
        alike = all(modes()[name].is_symmetric_end_to_end(planes) for name in acting)
        images = {image for _, image in self.twins} if alike else set()
        return tuple(choice for choice in self.choices if choice not in images)


@dataclass(frozen=True)
class Amplitude(EffectParameter):
    """A parameter that switches an effect off with the value 0."""

    off: float = 0.0


@dataclass(frozen=True)
class Effect:
    """Physics that the plain model leaves out.

    Attributes
    ----------
    name : str
    title : str
        Its name in reports, as at the start of a sentence.
    of_a_person : bool
        Whether the title begins with the name of a person, which keeps its capital within a sentence.
    summary : str
        Its meaning in one sentence.
    acts : {"rubber", "assembly", "rig"}
    parameters : tuple of EffectParameter
        At least one amplitude. With all amplitudes off the response is the plain model's.
    how_often : {"usual", "occasional", "rare"}
        How many bushings on their rigs have it in a size that is visible beside the errors of the formulas; it sets
        the prior odds of a diagnosis.
    how_often_in_tables : {"usual", "occasional", "rare"}, optional
        The same for tables of dynamic stiffness; None if it is as often in them.
    families : tuple of str
        What it has in common with effects that recordings often cannot tell from it, in words.
    of_fillers : {"dissipation", "softening", "set"} or None
        Kind of behaviour that fillers give to rubber, which usually shows all three; None where fillers are not its
        cause.
    fades : bool
        Whether its force fades with time or is bounded at any displacement, so that one stiffness needs a choice of
        state.
    is_factor : bool
        Whether it multiplies the force by a factor that is the same at any displacement and time.
    in_force_law : {"curve", "maxwell", "clock", "sliders", "softening", "set", "warming"} or None
        Where the force law of an export contains an effect of the rubber: in its curves or in a state; None where it
        cannot. The feature of a "clock" has a clock as its first branch, and after it those that follow it. The first
        parameters of a "set" are the share of the largest displacements that stays and the cycles in which it grows,
        those of a "warming" are the share of the force that is lost and the time constant.
    on_card : callable, optional
        Returns what it adds to a material card, from the values of its parameters by name, or None if a card cannot
        hold it with these; None where no card can.
    needs : str
        Content that a recording must have for the effect to be identified.
    rivals : tuple of str
        Names of effects that give a similar curve in a recording without that content.
    source : str
        Reference with DOI.
    modes : frozenset of str, optional
        Modes on which it acts; None = every mode of its specimens.
    specimens : frozenset of str
        "bushing", "coupon".
    kinds : frozenset of {"static", "dynamic"}
        Kinds of channels on which it acts: recordings along a path, tables of dynamic stiffness.
    needs_sleeves : bool
        Whether it acts on two coaxial sleeves, which not every bushing has.
    adds_sleeves : bool
        Whether it replaces rigid sleeves by elastic ones, which cannot be meshed for every shape.
    rigid : tuple of (str, tuple of str)
        Sleeves that must not be elastic, by their key in the case file, each with the choices for which that holds;
        an empty tuple means all choices.
    has_memory : bool
        Whether the force depends on the past or on time, and not on the displacement alone.
    needs_time : bool
        Whether it has no meaning without the time of the recording or of the program.
    needs_temperature : bool
        Whether it has no meaning without the temperature of the channel.
    needs_amplitudes : bool
        Whether tables of dynamic stiffness show it at two amplitudes alone.
    needs_fixed_law : bool
        Whether a law that is identified from the same recordings can reproduce all that the effect does.
    needs_free_channel : bool
        Whether such a law can reproduce all that the effect does if every channel has the effect.
    may_be_shared : bool
        Whether all channels may share it, as a load frame, or one channel have its own, as a fixture.
    feature : callable, optional
        Returns its change of the finite-element model; it imports the finite-element stack only when called.
        Parameters that are choices are its arguments, by name and in words.
    rig : RigChange, optional
        Its change of the curve.
    shown : (str, mapping of str to float) or None
        Mode in which it shows and values large enough to be seen, for its picture in ``docs/effects.md``.
    """

    name: str
    title: str
    summary: str
    acts: Literal["rubber", "assembly", "rig"]
    parameters: tuple[EffectParameter, ...]
    needs: str
    rivals: tuple[str, ...]
    source: str
    how_often: Literal["usual", "occasional", "rare"] = "rare"
    how_often_in_tables: Literal["usual", "occasional", "rare"] | None = None
    families: tuple[str, ...] = ()
    of_fillers: Literal["dissipation", "softening", "set"] | None = None
    of_a_person: bool = False
    fades: bool = False
    is_factor: bool = False
    in_force_law: ForceLawPart | None = None
    on_card: Callable[[Mapping[str, float]], CardPart | None] | None = None
    modes: frozenset[str] | None = None
    specimens: frozenset[str] = frozenset({"bushing"})
    kinds: frozenset[Kind] = frozenset({"static", "dynamic"})
    needs_sleeves: bool = False
    adds_sleeves: bool = False
    rigid: tuple[tuple[str, tuple[str, ...]], ...] = ()
    has_memory: bool = False
    needs_time: bool = False
    needs_temperature: bool = False
    needs_amplitudes: bool = False
    needs_fixed_law: bool = False
    needs_free_channel: bool = False
    may_be_shared: bool = False
    feature: Callable[..., Feature] | None = None
    rig: RigChange | None = None
    shown: tuple[str, Mapping[str, float]] | None = field(default=None, hash=False)

    def parameter(self, name: str) -> EffectParameter:
        """Return the parameter called ``name``.

        Raises
        ------
        UnknownName
            When the effect has no such parameter.
        """
        return find_parameter(self.parameters, name, self.name)

    @property
    def branches(self) -> int:
        """Largest number of branches that a diagnosis tries: one, and those that it may add."""
        return 1 + len({p.branch for p in self.parameters if p.is_of_branch})

    @property
    def variants(self) -> tuple[EffectParameter, ...]:
        """Optional parameters with each of which, and without all of them, a diagnosis tries the effect."""
        return tuple(p for p in self.parameters if p.variant and p.searched)

    @property
    def slides(self) -> bool:
        """Whether its share of the force depends on the direction of motion, and not on time: it is in no stiffness."""
        return self.fades and not self.needs_time

    @property
    def of_channel(self) -> bool:
        """Whether it belongs to the rig of one channel: another channel may have it too, with other values."""
        return any(p.of_channel for p in self.parameters)

    @property
    def of_rig(self) -> bool:
        """Whether it may occur more than once, in the rigs of several channels."""
        return self.of_channel or self.may_be_shared

    @property
    def amplitudes(self) -> tuple[EffectParameter, ...]:
        """The parameters whose `off` values switch the effect off."""
        return tuple(p for p in self.parameters if p.off is not None)

    def differs_from_law(self, having: Collection[str], channels: Collection[str], law_held: bool) -> bool:
        """Whether the effect can change a curve in a way that a law fitted to the same recordings cannot.

        Parameters
        ----------
        having
            Names of the channels that have it.
        channels
            Names of all channels.
        law_held
            Whether the law is held to something else, such as coupons.
        """
        everywhere = set(channels) <= set(having)
        return law_held or not (self.needs_fixed_law or (self.needs_free_channel and everywhere))

    def acts_on(self, mode: str, kind: Kind | None = "static") -> bool:
        """Whether the effect acts on a mode in channels of a kind.

        Parameters
        ----------
        mode : str
        kind : Kind or None
            None for any.
        """
        mode_of_channel = modes()[mode]
        if kind is not None and kind not in self.kinds:
            return False
        if mode_of_channel.follow is not None and self.rig is not None:
            # A rig's effects act on one displacement and one force.
            return False
        return mode_of_channel.specimen in self.specimens and (self.modes is None or mode in self.modes)


def reasons_against(
    effect: Effect, shape: Shape, other_names: Collection[str] = (), values: Mapping[str, float] | None = None
) -> tuple[tuple[str, str], ...]:
    """Return why a specimen cannot have an effect, each reason with what would be valid; empty where it can.

    Parameters
    ----------
    effect : Effect
    shape : Shape
    other_names : collection of str
        Names of the other effects of the model.
    values : mapping of str to float or None
        Values of the effect's parameters by name, N, mm, MPa, s, rad, as far as they are known.
    """
    if shape.specimen != "bushing":
        return ()
    if effect.needs_sleeves and shape.wall is None:
        what = f"between the bonds of this {type(shape).name} there is no cylinder about the axis"
        return ((what, "use another shape, or leave this effect out"),)
    if effect.adds_sleeves and shape.with_sleeves(_SLEEVE, _SLEEVE) is None:
        what = f"sleeves cannot be added to a {type(shape).name}: it has only those that are drawn"
        expected = (
            "draw the sleeves as bodies in the section or the CAD file, with [geometry.plates.inner_sleeve]"
        )
        return ((what, expected),)
    start_values = values or {}
    sleeved = any(other.adds_sleeves for name, other in effects().items() if name in other_names)
    choices_made = {p.choice(start_values.get(p.name, p.start)) for p in effect.parameters if p.choices}
    reasons = [
        (f"the effect cannot be combined with an elastic {name}", "make it rigid")
        for name, choices in effect.rigid
        if (not choices or choices_made & set(choices)) and (name in shape.elastic_sleeves or sleeved)
    ]
    if effect.adds_sleeves and len(shape.elastic_sleeves) == 2:
        expected = "leave them out of [geometry], or change their youngs_modulus there"
        reasons.append(("both sleeves are elastic already", expected))
    return tuple(reasons)


@cache
def effects() -> Mapping[str, Effect]:
    """Return all effects found in ``bushcli/effects/library``, by name, in alphabetical order."""
    package = importlib.import_module("bushcli.effects.library")
    modules = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    library: list[Effect] = [importlib.import_module(f"{package.__name__}.{name}").EFFECT for name in modules]
    by_name = {}
    for effect in library:
        # The file of one of two rivals names the other: a new effect changes no other file.
        naming = {other.name for other in library if effect.name in other.rivals}
        by_name[effect.name] = replace(effect, rivals=tuple(sorted({*effect.rivals} | naming)))
    return MappingProxyType(by_name)


def effects_on(kind: Kind) -> dict[str, Effect]:
    """Return the effects that act on channels of a kind, by name."""
    return {name: effect for name, effect in effects().items() if kind in effect.kinds}


def effect_in_force_law(part: ForceLawPart) -> Effect:
    """Return the first effect that is a part of the force law of an export, such as the Maxwell branches."""
    return next(effect for effect in effects().values() if effect.in_force_law == part)


def effect(name: str) -> Effect:
    """Return the effect called ``name``, with or without the name of a rig.

    Raises
    ------
    UnknownName
        When there is no such effect; the message names the nearest.
    """
    if effect_name(name) not in effects():
        raise UnknownName(name, "effect", tuple(effects()))
    return effects()[effect_name(name)]
