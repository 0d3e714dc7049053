"""A deck's manifest: every number that was drawn of every recording, so that no later code can deal it again.

``make`` computes the data from the manifest alone. The digest of each data file, and some of its values, say whether
what was made elsewhere is the same.
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

# Standard errors, to first order, below which nobody can see an effect, and nothing is a right answer too.
HIDDEN = 3.0
FOLDER = Path(__file__).parent / "manifests"
DECKS = ("own", "foreign", "nothing", "dev")


@dataclass(frozen=True)
class Sensor:
    """What a channel's rig and logger do to the exact curve.

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
        Of some samples: `share`, and `size` in percent of the range. Empty = none; so are the others.
    quantum : float
        Step of the logged force, percent of the range; 0 = none.
    hum : mapping
        Sine on the force: `size` (percent of the range), `period` (s), `phase` (rad).
    lost : float
        Share of the samples that are not there.
    drift : float
        Zero of the force at the end, percent of the range, in proportion to time.
    seed : tuple of int
        Of noise, spikes and lost samples.
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
        """Names of what is wrong with the data, by the contract's names where it has one."""
        found = {"spikes": self.spikes, "quantised": self.quantum, "hum": self.hum, "lost": self.lost}
        return frozenset(name for name, there in found.items() if there)


@dataclass(frozen=True)
class Program:
    """What a channel's rig does: ways (end over amplitude, pace) as `concealed.programs.Leg`.

    Attributes
    ----------
    mode : str
        Also the channel's name.
    legs : tuple of (float, float)
    slow : float
        Seconds of a slow way from rest to the amplitude.
    samples : int
        Nearly.
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
        Of its folder, which says nothing.
    part : {"own", "foreign", "nothing"}
        By whose formulas it is made.
    kind : {"none", "single", "pair", "outside"}
    program : str
        Of the first channel: "rich", "ramp" or "loop".
    seed : tuple of int
        It was drawn with.
    specimen : Specimen
        The true one.
    programs : tuple of Program
    sensors : tuple of Sensor
        By channel, as the programs.
    coupons : bool
        Whether there are coupon tests, which hold the law.
    effects : mapping
        Of the catalogue's formulas: name -> parameter -> value, in N, mm, MPa, s, rad.
    formulas : tuple of mapping
        Of others: `name` and what it needs.
    said : mapping
        Dimensions that the case file states in place of the true ones.
    truth : tuple of str
        Names of the catalogue that are right.
    also_right : tuple of tuple of str
        Sets that are physically the same.
    outside : bool
        Whether the truth is in no catalogue of the day the deck was drawn.
    where : mapping
        Of what is outside: where a right answer puts the misfit.
    share : float
        Percent of the recorded range (rms) by which the physics changes the curves beside what the law's parameters,
        to first order, and the calibration factors can do.
    strength : mapping
        Standard errors of the same, by effect.
    look_alikes : tuple of str, optional
        Other single effects of the catalogue that cannot be told from these recordings; None = not judged yet.
    mesh : float
        Standard errors by which the default mesh is off.
    digest : mapping
        File -> sha256 of its rounded values; `sketch` some of them.
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
        """Whether the program tells much."""
        return self.program == "rich"

    @property
    def faults(self) -> frozenset[str]:
        """Names of what is wrong with the data of any channel."""
        return frozenset().union(*(sensor.faults for sensor in self.sensors))

    @property
    def right(self) -> frozenset[frozenset[str]]:
        """Sets of effect names that are right; also without an effect that these recordings do not show."""
        sets = [frozenset(names) for names in (self.truth, *self.also_right)]
        hidden = frozenset(name for name in self.truth if self.shown.get(name, HIDDEN) < HIDDEN)
        return frozenset(sets + [names - hidden for names in sets])

    @property
    def shown(self) -> Mapping[str, float]:
        """Standard errors by the catalogue's names: those of a foreign formula go to all effects that it is."""
        if self.part == "own":
            return self.strength
        most = max(self.strength.values(), default=0.0)
        return dict.fromkeys(self.truth, most) if self.strength else {}

    @property
    def tellable(self) -> bool:
        """Whether these recordings can tell the truth from every other single effect."""
        return self.rich and self.look_alikes == ()


def file_of(deck: str, folder: Path = FOLDER) -> Path:
    """The manifest of a deck."""
    return folder / f"{deck}.json"


def read(deck: str, folder: Path = FOLDER) -> dict[str, Entry]:
    """Recordings of a deck by name; none where it is not drawn."""
    file = file_of(deck, folder)
    if not file.exists():
        return {}
    return {one.name: one for one in map(entry, json.loads(file.read_text("utf-8"))["recordings"])}


def write(deck: str, entries: Mapping[str, Entry], folder: Path = FOLDER) -> None:
    """Write a manifest, whole or not at all."""
    data = {"deck": deck, "recordings": [asdict(entries[name]) for name in sorted(entries)]}
    text = json.dumps(data, indent=1)
    # Lists of numbers in one line: a difference between two manifests is then one recording's.
    text = re.sub(r"\[[^][{}]*\]", lambda m: " ".join(m.group().split()), text)
    file = file_of(deck, folder)
    part = file.with_suffix(".part")
    part.write_text(text + "\n", encoding="utf-8")
    part.replace(file)


def put(deck: str, found: Entry, folder: Path = FOLDER) -> None:
    """Put a recording into a manifest, beside what other processes put there meanwhile."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f".{deck}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        write(deck, {**read(deck, folder), found.name: found}, folder)


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
