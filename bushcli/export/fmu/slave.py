"""Common parts of the FMUs of both versions: variables of each channel, and a step in time.

`build` joins `force_law`, this file and the slave's file into one script, so that two FMUs in a program do not share
modules.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from typing import Any

from bushcli.export.fmu.force_law import ChannelForceLaw, ForceLaw

#: The force law, which `build` inserts. A file beside the script would be lost if a program loads the FMU again from
#: another folder while Python still has the module.
DATA = ""


class Variables:
    """The variables of a bushing and the step in time; the slaves of FMI 2 and 3 add what each version requires.

    Each channel has the inputs ``NAME_displacement`` and ``NAME_velocity``, the output ``NAME_force`` or
    ``NAME_moment``, and the state. A step from t to t + h goes to the displacement at t plus h times the velocity; a
    master that gives no velocity gets the force one step late.
    """

    def load(self) -> None:
        """Read the force law, and set all variables to rest."""
        self.data = json.loads(DATA)
        self.law = ForceLaw(self.data)
        for name in self.law.channels:
            setattr(self, f"{name}_displacement", 0.0)
            setattr(self, f"{name}_velocity", 0.0)

    def variables(
        self, number: Any, causality: Any, initial: Any, variability: Any, with_units: bool
    ) -> Iterator[Any]:
        """Yield all variables, in the library's type of a number and its words, with units if it takes them."""
        for name, unit, text in self.inputs():
            units = {"unit": unit} if with_units else {}
            yield number(name, causality=causality.input, description=text, start=0.0, **units)
        for name, unit, text, channel in self.outputs():
            options = {"causality": causality.output, "description": text, "initial": initial.calculated}
            units = {"unit": unit} if with_units else {}
            yield number(name, getter=partial(getattr, channel, "force"), **options, **units)
        for name, channel, place in self.states():
            options = {"causality": causality.local, "variability": variability.continuous}
            get, put = partial(channel.value, place), partial(channel.put, place)
            yield number(name, getter=get, setter=put, **options)

    def inputs(self) -> list[tuple[str, str, str]]:
        """Return name, unit and description of each input."""
        units = self.data["units"]
        return [
            (f"{name}_{what}", units[f"{kind}{ending}"], f"{what} of the inner sleeve, {name}")
            for name, kind in self._kinds()
            for what, ending in (("displacement", ""), ("velocity", "_rate"))
        ]

    def outputs(self) -> list[tuple[str, str, str, ChannelForceLaw]]:
        """Return name, unit, description and channel of each output."""
        units = self.data["units"]
        return [
            (f"{name}_{what}", units[what], f"{what} on the inner sleeve, {name}", self.law.channels[name])
            for name, kind in self._kinds()
            for what in ("moment" if kind == "angle" else "force",)
        ]

    def states(self) -> list[tuple[str, ChannelForceLaw, int]]:
        """Return name, channel and index of each state; index -1 is the present displacement."""
        return [
            (f"{name}_state_{i + 1}", channel, i)
            for name, channel in self.law.channels.items()
            for i in range(-1, len(channel.state))
        ]

    def advance(self, step_size: float) -> None:
        """Move every channel to its displacement at the end of the step."""
        for name, channel in self.law.channels.items():
            q = getattr(self, f"{name}_displacement") + step_size * getattr(self, f"{name}_velocity")
            channel.advance(q, step_size)

    def initialise(self) -> None:
        """Start at rest at the given displacement, with relaxed branches."""
        for name, channel in self.law.channels.items():
            channel.initialise(getattr(self, f"{name}_displacement"))

    def _kinds(self) -> list[tuple[str, str]]:
        return [
            (name, "angle" if channel["rotational"] else "length")
            for name, channel in self.data["channels"].items()
        ]
