"""Two of |K*|, K', K'', loss angle, tan delta and damping -> K' and K''; what contradicts itself is named."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import RecordingError
from bushcli.recording.dynamic.table import Mask, Text, refuse_rows
from bushcli.recording.header.vocabulary import plain_name
from bushcli.recording.text.table import Table

Array = NDArray[np.float64]

#: Given values that differ by more than this share of |K*| contradict each other: an angle that is rounded to whole
#: degrees moves K'' by 0.9 % of |K*|, three digits of a stiffness by 0.5 % (judgement).
_TOLERANCE = 0.02
#: The loss angle of rubber stays below this but in its glass transition, where tan delta reaches 2 to 3 at some
#: temperatures and frequencies; a table in which *every* row is above it has probably 90 degrees minus the angle.
_IMPLAUSIBLE_ANGLE = np.radians(45.0)
#: Symbols in messages.
_SYMBOLS = {"stiffness": "|K*|", "storage": "K'"}
#: Quantities that have the sign of the loss.
_LOSSES = ("loss", "loss_angle", "tan_delta", "damping")
#: Pairs that give K' and K'', the best conditioned first.
_PAIRS = (
    ("storage", "loss"), ("stiffness", "loss_angle"), ("stiffness", "tan_delta"), ("storage", "tan_delta"),
    ("storage", "loss_angle"), ("stiffness", "loss"), ("loss", "tan_delta"), ("loss", "loss_angle"),
    ("stiffness", "storage"),
)  # fmt: skip
#: K' and K'' from the quantities of a pair; from a loss angle by its tangent.
_SOLVED: Mapping[tuple[str, str], Callable[[Array, Array], tuple[Array, Array]]] = {
    ("storage", "loss"): lambda storage, loss: (storage, loss),
    ("storage", "tan_delta"): lambda storage, tangent: (storage, storage * tangent),
    ("loss", "tan_delta"): lambda loss, tangent: (loss / tangent, loss),
    ("stiffness", "tan_delta"): lambda k, t: (k * np.cos(np.arctan(t)), k * np.sin(np.arctan(t))),
    ("stiffness", "loss"): lambda size, loss: (np.sqrt(np.maximum(size**2 - loss**2, 0.0)), loss),
    ("stiffness", "storage"): lambda size, storage: (storage, np.sqrt(np.maximum(size**2 - storage**2, 0.0))),
}


@dataclass(frozen=True)
class StiffnessColumns:
    """Measured columns of a table, in internal units, and what is said of them.

    Attributes
    ----------
    values : mapping of str to (n,) array
        By quantity: "stiffness" |K*|, "modulus" (|K*| or K'), "storage", "loss", "loss_angle", "tan_delta",
        "damping"; N/mm, N mm/rad or MPa, rad.
    table, labels : Table, mapping of str to str
        Where they stand; ``column 2 (K')`` by quantity.
    places, frequency : sequence of str, (n,) array
        File and line, and Hz, of each row.
    stiffness_is, loss_angle_is : str, optional
        What the case says that the "modulus" and the angle are.
    """

    values: Mapping[str, Array]
    table: Table
    labels: Mapping[str, str]
    places: Sequence[str]
    frequency: Array
    stiffness_is: Literal["magnitude", "storage"] | None
    loss_angle_is: Literal["loss", "complement"] | None

    def refuse(self, bad: Mask, what: Text, remedy: str) -> None:
        """Refuse the first of the rows (n,) that are bad, and say how many more are."""
        refuse_rows(bad, self.places, what, remedy, more=True)


def complex_stiffness(columns: StiffnessColumns) -> tuple[Array, Array, tuple[str, ...]]:
    """Return K' and K'' (n,) in the unit of the given ones, and remarks."""
    values = dict(columns.values)
    if "loss_angle" in values and columns.loss_angle_is == "complement":
        values["loss_angle"] = 0.5 * np.pi - values["loss_angle"]
    remarks: list[str] = []
    if "modulus" in values:
        key, readings = _quantity_of_modulus(columns, values)
        values[key] = values.pop("modulus")
        remarks += readings
    angle = values.get("loss_angle", np.zeros(0))
    if (angle > 1.5 * np.pi).any():
        # A rig that counts from 0 to 360 degrees.
        values["loss_angle"] = np.where(angle > 1.5 * np.pi, angle - 2.0 * np.pi, angle)
        remarks.append(f"{columns.labels['loss_angle']}: angles of 270 to 360 degrees are read as 360 less")
    _refuse_impossible(columns, values)
    remarks += _losses_below_zero(columns, values)
    pair = next((pair for pair in _PAIRS if set(pair) <= set(values)), None)
    if pair is None and "damping" in values:
        values["loss"] = 2.0 * np.pi * columns.frequency * values.pop("damping")
        pair = next((pair for pair in _PAIRS if set(pair) <= set(values)), None)
    if pair is None:
        raise missing_columns(columns.table, columns.labels.values())
    first, second = values[pair[0]], values[pair[1]]
    second = np.tan(second) if pair[1] == "loss_angle" else second
    storage, loss = _SOLVED[pair[0], pair[1].replace("loss_angle", "tan_delta")](first, second)
    _refuse_contradictions(columns, values, storage, loss, pair)
    if columns.loss_angle_is is None and {"loss_angle", "tan_delta"} & set(pair):
        angle = np.arctan2(loss, storage)
        if (angle > _IMPLAUSIBLE_ANGLE).all():
            low, high = np.degrees([angle.min(), angle.max()])
            what = f"loss angles of {low:.3g} to {high:.3g} degrees are those of a fluid"
            complement = 'loss_angle_is = "complement" if the file has 90 degrees minus them'
            expected = f'{complement}, "loss" if they were measured so'
            raise columns.table.refusal(what, expected)
    return storage, loss, tuple(remarks)


def missing_columns(table: Table, labels: Iterable[str]) -> RecordingError:
    """Return the error about a table without two columns that give K' and K'', from the labels of those it has."""
    have = ", ".join(labels) or "none of them"
    what = f"K' and K'' need two of |K*|, K', K'', loss angle, tan delta and damping; there is {have}"
    expected = "columns = {storage = ..., loss = ...} in the case file, if others are meant"
    # A loss factor in vibration isolation, and Lehr's damping ratio, D = tan(delta)/2 at a resonance, elsewhere.
    factor = (i for i, name in enumerate(table.names) if "damping factor" in plain_name(name))
    for i in factor:
        what += f"; {table.label(i)} may be the loss factor or the damping ratio, which is half of it"
        expected = (
            f"columns = {{tan_delta = {i + 1}}}, if it is the loss factor; if not, double its numbers first"
        )
    return table.refusal(what, expected)


def _quantity_of_modulus(columns: StiffnessColumns, values: Mapping[str, Array]) -> tuple[str, list[str]]:
    """Return whether a column that is called stiffness or modulus is |K*| or K', by the others or the case file."""
    label = columns.labels["modulus"]
    if columns.stiffness_is is not None:
        return {"magnitude": "stiffness", "storage": "storage"}[columns.stiffness_is], []
    if "storage" in values or "stiffness" in values:
        quantity = "stiffness" if "storage" in values else "storage"
        return quantity, [f"{label} is read as {_SYMBOLS[quantity]}: the other one is given too"]
    tangent = np.tan(values["loss_angle"]) if "loss_angle" in values else values.get("tan_delta")
    if "loss" in values and tangent is not None:
        modulus, loss = values["modulus"], values["loss"]
        parts = {"stiffness": np.sin(np.arctan(tangent)), "storage": tangent}
        error = {key: float(np.sqrt(np.mean((part - loss / modulus) ** 2))) for key, part in parts.items()}
        best, other = sorted(error, key=lambda key: error[key])
        # With a small loss angle both are the same within their digits, and it makes no difference.
        if error[best] < _TOLERANCE and (error[other] > 3.0 * error[best] or error[other] < 1e-3):
            return best, [f"{label} is read as {_SYMBOLS[best]}, which agrees with the loss and the angle"]
    what = f"{label} may be |K*| or K', and the file does not say which"
    expected = 'stiffness_is = "magnitude" for |K*|, or "storage" for K\', in the recording\'s table of the case file'
    raise columns.table.refusal(what, expected)


def _refuse_impossible(columns: StiffnessColumns, values: Mapping[str, Array]) -> None:
    """Refuse what no recording has: most losses negative, an angle of 90 degrees and more, no stiffness."""
    for key in _LOSSES:
        late = np.count_nonzero(values[key] < 0.0) if key in values else 0
        if late and late > 0.5 * len(values[key]):
            what = f"{columns.labels[key]} is negative in {late} of {len(values[key])} rows, but rubber dissipates"
            expected = "change the sign of the column, if it has the phase of the motion behind the force"
            raise columns.table.refusal(what, expected)
    if "loss_angle" in values:
        angle = values["loss_angle"]
        bad = np.abs(angle) >= 0.5 * np.pi
        shown = f"{np.degrees(angle[np.argmax(bad)]):.4g} degrees"
        remedy = "delete the row; or units = {loss_angle = ...}, if the file is in another unit"
        columns.refuse(bad, f"a loss angle of {shown}, where only -90 to 90 are possible", remedy)
    for key in ("stiffness", "storage"):
        if key not in values:
            continue
        column, remedy = values[key], "rubber resists; delete the row"
        if key == "storage":
            remedy += ", or correct the force by the inertia of the fixture: K' + m omega^2"
        bad, label = column <= 0.0, columns.labels.get(key, _SYMBOLS[key])
        columns.refuse(
            bad, f"{label}: {_SYMBOLS[key]} = {column[np.argmax(bad)]:.4g} is not possible", remedy
        )


def _losses_below_zero(columns: StiffnessColumns, values: Mapping[str, Array]) -> Iterator[str]:
    """Yield remarks about losses that are negative in some rows: they scatter, or the force is logged late."""
    for key in _LOSSES:
        if key in values and (values[key] < 0.0).any():
            late, least = np.count_nonzero(values[key] < 0.0), values[key].min()
            shown = f"{np.degrees(least):.3g} degrees" if key == "loss_angle" else f"{least:.3g}"
            yield (
                f"{columns.labels[key]} is negative in {late} of {len(values[key])} rows, down to {shown}: rubber "
                "dissipates, so that these scatter, or the force is logged late (effect time_lag)"
            )


def _refuse_contradictions(
    columns: StiffnessColumns, values: Mapping[str, Array], storage: Array, loss: Array, pair: Sequence[str]
) -> None:
    """Refuse quantities that contradict the pair used, and say what would make them agree."""
    size = np.hypot(storage, loss)
    if pair == ("stiffness", "storage") or pair == ("stiffness", "loss"):
        whole, part, label = values["stiffness"], values[pair[1]], columns.labels.get(pair[1])
        columns.refuse(
            whole < (1.0 - _TOLERANCE) * np.abs(part),
            lambda row: f"|K*| = {whole[row]:.5g} is less than its part {label} = {part[row]:.5g}",
            'columns = {...}, or stiffness_is = "storage"',
        )
    given = {
        "stiffness": (size, size),
        "storage": (storage, size),
        "loss": (loss, size),
        "loss_angle": (np.arctan2(loss, storage), np.ones(len(size))),
        "tan_delta": (loss / storage, 1.0 + (loss / storage) ** 2),
        "damping": tuple(stiffness / (2.0 * np.pi * columns.frequency) for stiffness in (loss, size)),
    }
    for key, (computed, scale) in given.items():
        if key not in values or key in pair:
            continue
        stated = values[key]
        bad = np.abs(computed - stated) > _TOLERANCE * np.abs(scale)
        row = int(np.argmax(bad))
        shown = [np.degrees(v[row]) if key == "loss_angle" else v[row] for v in (computed, stated)]
        others = " and ".join(pair).replace("_", " ")
        what = f"{columns.labels.get(key, key)} is {shown[1]:.4g}, and {others} give {shown[0]:.4g}"
        remedy = f"correct or delete the rows; or columns = {{{key} = ...}}, if another column is meant"
        near = 2.0 * _TOLERANCE * np.maximum(np.abs(stated), 1e-12)
        explained = _hypotheses(key, stated, storage, loss, columns.frequency) if np.mean(bad) > 0.5 else {}
        causes = (c for c, v in explained.items() if np.all((np.abs(v - stated) <= near)[bad]))
        columns.refuse(bad, what, next(causes, remedy))


_COMPLEMENT = '90 degrees minus the loss angle is in the file: loss_angle_is = "complement"'
_EXCHANGED = "K' and K'' are exchanged: columns = {storage = ..., loss = ...}"


def _hypotheses(key: str, given: Array, storage: Array, loss: Array, frequency: Array) -> dict[str, Array]:
    """Return what a quantity would be by the others if something is wrong with it or them, by the remedy."""
    angle, tangent = np.arctan2(loss, storage), loss / storage
    as_magnitude = np.arcsin(np.minimum(tangent, 1.0))
    if key == "loss_angle":
        # Both explain the same numbers: the loss angle of rubber is the smaller one.
        turned = _COMPLEMENT if np.median(given) > _IMPLAUSIBLE_ANGLE else _EXCHANGED
        as_tangent = 'the column has tan delta: columns = {tan_delta = ...}, units = {tan_delta = "1"}'
        return {
            turned: 0.5 * np.pi - angle,
            'the angle is in radians: units = {loss_angle = "rad"}': np.radians(angle),
            'the angle is in degrees: units = {loss_angle = "deg"}': np.degrees(angle),
            as_tangent: np.radians(tangent),
            "the column of K' has |K*|: columns = {stiffness = ...}": as_magnitude,
        }
    if key == "tan_delta":
        return {
            'tan delta is in percent: units = {tan_delta = "percent"}': 100.0 * tangent,
            _EXCHANGED: 1.0 / np.maximum(tangent, 1e-300),
            "the column has the angle: columns = {loss_angle = ...}": np.degrees(angle),
            "the column of K' has |K*|: columns = {stiffness = ...}": np.tan(as_magnitude),
        }
    if key == "damping":
        damping = loss / (2.0 * np.pi * frequency)
        return {
            'the frequency is in rad/s: units = {frequency = "rad/s"}': 2.0 * np.pi * damping,
            'the damping is in N s/m: units = {damping = "N s/m"}': 1e3 * damping,
        }
    return {"the column of |K*| has K': columns = {storage = ...}": storage} if key == "stiffness" else {}
