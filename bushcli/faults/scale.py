"""Checks whether a recording can be that of rubber: wrong units, exchanged columns, exchanged channels.

The stiffness that was recorded while the specimen moved and the closed forms of `bushcli.faults.scale` give a shear
modulus. How common moduli are gives the probability that a column was read in another unit: a modulus that rubber
hardly has, beside one that most rubber has with that unit. It is a fault without doubt where two statements contradict
each other: another channel of the same rubber, the size of the specimen, the strength of its bond, or the range of all
elastomers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bushcli.case.typical import SHEAR, SHEAR_WORDS
from bushcli.faults.fault import MENTIONED, WRONG, DataFault, Mask
from bushcli.faults.signal import moving_samples, slope
from bushcli.recording import Recording
from bushcli.recording.header.units import find_unit
from bushcli.recording.source import UNITS, Quantity, dimension
from cases.mode import modes
from geometry.shape import Shape

# Least stiffness with voids over that without: voids may take most of the rubber out of the load's path
# (judgement).
_VOIDED = 0.2


def unit_stiffness(shape: Shape, mode: str) -> tuple[float, float] | None:
    """Return bounds of the stiffness over the shear modulus."""
    kind, annulus = modes()[mode], shape.annulus
    if kind.specimen == "coupon":
        return None if kind.unit_slope is None else (kind.unit_slope, kind.unit_slope)
    if annulus is None or kind.unit_stiffness is None:
        return None
    low, _ = kind.unit_stiffness(annulus.inner_radius, annulus.outer_radius, annulus.shortest)
    _, high = kind.unit_stiffness(annulus.inner_radius, annulus.outer_radius, annulus.longest)
    return low * (1.0 if annulus.whole else _VOIDED), high


Array = NDArray[np.float64]

# MPa: shear moduli of the rubber of most bushings.
_RUBBER = (0.1, 10.0)
# Share of elastomers, median (MPa) and standard deviation of the logarithm of their shear modulus: rubber of 30 to 90
# Shore A has 0.4 to 7 MPa (Gent 1958, `bushcli.case.typical`), within two standard deviations here; gels, silicones,
# acrylics and foams have 0.01 to 1. Judgement: one specimen of ten is of these.
_ELASTOMERS = ((0.9, 1.0, 0.8), (0.1, 0.1, 1.0))
# Factor by which a compliant rig, voids, a stop or a loop may change the modulus that a bushing appears to have, and
# beyond which a modulus is outside the range of elastomers without doubt.
_FEIGNED = 3.0
# Range of the recorded travel over the rubber's thickness (axial, radial), of the rotation in rad and of the strain of
# a coupon; and a typical value.
_TRAVEL = {"length": (1e-3, 5.0), "angle": (2e-3, math.pi), "strain": (2e-3, 12.0)}
_REFERENCE = {"length": "the rubber's thickness", "angle": "a radian", "strain": "the specimen's length"}
_USUAL = 0.3
# Travel beyond which the unit is wrong whatever the stiffness is: a bushing 10 mm thick is not tested over
# 0.01 mm.
_IMPOSSIBLE = {"length": (1e-3, 30.0), "angle": (1e-6, 2.0 * math.pi), "strain": (1e-6, 100.0)}
# MPa: shear modulus times shear strain, the stress that a recorded force implies, in a bond that holds. Engineering
# judgement: the strongest vulcanisates break at about as much in tension; in 382 channels of decks at most 1.3.
_STRENGTH = 30.0
# Lengths in which a geometry is drawn by mistake, mm.
_DRAWN = {"cm": 10.0, "inches": 25.4}
# Intervals of the moduli of two channels of one bushing are further apart than this factor only if one of the
# units is wrong (degrees and radians differ by a factor of 57); the right unit brings them within the second
# factor.
_APART, _TOGETHER = 8.0, 2.0
# Two channels count as exchanged if their moduli are at least the first factor apart as recorded, and at most
# the second when exchanged.
_EXCHANGED, _AGREE = 3.0, 1.3


@dataclass(frozen=True)
class _Scale:
    """The range of shear moduli that the recording of a channel implies.

    ``stiffness`` (least, largest) in N/mm, N mm/rad or MPa over the whole recording and at rest; ``unit`` (least,
    largest) for a shear modulus of 1 MPa; ``travel`` in the terms of `_TRAVEL`.
    """

    recording: Recording
    stiffness: tuple[float, float]
    unit: tuple[float, float]
    travel: float

    @staticmethod
    def of(shape: Shape, recording: Recording, bad: Mask) -> _Scale | None:
        """Return that of a recording; None where no closed form or no motion gives it."""
        unit = unit_stiffness(shape, recording.mode)
        used = ~bad & moving_samples(recording)
        q, force = recording.displacement[used], recording.force[used]
        if unit is None or len(q) < 3 or np.ptp(q) == 0:
            return None
        # A recording caches its stiffness at rest, which a study requests for every design.
        curve = recording if used.all() else Recording(recording.mode, q, force)
        stiffnesses = [slope(q, force), curve.secant_stiffness(), curve.initial_stiffness()]
        size = [abs(value) for value in stiffnesses if math.isfinite(value) and value != 0]
        if not size:
            return None
        travel = float(np.abs(q).max())
        if shape.annulus is not None and _dimension(recording, "displacement") == "length":
            travel /= shape.annulus.thickness
        # A slope at rest that differs tenfold from the rest of the curve is free play, a stop, or noise.
        near = [value for value in size if 0.1 * size[0] <= value <= 10.0 * size[0]]
        return _Scale(recording, (min(near), max(near)), unit, travel)

    @property
    def modulus(self) -> tuple[float, float]:
        """Least and largest shear modulus, MPa."""
        return self.stiffness[0] / self.unit[1], self.stiffness[1] / self.unit[0]

    @property
    def kind(self) -> str:
        """Quantity of the displacement: "length", "angle" or "strain"."""
        return _dimension(self.recording, "displacement")

    def is_travel_of_test(self, factor: float = 1.0) -> bool:
        """Whether its travel, times a factor, is that of a test."""
        low, high = _TRAVEL[self.kind]
        return low <= self.travel * factor <= high

    @property
    def is_plausible(self) -> bool:
        """Whether most rubber may have its moduli, and a test its travel."""
        low, high = self.modulus
        return high >= _RUBBER[0] and low <= _RUBBER[1] and self.is_travel_of_test()

    @property
    def with_columns_exchanged(self) -> _Scale:
        """What it is with the columns exchanged: that of the force in the default unit of a displacement."""
        low, high = self.stiffness
        unit = UNITS[self.kind]["deg" if self.kind == "angle" else "mm"]
        thickness = float(np.abs(self.recording.displacement).max()) / self.travel
        travel = float(np.abs(self.recording.force).max()) * unit / thickness
        return replace(self, stiffness=(1.0 / high / unit**2, 1.0 / low / unit**2), travel=travel)

    @property
    def moduli(self) -> str:
        """Its shear moduli in words."""
        low, high = self.modulus
        least, most = (f"{value:.2g}" if value < 99.5 else f"{value:.0f}" for value in self.modulus)
        span = least if high < 1.05 * low else f"{least} to {most}"
        return f"the {self.recording.name} stiffness implies a shear modulus of {span} MPa"

    @property
    def way(self) -> str:
        """Its largest displacement in words."""
        times = f"{self.travel:.2g}" if self.travel < 10 else f"{self.travel:.0f}"
        return f"a travel of {times} times {_REFERENCE[self.kind]}"


@dataclass(frozen=True)
class _Change:
    """A change of unit: factors on displacement and force, words for its remedy, and a penalty if it is rare.

    A change `of_geometry` is one of the lengths in the case, written as the factors that have the same result.
    """

    displacement: float
    force: float
    words: str
    rare: float = 0.0
    of_geometry: bool = False


def scales(shape: Shape, recordings: Sequence[Recording], bad: Sequence[Mask]) -> Iterator[DataFault]:
    """Yield a fault for each exchanged pair of channels and for each column that was read in the wrong unit."""
    known_scales = [
        scale
        for recording, mask in zip(recordings, bad, strict=True)
        if (scale := _Scale.of(shape, recording, mask)) is not None
    ]
    swapped_names: set[str] = set()
    for scale, other in combinations(known_scales, 2):
        # Two channels of one kind that contradict each other as they are, and agree when exchanged.
        this, that = (modes()[each.recording.mode] for each in (scale, other))
        swapped = (
            (scale.stiffness[0] / other.unit[1], scale.stiffness[1] / other.unit[0]),
            (other.stiffness[0] / scale.unit[1], other.stiffness[1] / scale.unit[0]),
        )
        if (
            this.name != that.name
            and "coupon" not in (this.specimen, that.specimen)
            and this.rotational == that.rotational
            and all(low <= _RUBBER[1] and high >= _RUBBER[0] for low, high in swapped)
            and _apart(scale.modulus, other.modulus) >= _EXCHANGED
            and _apart(*swapped) <= _AGREE
            and not {scale.recording.name, other.recording.name} & swapped_names
        ):
            swapped_names |= {scale.recording.name, other.recording.name}
            for recorded, contained in ((scale, other), (other, scale)):
                yield DataFault(
                    recorded.recording.name,
                    "swapped",
                    f"{scale.moduli} and {other.moduli}; with the two exchanged they agree: channel "
                    f'"{recorded.recording.name}" contains the data of "{contained.recording.name}"',
                    "exchange the file names (or the columns) of the two [[recordings]]",
                    True,
                )
    for scale in known_scales:
        if scale.recording.name in swapped_names:
            continue
        rest = [
            other
            for other in known_scales
            if other is not scale and other.recording.name not in swapped_names and other.is_plausible
        ]
        possible = _IMPOSSIBLE[scale.kind][0] <= scale.travel <= _IMPOSSIBLE[scale.kind][1]
        if (
            scale.kind != "strain"
            and not possible
            and not scale.is_plausible
            and scale.with_columns_exchanged.is_plausible
        ):
            yield DataFault(
                scale.recording.name,
                "swapped",
                f"{scale.moduli}, and {scale.way}: displacement and force are read from each other's column",
                "name the columns in the table of this recording: columns = { displacement = ..., force = ... }",
                True,
            )
        elif (fault := _unit(scale, rest)) is not None:
            yield fault


def _dimension(recording: Recording, quantity: Quantity) -> str:
    mode = modes()[recording.mode]
    return dimension(quantity, mode.specimen, mode.rotational)


def _apart(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Return the ratio between two intervals of moduli; 1 where they overlap."""
    return max(first[0] / second[1], second[0] / first[1], 1.0)


