"""Common parts of the FMUs of both versions: variables of each channel, and a step in time.

This file and `force_law` are put before the slave's own lines in one script, so that two FMUs in a program do not
share modules.
"""

from __future__ import annotations

import json

from bushcli.export.fmu.force_law import Channel, ForceLaw

#: The force law; `build` puts it in. A file beside the script would be lost where a program loads the FMU once more
#: from another folder while Python still knows the module.
DATA = ""


class Variables:
    """The variables of a bushing and what a step does; the slaves of FMI 2 and 3 add the standard's own.

    Of each channel: the inputs ``NAME_displacement`` and ``NAME_velocity``, the output ``NAME_force`` or
    ``NAME_moment``, and the state. A step from t to t + h goes to the displacement at t plus h times the velocity; a
    master that gives no velocity meets the force one step late.
    """

    def load(self) -> None:
        """Read the force law, and set all variables to rest."""
        self.data = json.loads(DATA)
        self.law = ForceLaw(self.data)
        for name in self.law.channels:
            setattr(self, f"{name}_displacement", 0.0)
            setattr(self, f"{name}_velocity", 0.0)

    def inputs(self) -> list[tuple[str, str, str]]:
        """Return name, unit and description of each input."""
        units = self.data["units"]
        return [
            (f"{name}_{what}", units[f"{kind}{ending}"], f"{what} of the inner sleeve, {name}")
            for name, kind in self._kinds()
            for what, ending in (("displacement", ""), ("velocity", "_rate"))
        ]

    def outputs(self) -> list[tuple[str, str, str, Channel]]:
        """Return name, unit, description and channel of each output."""
        units = self.data["units"]
        return [
            (f"{name}_{what}", units[what], f"{what} on the inner sleeve, {name}", self.law.channels[name])
            for name, kind in self._kinds()
            for what in ("moment" if kind == "angle" else "force",)
        ]

    def states(self) -> list[tuple[str, Channel, int]]:
        """Return name, channel and place of each state; place -1 is the displacement that was reached."""
        return [
            (f"{name}_state_{i + 1}", channel, i)
            for name, channel in self.law.channels.items()
            for i in range(-1, len(channel.state))
        ]

    def advance(self, step_size: float) -> None:
        """Move every channel to where it is at the end of the step."""
        for name, channel in self.law.channels.items():
            q = getattr(self, f"{name}_displacement") + step_size * getattr(self, f"{name}_velocity")
            channel.advance(q, step_size)

    def begin(self) -> None:
        """Start at rest, at the displacement that is given: the branches have relaxed there."""
        for name, channel in self.law.channels.items():
            channel.begin(getattr(self, f"{name}_displacement"))

    def _kinds(self) -> list[tuple[str, str]]:
        return [
            (name, "angle" if one["rotational"] else "length") for name, one in self.data["channels"].items()
        ]


def reader(channel: Channel, place: int):  # type: ignore[no-untyped-def]  # both versions take any callable
    """Return a function that reads a state.

    Parameters
    ----------
    channel : Channel
        Whose state it is.
    place : int
        As in `Variables.states`.
    """
    return lambda: channel.q if place < 0 else channel.state[place]


def setter(channel: Channel, place: int):  # type: ignore[no-untyped-def]
    """Return a function that sets a state.

    Parameters
    ----------
    channel : Channel
        Whose state it is.
    place : int
        As in `Variables.states`.
    """

    def put(value: float) -> None:
        if place < 0:
            channel.q = value
        else:
            channel.state[place] = value

    return put
