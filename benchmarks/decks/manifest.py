"""A deck's manifest: all numbers that were drawn for each recording, so that later code cannot change the deck.

``make`` computes the data from the manifest alone. The digest of each data file, and some of its values, show whether
data made elsewhere are the same.
"""

from __future__ import annotations

import fcntl
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from benchmarks.concealed.truth import Specimen

Kind = Literal["none", "single", "pair", "outside"]
Part = Literal["own", "foreign", "nothing"]

# Standard errors, to first order, below which an effect cannot be seen and "nothing" is also a right answer.
HIDDEN = 3.0
FOLDER = Path(__file__).parent / "manifests"
DECKS = ("own", "foreign", "nothing", "dev", "poor", "second", "third", "fourth", "fifth")


@dataclass(frozen=True)
class Sensor:
    """Changes of the exact curve by a channel's rig and logger.

    Attributes
    ----------
    calibration : float
        Factor on the force.
    noise, correlation : float
        Standard deviation of the force's noise, percent of the exact range, and its correlation from one sample to
        the next.
    travel_noise : float
        Standard deviation of the displacement's noise over the amplitude.
    spikes : mapping
        `share` of the samples, and `size` in percent of the range. Empty = none, here and below.
    quantum : float
        Step of the logged force, percent of the range; 0 = none.
    hum : mapping
        Sine on the force: `size` (percent of the range), `period` (s), `phase` (rad).
    lost : float
        Share of the samples that are missing.
    drift : float
        Shift of the force's zero at the end, percent of the range, in proportion to time.
    seed : tuple of int
        Seed of noise, spikes and lost samples.
    """

    calibration: float
    noise: float
    correlation: float
    travel_noise: float
    seed: tuple[int, ...]
    spikes: Mapping[str, float] = field(default_factory=dict)
    quantum: float = 0.0
    hum: Mapping[str, float] = field(default_factory=dict)
    lost: float = 0.0
    drift: float = 0.0

    @property
    def faults(self) -> frozenset[str]:
        """Names of the data's faults, as in a result where it has one."""
        present = {"spikes": self.spikes, "quantised": self.quantum, "hum": self.hum, "lost": self.lost}
        return frozenset(name for name, there in present.items() if there)


@dataclass(frozen=True)
class Program:
    """Path of a channel: legs (end over amplitude, pace) as in `concealed.programs.Leg`.

    Attributes
    ----------
    mode : str
        Also the channel's name.
    legs : tuple of (float, float)
    slow : float
        Seconds of a slow leg from rest to the amplitude.
    samples : int
        Approximate number of samples.
    """

    mode: str
    legs: tuple[tuple[float, float], ...]
    slow: float
    samples: int


