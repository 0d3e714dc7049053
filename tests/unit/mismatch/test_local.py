"""The map of stiffness on a toy bushing, whose curves are sums over the cells of closed-form shares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from bushcli.likelihood.linearisation import linearise, weigh
from bushcli.likelihood.noise import Compared, NoiseModel
from bushcli.mismatch.bushing import LEVEL, Combined, Seen, local_map
from bushcli.mismatch.field import covariance, estimate, estimate_zones, uniform
from bushcli.mismatch.places import onto, zones
from bushcli.recording import Recording
from cases.local import Cells
from geometry.shape import shapes

INNER, OUTER, END = 9.0, 18.0, 17.0
SHAPE = shapes()["plain"](inner_radius=INNER, outer_radius=OUTER, length=2 * END)
SAMPLES, SEEDS = 240, 40
SIGMA = 1.0
# Forces of a few hundred standard deviations, as a good rig measures them.
SIZE = 600.0


def section(across=6, along=12, half=False):
    """Cells of the half-plane in tensor-product order."""
    r, z = np.linspace(INNER, OUTER, across + 1), np.linspace(0.0 if half else -END, END, along + 1)
    points = np.array([(a, b) for b in z for a in r])
    first = np.array([j * (across + 1) + i for j in range(along) for i in range(across)])
    corners = first[:, None] + np.array([0, 1, across + 1, across + 2])
    middle = points[corners].mean(axis=1)
    area = (OUTER - INNER) / across * np.ptp(z) / along
    return Cells(points, corners, (2 if half else 1) * 2 * np.pi * middle[:, 0] * area)


def solid(around=8, across=3, along=6):
    """An upper half of a body in space, z >= 0 and y >= 0."""
    flat = section(across, along, half=True)
    angles = np.linspace(0.0, np.pi, around + 1)
    r, z = flat.points.T
    points = np.concatenate([np.column_stack([r * np.cos(a), r * np.sin(a), z]) for a in angles])
    n = len(flat.points)
    corners = np.concatenate(
        [np.hstack([flat.corners + k * n, flat.corners + (k + 1) * n]) for k in range(around)]
    )
    return Cells(points, corners, np.tile(flat.volume / around, around))


def path():
    return np.interp(np.linspace(0, 4, SAMPLES), [0, 1, 2, 3, 4], [0, 1, 0, -1, 0])


def shares(mode, cells):
    """Derivatives (n, m): each cell's contribution to the force, larger toward the inner bond or toward mid-length.

    Axial shear stress is proportional to 1 / r, its energy to 1 / r^2, for a stiffening law also to 1 / r^4; the ends
    bulge to one side, increasingly with the travel. Torsional stress is proportional to 1 / r^2. Radial load causes
    pressure at mid-length.
    """
    q, (r, z) = path()[:, None], cells.centres.T
    z = z / END
    if mode == "axial":
        weights = 1 / r**2, INNER**2 / r**4, 0.3 * z * np.abs(z) / r**2
        powers = q, q**3, q * np.abs(q)
        found = sum(
            w / (cells.volume @ np.abs(w)) * s * p
            for w, s, p in zip(weights, (1, 0.5, 0.2), powers, strict=True)
        )
    else:
        weight = r**-4.0 if mode == "torsional" else (1.2 - z**2) / r
        found = weight / (cells.volume @ weight) * (q + 0.2 * q**3)
    return SIZE * found * cells.volume


def spot(cells, amount):
    """Change of stiffness by `amount` near the inner bond at the upper end."""
    r, z = cells.centres.T
    return np.where((r < INNER + 3.0) & (z > END / 3), amount, 0.0)


def seen(mode, change, seed=None, *, shared=0.0, noise=None, cells=None, mirrors=frozenset()):
    """A channel whose rubber differs in stiffness from the simulated one, with noise; its law is fixed."""
    cells = cells or section()
    slope, q = shares(mode, cells), path()
    error = 0.0 if seed is None else SIGMA * np.random.default_rng((seed, len(mode))).standard_normal(SAMPLES)
    force = slope @ (1.0 + np.broadcast_to(change, len(cells.volume))) + error
    recording = Recording(mode, q, force, name=mode)
    compared = Compared(recording, slope.sum(axis=1), noise or NoiseModel(SIGMA))
    return Seen(compared, np.zeros((SAMPLES, 0)), slope, cells, mirrors, shared)


def fitted(parts):
    """The same channels with a law of two parameters, one for stiffening, fitted to all of them."""
    powers = np.column_stack([path(), path() ** 3])
    jacobians = [powers * np.linalg.lstsq(powers, one.slope.sum(axis=1), rcond=None)[0] for one in parts]
    misfit = np.concatenate([one.compared.misfit for one in parts])
    best = np.linalg.lstsq(np.concatenate(jacobians), -misfit, rcond=None)[0]
    return [
        replace(one, jacobian=j, compared=replace(one.compared, simulated=one.compared.simulated + j @ best))
        for one, j in zip(parts, jacobians, strict=True)
    ]


def combined(channels):
    return Combined(channels, SHAPE)


MODES = ("axial", "torsional", "radial")


@pytest.mark.parametrize("law", ["held", "fitted"])
@pytest.mark.parametrize("modes", [("axial",), MODES])
def test_noise_alone_makes_no_place(modes, law):
    """At the level of 1 %, no more false alarms in 40 seeds than one such test in a thousand would give."""
    cells = section()
    prior = covariance(cells, OUTER - INNER)
    alarms = 0
    for seed in range(SEEDS):
        parts = [seen(mode, 0.0, seed) for mode in modes]
        parts = fitted(parts) if law == "fitted" else parts
        linear = linearise([one.compared for one in parts], [one.jacobian for one in parts])
        slope = weigh([one.compared for one in parts], [one.slope for one in parts])
        alarms += estimate(linear, slope, prior).p < LEVEL
    assert alarms <= binom.ppf(0.999, SEEDS, LEVEL)
    assert alarms <= 0.05 * SEEDS


def test_noise_of_doubtful_size_makes_no_place():
    """Where noise is twice as large as estimated, the size of the misfit itself decides."""
    prior = covariance(section(), OUTER - INNER)
    alarms = 0
    for seed in range(SEEDS):
        one = seen("axial", 0.0, seed, noise=NoiseModel(SIGMA / 2, freedom=20.0))
        linear, slope = linearise([one.compared], [one.jacobian]), weigh([one.compared], [one.slope])
        alarms += estimate(linear, slope, prior).p < LEVEL
    assert alarms <= binom.ppf(0.999, SEEDS, LEVEL)


def test_one_factor_on_all_rubber_is_found_and_is_no_place():
    found = combined([seen(mode, -0.2, 1) for mode in MODES])
    # With SIZE over SIGMA and some hundred samples the factor is known to 1e-4.
    assert found.uniform == pytest.approx(-0.2, abs=1e-3)
    result = found.map(found.gains, 1.0)
    assert not result.helps_locally
    assert result.uniform_gain > 0.99
    assert result.local_gain == pytest.approx(result.uniform_gain, abs=1e-3)
    np.testing.assert_allclose(result.factor, -0.2, atol=0.01)
    assert "(0.8 on all rubber)" in result.text
    assert "do not point to any place" in result.text


def test_a_place_that_hardly_matters_beside_the_factor_is_no_place():
    """Another batch, and a spot that is softer by a per cent: significant, but too small to be of interest."""
    cells = section()
    found = combined([seen(mode, -0.3 + spot(cells, -0.01), 8) for mode in MODES])
    assert found.field.p < LEVEL
    result = found.map(found.gains, 1.0)
    assert not result.helps_locally
    assert result.local_gain > result.uniform_gain
    assert "hardly more" in result.text


@pytest.mark.parametrize("law", ["held", "fitted"])
def test_a_spot_is_found_where_it_is(law):
    cells = section()
    truth = spot(cells, np.log(0.6))
    parts = [seen(mode, truth, 2) for mode in MODES]
    result = combined(fitted(parts) if law == "fitted" else parts)
    drawn = result.map(result.gains, 1.0)
    assert drawn.helps_locally
    assert drawn.local_gain > drawn.uniform_gain + 0.01
    inside = truth != 0
    volume = cells.volume
    mean = (drawn.factor * volume)[inside].sum() / volume[inside].sum()
    rest = (drawn.factor * volume)[~inside].sum() / volume[~inside].sum()
    # A smooth map smears the spot out; it does not move it.
    assert mean < -0.1
    assert abs(rest) < 0.3 * abs(mean)
    assert "softer near the inner bond at the upper end" in drawn.text
    labels, members = zones(cells, frozenset(), SHAPE)
    parts = estimate_zones(result.linear, result.slope, members)
    best = int(np.argmax(parts.drop))
    assert labels[best].startswith("near the inner bond at the upper end")
    # The zone is the spot, and the toy is linear in the logarithm.
    assert parts.change[best] == pytest.approx(np.log(0.6), abs=0.1)


def test_one_channel_knows_that_the_rubber_differs_but_not_where():
    cells = section()
    change = spot(cells, np.log(0.5))
    torsional = combined([seen("torsional", change, 3)])
    result = torsional.map(torsional.gains, 1.0)
    # All places give the same shape of curve, so that a factor explains it as well.
    assert not result.helps_locally
    axial = combined(fitted([seen("axial", change, 3)]))
    result = axial.map(axial.gains, 1.0)
    assert result.helps_locally
    assert "do not distinguish this from" in result.text or "cannot be determined" in result.text


def test_a_channels_own_calibration_is_no_place():
    """Two per cent between channels, with a standard deviation of one per cent for calibration and mesh."""

    def answers(shared):
        parts = [seen("axial", 0.02, 4, shared=shared), seen("torsional", 0.0, 4, shared=shared)]
        return combined(parts).field.p

    assert answers(0.0) < LEVEL
    assert answers(0.01) > LEVEL


def test_a_hysteresis_loop_is_no_place():
    """A difference between loading and unloading cannot come from an elastic change, however large it is."""
    one = seen("axial", 0.0, 5)
    loop = 20.0 * SIGMA * np.sign(np.gradient(path()))
    force = one.compared.recording.force + loop
    compared = Compared(
        Recording("axial", path(), force, name="axial"), one.compared.simulated, NoiseModel(SIGMA)
    )
    found = combined([Seen(compared, one.jacobian, one.slope, one.cells, one.mirrors, 0.0)])
    assert found.field.p > LEVEL


def test_what_the_fitted_parameters_do_is_not_the_factors():
    (one,) = fitted([seen("torsional", 0.1, 6)])
    linear, slope = linearise([one.compared], [one.jacobian]), weigh([one.compared], [one.slope])
    assert uniform(linear, slope) == 0.0


def test_prior_varies_over_its_length():
    cells = section()
    found = covariance(cells, 5.0)
    assert cells.volume @ np.diag(found) == pytest.approx(cells.volume.sum())
    assert np.linalg.eigvalsh(found)[0] > 0
    size = np.sqrt(np.diag(found))
    correlation = found / np.outer(size, size)
    height = cells.centres[:, 1]
    column = np.flatnonzero(np.isclose(cells.centres[:, 0], cells.centres[0, 0]))
    row = correlation[column[0], column]
    assert (np.diff(row) < 0).all()
    assert (row > 0).all()
    near, far = (
        np.abs(height[column] - height[column[0]]) < 5.0,
        np.abs(height[column] - height[column[0]]) > 20.0,
    )
    assert row[near].min() > 0.2
    assert row[far].max() < 0.05


def test_a_solids_cells_are_means_over_rings_of_both_halves():
    host, half = section(), solid()
    matrix = onto(half, frozenset({"y", "z"}), host, frozenset())
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0)
    # A field that is even in z is reproduced at the resolution of the cells; an odd one vanishes.
    radius, height = host.centres.T
    np.testing.assert_allclose(matrix @ height, 0.0, atol=1e-9)
    own = np.linalg.norm(half.points[half.corners][..., :2], axis=2).mean(axis=1)
    np.testing.assert_allclose(matrix @ radius, own, atol=0.1)
    # Every host cell counts once, with its volume.
    np.testing.assert_allclose(half.volume @ matrix, host.volume, rtol=0.05)


def test_a_host_with_larger_cells_serves_too():
    fine, coarse = section(12, 24), section(3, 6)
    matrix = onto(fine, frozenset(), coarse, frozenset())
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0)
    assert np.abs(matrix @ coarse.centres - fine.centres).max() < 3.0


def test_halves_are_named_as_such():
    labels, members = zones(section(half=True), frozenset({"z"}), SHAPE)
    np.testing.assert_array_equal(members.sum(axis=1), 1.0)
    assert "near the outer bond towards the ends" in labels
    for mirrors, said in ((frozenset(), False), (frozenset({"z"}), True)):
        found = combined([seen("torsional", 0.0, 7, cells=section(half=True), mirrors=mirrors)])
        assert ("cut at z = 0" in found.map(found.gains, 1.0).text) == said


def test_a_coupon_has_no_places():
    class Coupon:
        coupon = True

    with pytest.raises(ValueError, match="no place"):
        local_map([Coupon()], {}, [], [])
