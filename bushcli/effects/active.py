"""Effects with values, on some of a case's channels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from bushcli.effects.names import in_rig
from bushcli.errors import InputError, Problem

if TYPE_CHECKING:
    from bushcli.effects.effect import Effect, EffectParameter, Kind


@dataclass(frozen=True)
class ActiveEffect:
    """An effect with values, on some channels.

    Attributes
    ----------
    effect : Effect
    values : mapping of str to float
        By parameter name, in N, mm, MPa, s, rad; parameters without a value have to be identified.
    channels : tuple of str, optional
        Names of the channels that have it; None = all that it acts on.
    rig : str
        A channel that distinguishes it from the same effect on other channels; empty for the first one.
    temperatures : mapping of str to float
        Degrees C of the channels whose temperature is known, for an effect that needs it.
    temperature : float or None
        Degrees C of the channel that it was taken for (`effects_on_channel`).
    """

    effect: Effect
    values: Mapping[str, float] = field(default_factory=dict)
    channels: tuple[str, ...] | None = None
    rig: str = ""
    temperatures: Mapping[str, float] = field(default_factory=dict)
    temperature: float | None = None

    @property
    def name(self) -> str:
        """Name of the effect; "offset@radial" if the same effect occurs in more than one rig."""
        return in_rig(self.effect.name, self.rig)

    @property
    def identity(self) -> str:
        """The effect's name with its rig, "offset@radial", whatever the other effects: models are compared by it."""
        return identity(self.effect, self.channels)

    def full_name(self, parameter: EffectParameter) -> str:
        """Return a parameter's name among those of the law and of all effects: "viscoelasticity.g1"."""
        return f"{self.name}.{parameter.name}"

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """The parameters that the model uses: all that are not optional, and all of a branch with a given value."""
        branches = {p.branch for p in self.effect.parameters if p.name in self.values}
        choices = (p for p in self.effect.parameters if p.choices)
        used = {"", *(p.choice(self.values.get(p.name, p.start)) for p in choices)}
        return tuple(
            p for p in self.effect.parameters if (not p.optional or p.branch in branches) and p.under in used
        )

    def with_values(self, parameters: Mapping[str, float]) -> ActiveEffect:
        """Return the effect with other values of its parameters; those that are not given keep theirs.

        Parameters
        ----------
        parameters : mapping of str to float
            By full name, in N, mm, MPa, s, rad; those of other effects are ignored.
        """
        values = {p.name: parameters.get(self.full_name(p), self.values[p.name]) for p in self.parameters}
        return replace(self, values=values)

    @property
    def variant(self) -> str:
        """What distinguishes it from the same effect in another model: "2 branches", "outer bottom"; often empty."""
        words = []
        if self.effect.branches > 1:
            count = len({p.branch for p in self.parameters} - {p.name for p in self.parameters})
            words += [f"{count} branches"] if count > 1 else []
        words += [f"with {p.name}" for p in self.parameters if p.branch == p.name]
        for p in self.parameters:
            if p.choices:
                words.append(p.choices[round(self.values[p.name])].replace("_", " "))
            elif p.of_mesh:
                words.append(f"{p.name} {self.values[p.name]:g} {p.unit}")
        return ", ".join(words)

    @property
    def is_off(self) -> bool:
        """Whether its amplitudes are off, so that it is as good as absent."""
        return all(self.values.get(p.name, p.off) == p.off for p in self.effect.amplitudes)

    @property
    def parameters_without_value(self) -> tuple[str, ...]:
        """Full names of the parameters that the model uses and that have no value."""
        return tuple(self.full_name(p) for p in self.parameters if p.name not in self.values)

    def acts_on(self, channel: str, mode: str, kind: Kind | None = "static") -> bool:
        """Whether the effect changes a channel.

        Parameters
        ----------
        channel, mode : str
            Names of the channel and of its mode.
        kind : {"static", "dynamic"} or None
            Kind of the channel; None where either counts.
        """
        return (self.channels is None or channel in self.channels) and self.effect.acts_on(mode, kind)

    def is_among(self, others: Iterable[ActiveEffect]) -> bool:
        """Whether one of several effects is the same on a common channel, so that a model cannot have both."""
        return any(
            other.effect.name == self.effect.name
            and (self.channels is None or other.channels is None or {*self.channels} & {*other.channels})
            for other in others
        )

    @property
    def can_branch(self) -> bool:
        """Whether the effect has optional parameters that this one is without."""
        return any(p.is_of_branch and p.name not in self.values for p in self.effect.parameters)

    def at(self, temperature: float | None) -> ActiveEffect:
        """Return the effect at a temperature, degrees C, if it depends on that."""
        return replace(self, temperature=temperature) if self.effect.needs_temperature else self

    def with_start_values(self, period: float | None = None) -> ActiveEffect:
        """Return the effect with start values for the parameters that have no value.

        Parameters
        ----------
        period : float or None
            s, of the highest frequency of the tables of dynamic stiffness that it changes; None without any.
        """
        starts = {p.name: p.fit_range(None, period)[0] for p in self.parameters}
        return replace(self, values={name: self.values.get(name, start) for name, start in starts.items()})

    def off(self) -> ActiveEffect:
        """Return the effect with its amplitudes off; shape parameters keep their values or get their start values."""
        values = {p.name: p.off for p in self.parameters if p.off is not None}
        return replace(self, values=dict(self.with_start_values().values) | values)