@dataclass(frozen=True)
class Entry:
    """A recording.

    Attributes
    ----------
    name : str
        Name of its folder, which reveals nothing.
    part : {"own", "foreign", "nothing"}
        Source of the formulas.
    kind : {"none", "single", "pair", "outside"}
    program : str
        Program of the first channel: "rich", "ramp" or "loop".
    seed : tuple of int
        Seed with which it was drawn.
    specimen : Specimen
        The true one.
    programs : tuple of Program
    sensors : tuple of Sensor
        By channel, in the order of the programs.
    coupons : bool
        Whether there are coupon tests, which fix the law.
    effects : mapping
        Effects by the catalogue's formulas: name -> parameter -> value, in N, mm, MPa, s, rad.
    formulas : tuple of mapping
        Other formulas: `name` and its values.
    said : mapping
        Dimensions that the case file states instead of the true ones.
    truth : tuple of str
        Names of the catalogue that are right.
    also_right : tuple of tuple of str
        Sets that are physically the same.
    outside : bool
        Whether the truth is not in the catalogue of the day on which the deck was drawn.
    where : mapping
        For physics outside the catalogue: where a right answer puts the misfit.
    share : float
        Percent of the recorded range (rms) by which the physics changes the curves beyond what the law's parameters, to
        first order, and the calibration factors can imitate.
    strength : mapping
        The same change in standard errors, by effect.
    look_alikes : tuple of str, optional
        Other single effects of the catalogue that these recordings cannot distinguish; None = not judged yet.
    mesh : float
        Standard errors by which the default mesh is off.
    digest : mapping
        File -> sha256 of its rounded values; `sketch` contains some of the values.
    """

    name: str
    part: Part
    kind: Kind
    program: str
    seed: tuple[int, ...]
    specimen: Specimen
    programs: tuple[Program, ...]
    sensors: tuple[Sensor, ...]
    coupons: bool = False
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    formulas: tuple[Mapping[str, Any], ...] = ()
    said: Mapping[str, float] = field(default_factory=dict)
    truth: tuple[str, ...] = ()
    also_right: tuple[tuple[str, ...], ...] = ()
    outside: bool = False
    where: Mapping[str, Any] = field(default_factory=dict)
    share: float = 0.0
    strength: Mapping[str, float] = field(default_factory=dict)
    look_alikes: tuple[str, ...] | None = None
    mesh: float = 0.0
    digest: Mapping[str, Any] = field(default_factory=dict)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels, which are their modes."""
        return tuple(p.mode for p in self.programs)

    @property
    def rich(self) -> bool:
        """Whether the program is rich."""
        return self.program == "rich"

    @property
    def faults(self) -> frozenset[str]:
        """Names of the data faults of all channels."""
        return frozenset().union(*(sensor.faults for sensor in self.sensors))

    @property
    def right(self) -> frozenset[frozenset[str]]:
        """Sets of effect names that are right, also without those effects that these recordings do not show."""
        sets = [frozenset(names) for names in (self.truth, *self.also_right)]
        hidden = frozenset(name for name in self.truth if self.strength_by_effect.get(name, HIDDEN) < HIDDEN)
        return frozenset(sets + [names - hidden for names in sets])

    @property
    def strength_by_effect(self) -> Mapping[str, float]:
        """Standard errors by the catalogue's names; a foreign formula's count for each effect that it stands for."""
        if self.part == "own":
            return self.strength
        most = max(self.strength.values(), default=0.0)
        return dict.fromkeys(self.truth, most) if self.strength else {}

    @property
    def tellable(self) -> bool:
        """Whether these recordings can distinguish the truth from every other single effect."""
        return self.rich and self.look_alikes == ()


def file_of(deck: str, folder: Path = FOLDER) -> Path:
    """Path of the manifest of a deck."""
    return folder / f"{deck}.json"


def read(deck: str, folder: Path = FOLDER) -> dict[str, Entry]:
    """Recordings of a deck by name; empty if it has not been drawn."""
    file = file_of(deck, folder)
    if not file.exists():
        return {}
    return {
        recording.name: recording
        for recording in map(entry, json.loads(file.read_text("utf-8"))["recordings"])
    }


def write(deck: str, entries: Mapping[str, Entry], folder: Path = FOLDER) -> None:
    """Write a manifest, whole or not at all."""
    data = {"deck": deck, "recordings": [asdict(entries[name]) for name in sorted(entries)]}
    text = json.dumps(data, indent=1)
    # Lists of numbers stand on one line, so that differences between manifests are easy to read.
    text = re.sub(r"\[[^][{}]*\]", lambda m: " ".join(m.group().split()), text)
    file = file_of(deck, folder)
    part = file.with_suffix(".part")
    part.write_text(text + "\n", encoding="utf-8")
    part.replace(file)


def put(deck: str, recording: Entry, folder: Path = FOLDER) -> None:
    """Put a recording into a manifest, keeping those that other processes have added."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f".{deck}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        write(deck, {**read(deck, folder), recording.name: recording}, folder)


def entry(data: Mapping[str, Any]) -> Entry:
    """A recording from JSON."""
    given = dict(data)
    given["specimen"] = Specimen(**given["specimen"])
    given["programs"] = tuple(
        Program(**p | {"legs": tuple((float(to), float(pace)) for to, pace in p["legs"])})
        for p in given["programs"]
    )
    given["sensors"] = tuple(Sensor(**s | {"seed": tuple(s["seed"])}) for s in given["sensors"])
    for key in ("seed", "truth", "formulas"):
        given[key] = tuple(given[key])
    given["also_right"] = tuple(tuple(names) for names in given["also_right"])
    if given["look_alikes"] is not None:
        given["look_alikes"] = tuple(given["look_alikes"])
    return Entry(**given)