def _unit(scale: _Scale, rest: Sequence[_Scale]) -> DataFault | None:
    """Return the fault of a column in another unit, if a change of unit gives the modulus of rubber."""
    low, high = scale.modulus
    lowest, largest = _IMPOSSIBLE[scale.kind]
    middle = math.sqrt(low * high)
    contradicted = (
        bool(rest)
        and not _RUBBER[0] <= middle <= _RUBBER[1]
        and all(_apart(scale.modulus, other.modulus) >= _APART for other in rest)
    )
    torn = scale.kind == "length" and low * scale.travel > _STRENGTH
    feigned = 1.0 if scale.kind == "strain" else _FEIGNED
    outside = low > _FEIGNED * SHEAR[1] or _FEIGNED * high < SHEAR[0]
    proved = outside or contradicted or torn or not lowest <= scale.travel <= largest
    changes = list(_changes(scale.recording))
    prior = WRONG / sum(10.0**-change.rare for change in changes)
    wrong, best, least = 0.0, None, math.inf
    for change in changes:
        factor = change.force / change.displacement
        changed = low * factor, high * factor
        if not scale.is_travel_of_test(change.displacement):
            continue
        if any(_apart(changed, other.modulus) > _TOGETHER for other in rest):
            continue
        wrong += prior * 10.0**-change.rare * _frequency(changed[0] / feigned, changed[1] * feigned)
        # Of several suitable changes, take the one to the most typical rubber and travel.
        unusual = abs(math.log10(middle * factor)) + abs(
            math.log10(scale.travel * change.displacement / _USUAL)
        )
        if unusual + change.rare < least and SHEAR[0] <= middle * factor <= SHEAR[1]:
            best, least = change, unusual + change.rare
    if best is None:
        return None
    right = (1.0 - WRONG) * _frequency(low / feigned, high * feigned)
    probability = 1.0 if proved else wrong / (wrong + right)
    if probability < MENTIONED:
        return None
    certain = "" if proved else f"; the probability of a wrong unit is {100.0 * probability:.0f} %"
    sized = scale.kind != "strain" and not best.of_geometry
    remedy = f"{best.words}; also check that [geometry] is in mm" if sized else best.words
    return DataFault(
        scale.recording.name,
        "unit",
        f"{scale.moduli} at {scale.way}; {SHEAR_WORDS}, and with another unit it would be "
        f"{middle * best.force / best.displacement:.2g} MPa{certain}",
        f'{remedy}; or accept = ["unit"] if the values are right',
        proved,
        probability=probability,
    )


