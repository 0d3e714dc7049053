"""Rows of a table of dynamic stiffness that miss what the other rows predict by more than the prediction may err.

ln |K*| and the loss angle of a curve are normal processes each: a straight line over the logarithm of frequency or
amplitude, relaxations at random places, and noise. A branch's loss is sech(ln(omega tau)), so that relaxations at
random have the covariance d / sinh(d) over a distance d: no rubber bends more sharply, whatever its law. Over frequency
a multiple of its square comes in addition, with which inertia changes the stiffness, and a cubic spline over frequency
for what else a rig adds (a resonance, a lag).

How large each part is no one knows: all sizes of a grid are equally probable before, and the other rows weigh them, the
noise being one in all curves of a table. A row's distribution is therefore wide where it stands alone, at the end of a
list 1, 10, 20, ... 100 Hz, and narrow between close neighbours.

References
----------
Rasmussen and Williams (2006), Gaussian Processes for Machine Learning, sections 2.7 and 5.4.2, ISBN 026218253X: a
process about a line, and rows predicted without themselves. Rosner (1983), Percentage points for a generalized ESD
many-outlier procedure, doi:10.1080/00401706.1983.10487848: of several outliers the first may hide behind others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfc, logsumexp

from bushcli.recording.dynamic.table import DynamicTable

Array = NDArray[np.float64]

#: A row is off its curve if it misses by this share of the stiffness (or this many rad), and if the probability that
#: one of a sound table misses by as much is at most this. Of 4,000 drawn tables (fractional Zener, Maxwell branches,
#: WLF temperatures, Payne sweeps; mass, resonance, lag or compliance; 20 lists of 5 to 100 frequencies or amplitudes;
#: noise of 0.2 to 2 %) none had one; of one wrong row in each (10 to 50 %, 4 to 10 degrees) 2,528 were found. With
#: lines through four neighbours and ten times the scatter, 845 had one, and 1,976 were found.
_OFF, _CHANCE = 0.05, 1e-3
#: A row's own noise may be this many times that of the others (judgement). Of 120 drawn tables whose noise differs
#: 16-fold from row to row 6 had a false row with 1, none with 1.5; 164, 150 and 127 of 240 wrong rows are found with 1,
#: 1.5 and 2.
_OWN = 1.5
#: Standard deviations of the noise, of the relaxations, and of the spline at the highest frequency, in ln |K*| and rad:
#: from less than any rig or rubber has to the noise of the worst rig, a glass transition, a resonance in the table.
_NOISE = np.geomspace(5e-4, 0.08, 12)
_RELAXATION = np.geomspace(0.01, 1.0, 5)
_RIG = np.array([0.0, *np.geomspace(0.01, 100.0, 7)])
#: Rows of a curve that is judged: three determine its line and inertia. A longer one is judged in pieces.
_FEWEST, _LONG = 6, 60
#: Rows that together hide the least probable one, because they pass for noise.
_HIDING = 3


@dataclass(frozen=True)
class _Piece:
    """A curve of n rows judged by each of s shapes and m sizes of the noise; the last axis is ln |K*| and loss angle.

    Attributes
    ----------
    rows : shape (n,)
    evidence : shape (s, m, 2)
        Logarithm of the probability density of all rows.
    without : shape (s, m, n, 2)
        That of all rows but one.
    miss, error : shape (s, m, n, 2)
        The row over what the others predict, and its standard deviation.
    """

    rows: NDArray[np.intp]
    evidence: Array
    without: Array
    miss: Array
    error: Array


def rows_off_curve(table: DynamicTable) -> NDArray[np.bool_]:
    """Return which rows (n,) of a table belong to no curve.

    The least probable row is taken out, then the next one without it; all up to the last that is too improbable are
    off.

    Parameters
    ----------
    table : DynamicTable
    """
    curves = [rows for rows in table.conditions() if len(rows) >= _FEWEST]
    used = np.isfinite(table.along)
    taken: list[int] = []
    count = 0
    while len(taken) <= min(1 + 0.1 * len(table), count + _HIDING):
        chance, size = _judged(table, curves, used)
        if size.max(initial=0.0) <= _OFF:
            break
        taken.append(int(np.argmin(np.where(size > _OFF, chance, np.inf))))
        used[taken[-1]] = False
        # One of n rows, by its stiffness or its angle.
        if 2.0 * len(table) * chance[taken[-1]] < _CHANCE:
            count = len(taken)
    off = np.zeros(len(table), dtype=bool)
    off[taken[:count]] = True
    return off


def _judged(
    table: DynamicTable, curves: list[NDArray[np.intp]], used: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Return the probability (n,) that a row misses what the others predict by as much, and by how much it does."""
    chance, size = np.ones(len(table)), np.zeros(len(table))
    pieces = []
    for curve in curves:
        rows = curve[used[curve]]
        rows = rows[np.argsort(table.along[rows], kind="stable")]
        split = np.array_split(rows, max(1, -(-len(rows) // _LONG)))
        pieces += [_piece(table, part) for part in split if len(part) >= _FEWEST - 1]
    by_noise = [logsumexp(piece.evidence, axis=0) for piece in pieces]
    for piece, own in zip(pieces, by_noise, strict=True):
        log_weight = piece.without + (sum(by_noise) - own)[:, None]
        weight = np.exp(log_weight - logsumexp(log_weight, axis=(0, 1)))
        tails = erfc(np.abs(piece.miss) / piece.error / np.sqrt(2.0))
        chance[piece.rows] = np.sum(weight * tails, axis=(0, 1)).min(axis=-1)
        size[piece.rows] = np.hypot(*np.sum(weight * piece.miss, axis=(0, 1)).T)
    return chance, size


def _piece(table: DynamicTable, rows: NDArray[np.intp]) -> _Piece:
    """Return rows of one curve as each shape and size of the noise predicts them."""
    x = table.along[rows] - table.along[rows].mean()
    values = np.column_stack([np.log(table.stiffness[rows]), table.loss_angle[rows]])
    distance = np.maximum(np.abs(np.subtract.outer(x, x)), 1e-9)
    covariance = _RELAXATION[:, None, None] ** 2 * distance / np.sinh(distance)
    line = [np.ones(len(rows)), x]
    if table.over_frequency:
        f = table.frequency[rows] / table.frequency[rows].max()
        line.append(f**2)
        low, high = np.minimum.outer(f, f), np.maximum.outer(f, f)
        spline = 0.5 * low**2 * (3.0 * high - low)
        rig = _RIG[:, None, None] ** 2 * spline
        covariance = (covariance[:, None] + rig).reshape(-1, len(rows), len(rows))
    basis, singular, _ = np.linalg.svd(np.column_stack(line))
    # What the line cannot change, in which the covariance is diagonal.
    across = basis[:, np.count_nonzero(singular > 1e-9 * singular[0]) :]
    variances, turned = np.linalg.eigh(across.T @ covariance @ across)
    vectors = across @ turned
    noise = _NOISE[:, None] ** 2
    precision = 1.0 / (np.maximum(variances, 0.0)[:, None, :] + noise)
    seen = vectors.transpose(0, 2, 1) @ values
    logs = 0.5 * np.log(precision).sum(axis=-1)[..., None]
    evidence = logs - 0.5 * precision @ seen**2
    own = precision @ (vectors**2).transpose(0, 2, 1)
    weighted = vectors[:, None] @ (precision[..., None] * seen[:, None])
    # A row that alone determines a part of the line is predicted by nothing.
    own = np.maximum(own, 1e-9 * precision.max(axis=-1, keepdims=True))[..., None]
    without = evidence[:, :, None] - 0.5 * np.log(own) + 0.5 * weighted**2 / own
    error = np.sqrt(1.0 / own + (_OWN**2 - 1.0) * noise[:, :, None])
    return _Piece(rows, evidence, without, weighted / own, error)
