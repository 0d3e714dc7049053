"""Checks whether a recording can be that of rubber: wrong units, exchanged columns, exchanged channels.

The stiffness that was recorded while the specimen moved and the closed forms of `bushcli.faults.scale` give a shear
modulus. How common moduli are gives the probability that a column was read in another unit, or as the other quantity: a
modulus that rubber hardly has, beside one that most rubber has with that reading. It is a fault without doubt where two
statements contradict each other: another channel of the same rubber, the size of the specimen, or the strength of the
rubber and its bond. However soft a specimen is, nothing contradicts it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bushcli.case.typical import SHEAR, SHEAR_WORDS
from bushcli.faults.fault import MENTIONED, WRONG, WRONG_UNWRITTEN, DataFault, Mask, chance_in_words
from bushcli.faults.signal import moving_samples, slope
from bushcli.recording import Recording
from bushcli.recording.header.units import find_unit
from bushcli.recording.source import UNITS, FaultKind, Quantity, dimension
from cases.mode import modes
from geometry.shape import Shape

# Least stiffness with voids over that without: voids may take most of the rubber out of the load's path
# (judgement).
_VOIDED = 0.2


def unit_stiffness(shape: Shape, mode: str) -> tuple[float, float] | None:
    """Return bounds of the stiffness over the shear modulus, mm (mm^3 in a rotation); None without a closed form.

    Parameters
    ----------
    shape : Shape
    mode : str
    """
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
# Factor by which a compliant rig, voids, a stop or a loop may change the modulus that a bushing appears to have.
_FEIGNED = 3.0
# Range of the recorded travel over the rubber's thickness (axial, radial), of the rotation in rad and of the strain of
# a coupon.
_TRAVEL = {"length": (1e-3, 5.0), "angle": (2e-3, math.pi), "strain": (2e-3, 12.0)}
_REFERENCE = {"length": "the rubber's thickness", "angle": "a radian", "strain": "the specimen's length"}
#: A typical value of it; judgement.
USUAL = 0.3
# Travel beyond which the unit is wrong whatever the stiffness is: a bushing 10 mm thick is not tested over
# 0.01 mm.
_IMPOSSIBLE = {"length": (1e-3, 30.0), "angle": (1e-6, 2.0 * math.pi), "strain": (1e-6, 100.0)}
# MPa: shear modulus times strain, the stress that a recorded force implies, in a bond or a coupon that holds.
# Engineering judgement: the strongest vulcanisates break at about 30 in tension; in 382 channels of decks at most 1.3.
# The nominal stress of a coupon is three times as much (uniaxial) or more; no elastomer bears 300.
_STRENGTH = {"length": 30.0, "angle": 30.0, "strain": 100.0}
# Lengths in which a geometry is drawn by mistake, mm.
_DRAWN = {"cm": 10.0, "inches": 25.4}
# Intervals of the moduli of two channels of one bushing are further apart than this factor only if one of the
# units is wrong (degrees and radians differ by a factor of 57); the right unit brings them within the second
# factor.
_APART, _TOGETHER = 8.0, 2.0
# Two channels count as exchanged if their moduli are at least the first factor apart as recorded, and at most
# the second when exchanged.
_EXCHANGED, _AGREE = 3.0, 1.3
# Probability from which a wrong unit is mentioned where the file writes none and rubber has no such modulus: writing it
# costs little. Judgement.
_ASKED = 0.25
# Density, over the logarithm, of moduli that are wrong in a way which no unit explains: judgement, as common as a wrong
# unit, by up to ten decades either way.
_UNEXPLAINED = WRONG / (20.0 * math.log(10.0))
# Largest probability of a fault that nothing contradicts.
_SURE = 1.0 - 1e-9


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

    @property
    def is_travel_of_test(self) -> bool:
        """Whether its travel is that of a test."""
        low, high = _TRAVEL[self.kind]
        return low <= self.travel <= high

    @property
    def is_plausible(self) -> bool:
        """Whether most rubber may have its moduli, and a test its travel."""
        low, high = self.modulus
        return high >= _RUBBER[0] and low <= _RUBBER[1] and self.is_travel_of_test

    def times(self, displacement: float, force: float) -> _Scale:
        """What it is with displacement and force times a factor each."""
        low, high = (value * force / displacement for value in self.stiffness)
        return replace(self, stiffness=(low, high), travel=self.travel * displacement)

    @property
    def with_columns_exchanged(self) -> _Scale:
        """What it is with the columns exchanged: that of the force in the default unit of a displacement."""
        low, high = self.stiffness
        unit = UNITS[self.kind]["deg" if self.kind == "angle" else "mm"]
        thickness = float(np.abs(self.recording.displacement).max()) / self.travel
        travel = float(np.abs(self.recording.force).max()) * unit / thickness
        return replace(self, stiffness=(1.0 / high / unit**2, 1.0 / low / unit**2), travel=travel)

    @property
    def span(self) -> str:
        """Its shear moduli with their unit."""
        low, high = self.modulus
        least, most = (f"{value:.2g}" if value < 99.5 else f"{value:.0f}" for value in self.modulus)
        return f"{least} MPa" if high < 1.05 * low else f"{least} to {most} MPa"

    @property
    def moduli(self) -> str:
        """Its shear moduli in words."""
        return f"the {self.recording.name} stiffness implies a shear modulus of {self.span}"

    @property
    def way(self) -> str:
        """Its largest displacement in words."""
        times = f"{self.travel:.2g}" if self.travel < 10 else f"{self.travel:.0f}"
        return f"a travel of {times} times {_REFERENCE[self.kind]}"


@dataclass(frozen=True)
class _Reading:
    """Another reading of a recording: its scale then, the remedy in words, and a penalty if the mistake is rare.

    A reading `of_geometry` is one of the lengths in the case, written as the factors that have the same result.
    ``columns`` are those that are in another unit.
    """

    scale: _Scale
    words: str
    rare: float = 0.0
    kind: FaultKind = "unit"
    of_geometry: bool = False
    columns: tuple[Quantity, ...] = ()


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
        if (fault := _misread(scale, rest)) is not None:
            yield fault


def _dimension(recording: Recording, quantity: Quantity) -> str:
    mode = modes()[recording.mode]
    return dimension(quantity, mode.specimen, mode.rotational)


def _apart(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Return the ratio between two intervals of moduli; 1 where they overlap."""
    return max(first[0] / second[1], second[0] / first[1], 1.0)