def _frequency(low: float, high: float) -> float:
    """Return the density, over the logarithm, of the most common shear modulus within an interval (MPa)."""
    return max(
        sum(
            share / spread * math.exp(-0.5 * (math.log(modulus / median) / spread) ** 2)
            for share, median, spread in _ELASTOMERS
        )
        for modulus in np.geomspace(low, high, 9)
    )


def _changes(recording: Recording) -> Iterator[_Change]:
    """Yield the changes of one unit, or of both to SI units, that the user may have forgotten."""
    displacement, force = (_dimension(recording, quantity) for quantity in ("displacement", "force"))
    way = {"length": "displacement", "angle": "rotation"}.get(displacement, displacement)
    read = recording.units
    common = {"m", "um", "rad", "deg", "mm", "percent", "kN", "N", "Nm", "Nmm", "MPa", "kPa", "Pa"}
    yield from (
        _Change(factor, 1.0, f'if the {way} is in {name}: units = {{ displacement = "{name}" }}', rare)
        for name, factor, rare in _others(displacement, read[0], common)
    )
    yield from (
        _Change(1.0, factor, f'if the {force} is in {name}: units = {{ force = "{name}" }}', rare)
        for name, factor, rare in _others(force, read[1], common)
    )
    si = {"length": ("m", "kN"), "angle": ("rad", "Nm")}.get(displacement)
    if si is not None and all(read):
        factors = [
            UNITS[kind][new] / _factor(kind, old)
            for kind, new, old in zip((displacement, force), si, read, strict=True)
        ]
        if 1.0 not in factors:
            words = f'units = {{ displacement = "{si[0]}", force = "{si[1]}" }}'
            yield _Change(factors[0], factors[1], f"if the file is in {si[0]} and {si[1]}: {words}", 0.2)
    if displacement == "length":
        for unit, mm in _DRAWN.items():
            # Stiffness per modulus grows with the lengths, travel per thickness falls with them.
            words = f"if [geometry] is in {unit}: give its lengths in mm, {mm:g} times as large"
            yield _Change(1.0 / mm, 1.0 / mm**2, words, 0.4, of_geometry=True)
    for factor in (1e-3, 1e3):
        off, word = ("small", "multiply") if factor > 1 else ("large", "divide")
        remedy = f"is a thousand times too {off}: {word} its column by 1000"
        yield _Change(1.0, factor, f"if the {force} {remedy}", 0.4)
        yield _Change(factor, 1.0, f"if the {way} {remedy}", 0.4)


def _others(kind: str, read: str, common: set[str]) -> Iterator[tuple[str, float, float]]:
    """Yield name, factor and a penalty for rarity of the units of a kind other than the one that was read."""
    if not read:
        return
    for name, size in UNITS[kind].items():
        factor = size / _factor(kind, read)
        if factor != 1.0:
            yield name, factor, 0.0 if name in common else 0.6


def _factor(kind: str, name: str) -> float:
    """Return the factor from a unit that a column was read in to the internal unit."""
    unit = find_unit(name, kind)
    assert unit is not None, name
    return unit.factor
