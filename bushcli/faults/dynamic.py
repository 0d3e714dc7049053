"""Faults of a table of dynamic stiffness: a wrong unit, rows that belong to no curve, sweeps at the same temperature.

Whether a file has the loss angle or 90 degrees minus it follows with some probability from how the stiffness rises with
frequency.

The other rows of its own curve predict a row (`off_curve`). How much a step of temperature changes stiffness and loss
varies smoothly from step to step, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import count_of
from bushcli.faults.fault import MENTIONED, WRONG, DataFault, chance_in_words
from bushcli.faults.scale import unit_stiffness
from bushcli.recording.dynamic.table import DynamicTable
from cases.mode import modes
from geometry.shape import Shape

Array = NDArray[np.float64]

#: MPa: the shear modulus of the glass that each elastomer is at low temperature; none is stiffer.
_GLASS = 3000.0
#: Median and standard deviation of the logarithm (judgement): of the least dynamic shear modulus of a curve (MPa), from
#: which gels, and filled compounds at low temperature, are three standard deviations away; of the loss angle of rubber
#: (rad), from natural rubber without fillers to butyl; of amplitudes and preloads over the rubber's thickness, or as
#: strains.
_MODULUS, _LOSS_ANGLE, _AMPLITUDE, _PRELOAD = (2.0, 1.6), (0.1, 0.9), (0.003, 1.8), (0.1, 1.2)
#: Largest difference of chi square that counts: the odds of a reading change by no more than e^20, and no probability
#: is 0 or 1.
_CERTAIN = 40.0
#: Columns whose unit is that of the stiffness, and units that are in use.
_SIZES = ("stiffness", "storage", "loss", "damping")
_UNITS = (
    *("N/mm", "kN/mm", "N/m", "kN/m", "MN/m", "Nm/rad", "Nmm/rad", "kNm/rad", "Nm/deg", "Nmm/deg", "kNm/deg"),
    *(
        "Nm",
        "Nmm",
        "kNm",
        "MPa",
        "kPa",
        "Pa",
        "GPa",
        "N s/mm",
        "N s/m",
        "kN s/mm",
        "kN s/m",
        "Nms/rad",
        "Nmms/rad",
    ),
)
#: The change of stiffness per kelvin in a step of temperature lies within this factor of the geometric mean of those in
#: the steps beside it: between glass and rubber it changes fivefold from one step of 20 K to the next.
_STEADY = 15.0
#: Change of ln K* per kelvin and radian of the angle at the glass transition: 2 / pi of ln 10 C1 / C2 with the
#: universal constants (Williams, Landel and Ferry 1955, doi:10.1021/ja01619a008).
_FASTEST = 2.0 / np.pi * np.log(10.0) * 17.44 / 51.6
#: Sweeps at two temperatures that differ by less are the same.
_SAME = 0.03
#: Rows after a larger amplitude are softer than those before it where the mean of at least so many is beyond so many of
#: its standard errors and more than a servo-hydraulic rig's usual scatter (judgement). One maximum of the sweep is no
#: other than a plateau within this factor.
_AFTER, _SURE, _SOFTER, _LARGER = 3, 4.0, 0.01, 1.2
#: So many losses of exactly zero are not rounded where others, and their angles, differ by less than this (rad): no
#: rubber's angle is so small, and the rig's software shows none below zero. Judgement.
_CLIPPED, _FINE = 3, np.radians(0.05)
#: Error of pi/2 d ln |K*| / d ln f as the loss angle: rubber, rigs with a mass or a lag (rad; judgement). At least so
#: many frequencies, over this factor, give it.
_RISE, _FREQUENCIES, _WIDE = np.radians(8.0), 5, 4.0


def table_faults(shape: Shape, tables: Sequence[DynamicTable]) -> tuple[DataFault, ...]:
    """Return the faults of tables, the fatal ones first.

    Parameters
    ----------
    shape : Shape
        The bushing, which determines how stiff its rubber makes it.
    tables : sequence of DynamicTable
    """
    faults: list[DataFault] = []
    for table in tables:
        # It loads SciPy's special functions: only where there is a table.
        from bushcli.faults.off_curve import rows_off_curve

        off_curve = rows_off_curve(table)
        candidates = [*_unit(shape, table, off_curve), *_travel(shape, table)]
        if off_curve.any():
            first, count = int(np.argmax(off_curve)), int(off_curve.sum()) - 1
            where = f"{table.places[first]}: |K*| = {table.stiffness[first]:.4g} is off its curve"
            other = _belongs(table, first)
            where += f" and lies on that at {other}" if other else ""
            where += f", and {count} more row{'s are' if count > 1 else ' is'} off, too" if count else ""
            remedy = "correct the conditions of the row, or delete it; fits leave it out"
            candidates.append(DataFault(table.name, "spikes", where, remedy, False, off_curve))
        clipped = list(_clipped(table))
        candidates += [*_order(table, off_curve), *_temperatures(table, off_curve), *clipped]
        if not clipped and (table.loss_angle >= 0.0).all():
            # Neither complements of angles nor tangents are below zero.
            candidates += _angle(table, off_curve)
        faults += [fault for fault in candidates if fault.kind not in table.accepted_faults]
    return tuple(sorted(faults, key=lambda fault: not fault.fatal))


def _angle(table: DynamicTable, off_curve: NDArray[np.bool_]) -> Iterator[DataFault]:
    """Yield a fault if the loss angles suit rubber, and the rise of the stiffness, better in another reading.

    What is linear and causal has a loss angle of about pi/2 d ln |K*| / d ln f (Booij and Thoone 1982,
    doi:10.1007/BF01535664). The error of that is one for all rows of a table, the median of which counts.
    """
    seen, expected = [], []
    for rows in table.conditions() if table.over_frequency else ():
        rows = rows[~off_curve[rows]]
        x = np.log(table.frequency[rows])
        if len(np.unique(x)) >= _FREQUENCIES and np.ptp(x) > np.log(_WIDE):
            expected.append(0.5 * np.pi * np.polyfit(x, np.log(table.stiffness[rows]), 1)[0])
            seen.append(float(np.mean(table.loss_angle[rows])))
    if not seen:
        return
    delta, rise = float(np.median(seen)), float(np.median(expected))
    angles = np.array([delta, 0.5 * np.pi - delta, np.degrees(delta)])
    possible = (angles > 0.0) & (angles < 0.5 * np.pi)
    median, spread = _LOSS_ANGLE
    unusual = np.log(np.where(possible, angles, 1.0) / median) / spread
    misfit = np.where(possible, ((angles - rise) / _RISE) ** 2 + unusual**2, np.inf)
    probability, best = _misread(misfit)
    if probability < MENTIONED:
        return
    shown, slope, other = np.degrees([delta, rise, angles[best]])
    where = f"loss angles of {shown:.3g} degrees on average, where the rise of the stiffness with frequency means "
    where += f"about {max(slope, 0.0):.2g}: with a probability of {chance_in_words(probability)} the loss angles are "
    if best == 1:
        where += f"90 degrees minus those of the file, {other:.3g}"
        remedy = 'loss_angle_is = "complement" in the recording\'s table, or "loss" if it has "complement"'
    else:
        where += f"in radians, or their tangents, which means {other:.3g} degrees"
        remedy = 'units = {loss_angle = "rad"} in the recording\'s table, or columns = {tan_delta = ...}'
    remedy += '; if the file is read as it was measured, accept = ["loss_angle"]'
    none = np.zeros(len(table), dtype=bool)
    yield DataFault(table.name, "loss_angle", where, remedy, False, none, probability)


def _clipped(table: DynamicTable) -> Iterator[DataFault]:
    """Yield a fault if loss angles below zero are shown as zero, which says nothing of how late the force is."""
    zero = table.loss_angle == 0.0
    if np.count_nonzero(zero) < _CLIPPED or zero.all():
        return
    # The file has one of the two, and the other follows from it with all digits.
    for values in (table.loss_angle, table.loss / np.median(table.stiffness)):
        if np.diff(np.unique(np.round(values, 9))).min() > _FINE:
            return
    low, high = table.frequency[zero].min(), table.frequency[zero].max()
    where = f"the loss angle is exactly 0 in {zero.sum()} rows, from {low:.3g} to {high:.3g} Hz: the rig shows no "
    where += "negative one, which a force that is logged late has there"
    remedy = 'export the phase with its sign; fits leave these rows out, accept = ["clipped"] uses them'
    yield DataFault(table.name, "clipped", where, remedy, False, zero)


def _misread(chi_square: Array) -> tuple[float, int]:
    """Return the probability that numbers mean something else than read, and which other reading is the best.

    However clear, it is an opinion: the numbers contradict no other statement. Chi square (readings,) begins with that
    of the numbers as read.
    """
    prior = np.r_[1.0 - WRONG, np.full(len(chi_square) - 1, WRONG / (len(chi_square) - 1))]
    weight = prior * np.exp(-0.5 * np.minimum(chi_square - chi_square.min(), _CERTAIN))
    return float(1.0 - weight[0] / weight.sum()), 1 + int(np.argmax(weight[1:]))


def _factor(value: float, usual: tuple[float, float], factors: Sequence[float]) -> tuple[float, float]:
    """Return the probability that a value is wrong by one of some factors, and the most probable of them."""
    median, spread = usual
    unusual = np.log(value * np.array([1.0, *factors]) / median) / spread
    probability, best = _misread(unusual**2)
    return probability, factors[best - 1]


def _travel(shape: Shape, table: DynamicTable) -> Iterator[DataFault]:
    """Yield a fault if another unit makes amplitudes or preloads usual that are rare as read."""
    mode = modes()[table.mode]
    if mode.specimen == "coupon":
        reference = 1.0
    elif shape.wall is not None:
        reference = mode.per_shear(shape.wall)
    else:
        return
    unit = "" if mode.specimen == "coupon" else "rad" if mode.rotational else "mm"
    amplitudes, preload = table.amplitude[~np.isnan(table.amplitude)], np.abs(table.preload)
    largest = float(np.nanmax(preload)) if not np.isnan(preload).all() else 0.0
    typical = float(np.exp(np.mean(np.log(amplitudes)))) if len(amplitudes) else 0.0
    # A preload may be as small as one likes.
    for key, value, usual, factors in (
        ("amplitude", typical, _AMPLITUDE, (1e3, 1e-3)),
        ("preload", largest, _PRELOAD, (1e-3,)),
    ):
        if value == 0.0:
            continue
        probability, factor = _factor(value / reference, usual, factors)
        if probability >= MENTIONED:
            word = "typical amplitude" if key == "amplitude" else "largest preload"
            where = (
                f"a {word} of {value:.3g} {unit}".rstrip()
                + f" is a strain of {100 * value / reference:.2g} %"
            )
            where += (
                f"; the probability that it is {factor:g} times as large is {chance_in_words(probability)}"
            )
            remedy = (
                f"check its unit: units = {{{key} = ...}} in the recording's table, and [geometry] in mm; "
            )
            remedy += 'or accept = ["unit"] if the values are right'
            none = np.zeros(len(table), dtype=bool)
            yield DataFault(table.name, "unit", where, remedy, False, none, probability)


def _unit(shape: Shape, table: DynamicTable, off_curve: NDArray[np.bool_]) -> Iterator[DataFault]:
    """Yield a fault if another unit makes moduli usual that are rare as read; of no polymer, for certain."""
    bounds = {"E": (3.0, 3.0), "G": (1.0, 1.0)}.get(table.quantity) or unit_stiffness(shape, table.mode)
    if bounds is None:
        return
    # The logarithm of a modulus lies between those of the two bounds of the stiffness.
    size, modulus = table.stiffness, table.stiffness / np.sqrt(bounds[0] * bounds[1])
    readings = [_factor(value, _MODULUS, (1e3, 1e-3, 1e6, 1e-6)) for value in modulus]
    chances = np.array([chance for chance, _ in readings])
    misread = ~off_curve & (chances >= MENTIONED) & (modulus < _MODULUS[0])
    # A compound may be a glass in some of the rows, not in all of them.
    if not misread.any() and (modulus[~off_curve] > _MODULUS[0]).all():
        misread = ~off_curve & (chances[~off_curve].min() >= MENTIONED)
    if not misread.any():
        return
    probability, factor = readings[int(np.argmin(np.where(misread, chances, 1.0)))]
    low, high = float(size[misread].min()), float(size[misread].max())
    proved = bool(low / bounds[1] > _GLASS)
    unit = (
        "MPa" if table.quantity != "stiffness" else "N mm/rad" if modes()[table.mode].rotational else "N/mm"
    )
    at = np.flatnonzero(misread)
    partly = not (misread | off_curve).all()
    where = f"{table.places[at[0]]} to {table.places[at[-1]]}, {count_of(len(at), 'row')}: " if partly else ""
    where += f"{low:.3g} to {high:.3g} {unit}: a shear modulus of {low / bounds[1]:.2g} to {high / bounds[0]:.2g} MPa, "
    where += "which no polymer has" if proved else "which is rare"
    where += f"; times {factor:g} it would be {factor * low:.3g} to {factor * high:.3g} {unit}"
    where += "" if proved else f"; the probability of a wrong unit is {chance_in_words(probability)}"
    if partly:
        remedy = "correct these rows, or delete them; fits leave them out"
    else:
        remedy = f"if its numbers are in another unit: {_other_units(table, factor)} in the recording's table"
        remedy += "; also check that [geometry] is in mm" if table.quantity == "stiffness" else ""
    remedy += '; or accept = ["unit"] if the values are right'
    samples = misread & (partly or proved)
    yield DataFault(table.name, "unit", where, remedy, proved, samples, 1.0 if proved else probability)


def _other_units(table: DynamicTable, factor: float) -> str:
    """Return the key of the case file that makes the numbers of the file larger by a factor."""
    # Only here: nothing else at start needs to read units.
    from bushcli.recording.header.units import read_unit

    names: dict[str, str] = {}
    for key in (key for key in _SIZES if key in table.units):
        own = table.units[key]
        units = {name: unit for name in _UNITS if (unit := read_unit(name)) and unit.measured == own.measured}
        same = (name for name, unit in units.items() if np.isclose(unit.factor, factor * own.factor))
        names[key] = next(same, "...")
    listed = ", ".join(f'{key} = "{name}"' for key, name in names.items())
    return f"units = {{{listed or 'displacement = ..., force = ...'}}}"


def _belongs(table: DynamicTable, row: int) -> str:
    """Return in words the conditions of the other curve on which a row lies; empty if there is none."""
    over = table.along
    for rows in table.conditions():
        if row in rows or len(rows) < 3:
            continue
        order = rows[np.argsort(over[rows])]
        step = float(np.median(np.diff(over[order])))
        if not over[order[0]] - step <= over[row] <= over[order[-1]] + step:
            continue
        values = [np.interp(over[row], over[order], v[order]) for v in (table.storage, table.loss)]
        measured = table.storage[row], table.loss[row]
        if max(abs(a / b - 1.0) for a, b in zip(measured, values, strict=True)) < _SAME:
            other = table.rows(rows[:1])
            conditions = [(other.temperature, "degrees C"), (other.frequency, "Hz")]
            return ", ".join(f"{v[0]:.4g} {unit}" for v, unit in conditions if not np.isnan(v[0]))
    return ""


def _order(table: DynamicTable, off_curve: NDArray[np.bool_]) -> Iterator[DataFault]:
    """Yield a fault if rows after a larger amplitude are softer than those of the same amplitude before it.

    Sweeps from large to small amplitudes alone do not show it: there a rubber that remembers the largest amplitude
    looks like one that does not, with another exponent of its clock (`benchmarks/dynamic.md`).
    """
    changes: list[Array] = []
    later = np.zeros(len(table), dtype=bool)
    for rows in table.sweeps():
        rows = rows[~off_curve[rows]]
        amplitude = table.amplitude[rows]
        last = int(np.argmax(amplitude)) if len(rows) else 0
        before, after = rows[: last + 1], rows[last + 1 :]
        after = after[table.amplitude[after] * _LARGER < amplitude.max(initial=0.0)]
        later[after] = True
        before = before[np.argsort(table.amplitude[before], kind="stable")]
        after = after[table.amplitude[after] >= 0.99 * table.amplitude[before[:1]]]
        x, y = np.log(table.amplitude), np.log(table.stiffness)
        if len(before) > 1:
            changes.append(y[after] - np.interp(x[after], x[before], y[before]))
    change = np.concatenate([*changes, np.zeros(0)])
    if len(change) < _AFTER:
        return
    mean, error = float(change.mean()), float(change.std(ddof=1)) / np.sqrt(len(change))
    if mean > -max(_SOFTER, _SURE * error):
        return
    where = f"{later.sum()} rows that were measured after larger amplitudes are softer than those before, by "
    where += (
        f"{-100 * np.expm1(mean):.2g} % on average: the larger amplitudes have softened the rubber, or it is "
    )
    where += "another specimen"
    remedy = "measure from small to large amplitudes; fits leave these rows out, accept = "
    yield DataFault(table.name, "order", where, remedy + '["order"] uses them', False, later)


def _temperatures(whole: DynamicTable, off_curve: NDArray[np.bool_]) -> Iterator[DataFault]:
    """Yield a fault for two sweeps at neighbouring temperatures that agree, while their neighbours differ."""
    table = whole.rows(~off_curve)
    over = table.along
    if np.isnan(over).any() or np.isnan(table.temperature).any():
        return
    curves = sorted(table.conditions(), key=lambda rows: float(np.mean(table.temperature[rows])))
    if len(curves) < 4:
        return
    temperatures = np.array([float(np.mean(table.temperature[rows])) for rows in curves])
    if (np.diff(temperatures) < 1.0).any():
        return  # several amplitudes or preloads at one temperature
    # Difference of ln K* of neighbouring curves, rms over the range that both have: where rubber turns from glass to an
    # entropic spring, a modulus passes a minimum over the temperature, but its angle still falls. It is the shift of
    # the times by the slope over the logarithm of frequency, which is 2 / pi of the angle: none on a plateau (Booij and
    # Thoone 1982, doi:10.1007/BF01535661).
    change, angle = np.full((2, len(curves) - 1), np.nan)
    ordered = [rows[np.argsort(over[rows])] for rows in curves]
    for k, (colder, warmer) in enumerate(pairwise(ordered)):
        low, high = max(over[colder[0]], over[warmer[0]]), min(over[colder[-1]], over[warmer[-1]])
        x, values = np.linspace(low, high, 20), np.log(table.storage + 1j * table.loss)
        if high > low:
            pair = [np.interp(x, over[rows], values[rows]) for rows in (colder, warmer)]
            change[k] = np.sqrt(np.mean(np.abs(pair[1] - pair[0]) ** 2))
            angle[k] = np.sqrt(np.mean(np.imag(pair) ** 2))
    rate = np.maximum(change, 1e-4) / np.maximum(angle, 1e-6) / np.diff(temperatures)
    for k in range(len(rate)):
        beside = [rate[j] for j in (k - 1, k + 1) if 0 <= j < len(rate)]
        if len(beside) == 1:
            # At the end of the range the trend of the two steps before it goes on.
            near, next_one = (k - 1, k - 2) if k else (1, 2)
            beside = [rate[near] * min(rate[near] / rate[next_one], 1.0)]
        expected = min(float(np.exp(np.mean(np.log(beside)))), _FASTEST)
        if rate[k] * _STEADY < expected and change[k] < _SAME:
            rows = np.zeros(len(whole), dtype=bool)
            where = (
                f"the sweeps at {temperatures[k]:.4g} and {temperatures[k + 1]:.4g} degrees C agree "
                f"within {100 * change[k]:.1f} %, "
                f"where those beside them let expect a change of {100 * expected * angle[k]:.1g} % per kelvin"
            )
            remedy = "one of them was probably not measured at its temperature: ask the laboratory, or leave one out"
            yield DataFault(table.name, "temperature", where, remedy, False, rows)