def identity(effect: Effect, channels: tuple[str, ...] | None) -> str:
    """Return the name by which models are compared: "gain@radial" of an effect of a rig, else the effect's own name."""
    return in_rig(effect.name, channels[0]) if effect.of_rig and channels else effect.name


def uniquely_named(active: Sequence[ActiveEffect]) -> tuple[ActiveEffect, ...]:
    """Return the effects with unique names: if an effect occurs more than once, all but the first are named by rig."""
    names: set[str] = set()
    rigs: dict[int, str] = {}
    for effect in sorted(active, key=lambda effect: effect.channels or ()):
        rigs[id(effect)] = (effect.channels or ("",))[0] if effect.effect.name in names else ""
        names.add(effect.effect.name)
    return tuple(
        effect if effect.rig == rigs[id(effect)] else replace(effect, rig=rigs[id(effect)])
        for effect in active
    )


def effects_on_channel(
    active: Sequence[ActiveEffect],
    channel: str,
    mode: str,
    kind: Kind = "static",
    temperature: float | None = None,
) -> tuple[ActiveEffect, ...]:
    """Return the effects that change a channel, at its temperature.

    Parameters
    ----------
    active : sequence of ActiveEffect
    channel, mode : str
        Names of the channel and of its mode.
    kind : {"static", "dynamic"}
    temperature : float or None
        Degrees C, in place of the channel's.
    """
    return tuple(
        effect.at(effect.temperatures.get(channel) if temperature is None else temperature)
        for effect in active
        if effect.acts_on(channel, mode, kind)
    )


def require_values(active: Sequence[ActiveEffect], where: str) -> None:
    """Refuse effects that have a parameter without a value: only a fit can find it.

    Parameters
    ----------
    active : sequence of ActiveEffect
    where : str
        Name of the case file, for the message.

    Raises
    ------
    InputError
    """
    remedy = "give every parameter of the effect a value; only a fit can start without one"
    problems = [
        Problem(where, f"effects.{name} is not given", "", remedy)
        for effect in active
        for name in effect.parameters_without_value
    ]
    if problems:
        raise InputError(*problems)


def require_time(active: Sequence[ActiveEffect], channel: str, mode: str, where: str) -> None:
    """Refuse a channel without time if one of its effects needs time.

    Parameters
    ----------
    active : sequence of ActiveEffect
    channel, mode : str
        Names of the channel and of its mode.
    where : str
        File of the recording or case file, for the message.

    Raises
    ------
    InputError
    """
    remedy = "add a column with the time in s, or leave this channel out of the effect's channels = [...]"
    problems = [
        Problem(where, f"has no time, which the effect {effect.name} needs", "", remedy)
        for effect in effects_on_channel(active, channel, mode)
        if effect.effect.needs_time
    ]
    if problems:
        raise InputError(*problems)


#: Relaxation time, s, so long that nothing relaxes in a simulation of some seconds; a spectrum's shortest time may be
#: twelve decades below the one that is its parameter.
NEVER = 1e18


def in_state(effects: Iterable[ActiveEffect], unrelaxed: bool) -> tuple[ActiveEffect, ...]:
    """Return the effects in one state: that after a long rest, or that in a sudden step.

    After a long rest viscoelasticity is absent; in a sudden step its branches do not relax. Friction, whose
    share of the force depends on the direction of motion, is absent in both.

    Parameters
    ----------
    effects : iterable of ActiveEffect
        All with values.
    unrelaxed : bool
        Whether the state is that in a sudden step.
    """
    states = []
    for active in effects:
        if not active.effect.fades:
            states.append(active)
        elif unrelaxed and not active.effect.slides:
            # All times grow by one factor: what a clock gains by motion, over the relaxation times, is the same.
            times = {p.name: active.values[p.name] for p in active.parameters if p.unit == "s"}
            factor = NEVER / min((time for time in times.values() if time > 0.0), default=1.0)
            slowed = {name: factor * time for name, time in times.items()}
            slowed |= {
                p.name: active.values[p.name] * factor ** -active.values[p.per_time]
                for p in active.parameters
                if p.per_time in active.values
            }
            states.append(replace(active, values={**active.values, **slowed}))
    return tuple(states)


def state_in_words(effects: Iterable[ActiveEffect], unrelaxed: bool) -> str:
    """Return in words which state `in_state` has and what is left out; empty where no effect fades.

    Parameters
    ----------
    effects : iterable of ActiveEffect
    unrelaxed : bool
        As in `in_state`.
    """
    fading = [active.effect for active in effects if active.effect.fades]
    excluded = [effect.name for effect in fading if not unrelaxed or effect.slides]
    without = f"without {' and '.join(sorted(excluded, reverse=True))}" if excluded else ""
    if unrelaxed and len(excluded) < len(fading):
        return "unrelaxed force: as in a sudden step" + (f", {without}" if without else "")
    return f"fully relaxed force: {without}" if without else ""