def _misread(scale: _Scale, rest: Sequence[_Scale]) -> DataFault | None:
    """Return the fault of a column in another unit, or of the other quantity, by the moduli of the same rubber."""
    low, high = scale.modulus
    lowest, largest = _IMPOSSIBLE[scale.kind]
    middle = math.sqrt(low * high)
    contradicted = (
        bool(rest)
        and not _RUBBER[0] <= middle <= _RUBBER[1]
        and all(_apart(scale.modulus, other.modulus) >= _APART for other in rest)
    )
    torn = low * scale.travel > _STRENGTH[scale.kind]
    proved = contradicted or torn or not lowest <= scale.travel <= largest
    feigned = 1.0 if scale.kind == "strain" else _FEIGNED
    readings = list(_readings(scale))
    assumed = {column.quantity for column in scale.recording.columns if column.assumed} - {"time"}
    priors = [
        (WRONG_UNWRITTEN if assumed.intersection(reading.columns) else WRONG) * 10.0**-reading.rare
        for reading in readings
    ]
    whole = sum(10.0**-reading.rare for reading in readings)
    wrong, best, least = 0.0, None, math.inf
    for reading, prior in zip(readings, priors, strict=True):
        changed = reading.scale.modulus
        if not reading.scale.is_travel_of_test or any(
            _apart(changed, other.modulus) > _TOGETHER for other in rest
        ):
            continue
        wrong += prior / whole * _frequency(changed[0] / feigned, changed[1] * feigned)
        # Of several suitable readings, take the one to the most typical rubber and travel.
        typical = math.sqrt(changed[0] * changed[1])
        unusual = reading.rare + abs(math.log10(typical)) + abs(math.log10(reading.scale.travel / USUAL))
        if unusual < least and SHEAR[0] <= typical <= SHEAR[1]:
            best, least = reading, unusual
    right = (1.0 - sum(priors) / whole) * _frequency(low / feigned, high * feigned)
    if best is None:
        probability = min(_UNEXPLAINED / (_UNEXPLAINED + right), _SURE)
        return _unexplained(scale, rest if contradicted else (), torn, probability)
    probability = 1.0 if proved else min(wrong / (wrong + right), _SURE)
    asked = bool(assumed) and (low > SHEAR[1] or high < SHEAR[0])
    if probability < (_ASKED if asked else MENTIONED):
        return None
    where = f"{scale.moduli} at {scale.way}; {SHEAR_WORDS}, "
    means = "displacement and force exchanged" if best.kind == "swapped" else "another unit"
    where += f"and with {means} it would be {best.scale.span}"
    if assumed and not proved:
        where += f"; the file writes no unit of the {' and the '.join(sorted(assumed))}"
    if not proved:
        where += f"; the probability that it was read wrongly is {chance_in_words(probability)}"
    sized = best.kind == "unit" and scale.kind != "strain" and not best.of_geometry
    remedy = f"{best.words}; also check that [geometry] is in mm" if sized else best.words
    return DataFault(
        scale.recording.name,
        best.kind,
        where,
        f'{remedy}; or accept = ["{best.kind}"] if the values are right',
        proved,
        probability=probability,
    )


