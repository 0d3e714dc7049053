"""The force laws of a bushing's channels as data of an FMU, in the units of an order."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from bushcli.export.ascii import identifier
from bushcli.export.reduce import ReducedChannel, Sine
from bushcli.export.units import UnitSystem
from cases.mode import modes


@dataclass(frozen=True)
class BushingLaw:
    """The force laws of a bushing, one per channel, in N, mm, rad, s."""

    channels: tuple[ReducedChannel, ...]

    def summary(self) -> dict[str, Any]:
        """Return what the result reports: branches, sliders, and the errors against finite elements."""
        return {
            "channels": [
                {
                    "name": channel.name,
                    "mode": channel.mode,
                    "maxwell": [{"g": g, "tau": tau} for g, tau in channel.data["maxwell"]],
                    "sliders": len(channel.data["sliders"]),
                    "clocks": len(channel.data["clock"].get("classes", ())),
                    "softens": bool(channel.data["softening"]),
                    "set": channel.data["set"],
                    "set_cycles": channel.data["set_cycles"],
                    "warming": dict(zip(("amount", "tau"), channel.data["warming"], strict=False)),
                    "displacement_from": _in_file_units(channel, channel.data["displacement"][0]),
                    "displacement_to": _in_file_units(channel, channel.data["displacement"][-1]),
                    "rms_percent": channel.rms_percent,
                    "peak_percent": channel.peak_percent,
                    "vibrations": [_vibration(channel, sine) for sine in channel.sines],
                }
                for channel in self.channels
            ]
        }

    def data(self, name: str, title: str, units: UnitSystem) -> dict[str, Any]:
        """Return the data of an FMU."""
        length, moment = f"{units.length:.12g}", f"{units.force * units.length:.12g}"
        errors = "; ".join(f"{channel.name} {channel.rms_percent:.2g} % rms" for channel in self.channels)
        return {
            "name": name,
            "description": f"{title}: force law with memory, written by bushcli; "
            f"error against finite elements: {errors}",
            "units": {
                "length": units.length_name,
                "angle": "rad",
                "length_rate": f"{units.length_name}/s",
                "angle_rate": "rad/s",
                "force": units.force_name,
                "moment": f"{units.force_name}.{units.length_name}",
            },
            # Of each unit the exponents of SI's base units and its factor, as FMI requires them.
            "base_units": {
                units.length_name: {"m": "1", "factor": length},
                "rad": {"rad": "1"},
                f"{units.length_name}/s": {"m": "1", "s": "-1", "factor": length},
                "rad/s": {"rad": "1", "s": "-1"},
                units.force_name: {"kg": "1", "m": "1", "s": "-2", "factor": f"{units.force:.12g}"},
                f"{units.force_name}.{units.length_name}": {"kg": "1", "m": "2", "s": "-2", "factor": moment},
            },
            "channels": {
                identifier(channel.name, "channel"): _channel(channel, units) for channel in self.channels
            },
        }


def _vibration(channel: ReducedChannel, sine: Sine) -> dict[str, float]:
    stiffness, angle = sine.errors
    return {
        "amplitude": _in_file_units(channel, sine.amplitude),
        "frequency": sine.frequency,
        "stiffness": abs(sine.simulated),
        "loss_angle_deg": math.degrees(cmath.phase(sine.simulated)),
        "stiffness_error_percent": stiffness,
        "loss_angle_error_deg": angle,
    }


def _in_file_units(channel: ReducedChannel, q: float) -> float:
    return math.degrees(q) if modes()[channel.mode].rotational else q


def _channel(channel: ReducedChannel, units: UnitSystem) -> dict[str, Any]:
    """Return a channel's data in the units of the FMU, whose time is always in s."""
    rotational = modes()[channel.mode].rotational
    length = 1.0 if rotational else units.of_length(1.0)
    force = units.of_moment(1.0) if rotational else units.of_force(1.0)
    data = channel.data

    def scale(values: Any, factor: float) -> Any:
        return (factor * np.array(values)).tolist()

    clock, softening = dict(data["clock"]), dict(data["softening"])
    if clock:
        clock["classes"] = [
            {**part, "strain_slope": scale(part["strain_slope"], 1.0 / length)} for part in clock["classes"]
        ]
    if softening:
        softening["reached"] = scale(softening["reached"], length)
        softening |= {key: scale(softening[key], force) for key in ("lost", "lost_slope")}
    return {
        "rotational": rotational,
        "displacement": scale(data["displacement"], length),
        "force": scale(data["force"], force),
        "force_slope": scale(data["force_slope"], force / length),
        "elastic": scale(data["elastic"], force),
        "elastic_slope": scale(data["elastic_slope"], force / length),
        "maxwell": data["maxwell"],
        # A slider's stiffness multiplies the elastic force and has no unit; its limit is a force.
        "sliders": [[k, force * limit] for k, limit in data["sliders"]],
        "clock": clock,
        "softening": softening,
        "set": data["set"],
        "set_cycles": data["set_cycles"],
        "warming": data["warming"],
    }