def _unexplained(
    scale: _Scale, contradicting: Sequence[_Scale], torn: bool, probability: float
) -> DataFault | None:
    """Return the fault of a recording that is wrong in every unit; None if it is a probable one of an elastomer.

    It contradicts other ones, or the rubber's strength; or hardly an elastomer is like it, with the probability.
    """
    against = f" at {scale.way}, which no rubber bears" if torn else ""
    if contradicting and not torn:
        other = min(contradicting, key=lambda each: _apart(scale.modulus, each.modulus))
        against = f" and {other.moduli}"
    fatal = bool(against)
    if not fatal and probability < MENTIONED:
        return None
    where = f"{scale.moduli}{against or f'; {SHEAR_WORDS}'}: no single wrong unit explains it"
    if not fatal:
        where += f"; the probability that it was read wrongly is {chance_in_words(probability)}"
    remedy = (
        'check columns, units and mode, and the lengths in [geometry]; or accept = ["unit"] if all are right'
    )
    return DataFault(
        scale.recording.name, "unit", where, remedy, fatal, probability=1.0 if fatal else probability
    )


def _frequency(low: float, high: float) -> float:
    """Return the density, over the logarithm, of shear moduli (MPa), on average over an interval."""
    logarithm = np.linspace(math.log(low), math.log(high), 17)
    density = sum(
        share / spread * np.exp(-0.5 * ((logarithm - math.log(median)) / spread) ** 2)
        for share, median, spread in _ELASTOMERS
    )
    return float(np.mean(density))


def _readings(scale: _Scale) -> Iterator[_Reading]:
    """Yield the readings with another unit, or both in SI units, and with the columns exchanged."""
    recording, displacement = scale.recording, scale.kind
    force = _dimension(recording, "force")
    way = {"length": "displacement", "angle": "rotation"}.get(displacement, displacement)
    read = recording.units
    common = {"m", "um", "rad", "deg", "mm", "percent", "kN", "N", "Nm", "Nmm", "MPa", "kPa", "Pa"}
    for name, factor, rare in _others(displacement, read[0], common):
        words = f'if the {way} is in {name}: units = {{ displacement = "{name}" }}'
        yield _Reading(scale.times(factor, 1.0), words, rare, columns=("displacement",))
    for name, factor, rare in _others(force, read[1], common):
        words = f'if the {force} is in {name}: units = {{ force = "{name}" }}'
        yield _Reading(scale.times(1.0, factor), words, rare, columns=("force",))
    si = {"length": ("m", "kN"), "angle": ("rad", "Nm")}.get(displacement)
    if si is not None and all(read):
        factors = [
            UNITS[kind][new] / _factor(kind, old)
            for kind, new, old in zip((displacement, force), si, read, strict=True)
        ]
        if 1.0 not in factors:
            words = f'units = {{ displacement = "{si[0]}", force = "{si[1]}" }}'
            words = f"if the file is in {si[0]} and {si[1]}: {words}"
            yield _Reading(scale.times(*factors), words, 0.2, columns=("displacement", "force"))
    if displacement == "length":
        for unit, mm in _DRAWN.items():
            # Stiffness per modulus grows with the lengths, travel per thickness falls with them.
            words = f"if [geometry] is in {unit}: give its lengths in mm, {mm:g} times as large"
            yield _Reading(scale.times(1.0 / mm, 1.0 / mm**2), words, 0.4, of_geometry=True)
    for factor in (1e-3, 1e3):
        off, word = ("small", "multiply") if factor > 1 else ("large", "divide")
        remedy = f"is a thousand times too {off}: {word} its column by 1000"
        yield _Reading(scale.times(1.0, factor), f"if the {force} {remedy}", 0.4, columns=("force",))
        yield _Reading(scale.times(factor, 1.0), f"if the {way} {remedy}", 0.4, columns=("displacement",))
    if displacement != "strain":
        words = (
            "name the columns in the table of this recording: columns = { displacement = ..., force = ... }"
        )
        yield _Reading(scale.with_columns_exchanged, words, 0.4, "swapped")


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
