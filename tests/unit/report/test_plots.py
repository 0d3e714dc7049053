"""Which curves, axes and labels a result is shown by; no picture is drawn here."""

from dataclasses import replace

import numpy as np
import pytest

from bushcli.curve.curve import Curve
from bushcli.effects.titles import title
from bushcli.inverse import FittedCurve
from bushcli.recording import Recording
from bushcli.report.plots.certainty import prior_panels, probability_panels
from bushcli.report.plots.diagnosis import curve_plot, diagnosed_panels, time_plot
from bushcli.report.plots.direct import around, curve_panels, six_panels, smooth
from bushcli.report.plots.fit import fit_panels, fitted_panels
from bushcli.report.plots.places import missing_panels, program, record_panels
from bushcli.report.quantity import largest_reactions
from bushcli.simulate.response import SixCurve


def labels(plot):
    return [one.label for one in (*plot.bands, *plot.regions, *plot.series) if one.label]


def extent(region, axis=0):
    points = np.concatenate(region.outlines)[:, axis]
    return points.min(), points.max()


# -- a direct prediction, a fit ----------------------------------------------------------------------------------------


def test_a_stopped_march_is_marked(channel):
    (plot,) = curve_panels(channel("axial", 100.0, stopped="DIVERGED_MAX_IT"), None, "axial").rows[0]
    assert "simulation stopped" in labels(plot)


def test_the_band_lies_ten_percent_of_the_force_range_around_the_recording(answer, channel):
    found = answer(channel("axial", 130.0, 100.0))
    (simulated,) = found.response.channels
    (curves,), (difference,) = curve_panels(simulated, found.misfits["axial"], "axial").rows
    # Recorded from -400 to 400 N: the band is 80 N on either side.
    assert extent(curves.regions[0], 1) == pytest.approx((-480.0, 480.0))
    assert difference.bands[0].y == (-10.0, 10.0)
    # 130 N/mm against 100 N/mm at 4 mm, in percent of 800 N.
    assert np.abs(difference.series[0].y).max() == pytest.approx(15.0)
    assert curves.x == difference.x


def test_axes_carry_units(channel):
    (plot,) = curve_panels(channel("conical"), None, "conical").rows[0]
    assert plot.labels == ("rotation [deg]", "moment [N mm]")


def test_a_model_is_drawn_over_its_recording(answer, channel):
    """A dense recording must not hide the model's curve."""
    found = answer(channel("axial", 130.0, 100.0))
    (plot,) = curve_panels(found.response.channels[0], found.misfits["axial"], "axial").rows[0]
    assert [one.key for one in plot.series] == ["recorded", "after"]


def test_instability_is_shaded(fit):
    plots = [plot for row in fit_panels(fit).rows for plot in row]
    assert ["law unstable" in labels(plot) for plot in plots] == [True, True, False]


def test_the_curve_before_the_fit_is_drawn_in_the_order_of_time():
    """A loop that is drawn by its displacement is a saw-tooth."""
    q, force = np.array([0.0, 1.0, 2.0, 1.0, 0.0, 1.0]), np.array([0.0, 10.0, 20.0, 5.0, -5.0, 8.0])
    before = Curve("axial", q, force)
    fitted = FittedCurve("axial", Recording("axial", q, force), before, 1.0, before, 2.0)
    (plot,) = fitted_panels(fitted, "axial").rows[0]
    (line,) = [one for one in plot.series if one.key == "before"]
    assert (line.x.tolist(), line.y.tolist()) == (q.tolist(), force.tolist())


def test_a_curve_that_turns_back_is_drawn_through_its_own_points():
    curve = Curve("axial", [0.0, 1.0, 0.0], [0.0, 2.0, 0.5])
    q, force = smooth(curve)
    assert q.tolist() == [0.0, 1.0, 0.0]
    assert force.tolist() == [0.0, 2.0, 0.5]


def test_reactions_that_are_rounding_errors_are_not_drawn():
    """Of a path with a free tilt the only moment is what Newton's method leaves of zero."""
    time = np.array([0.0, 1.0, 2.0])
    motion, force = np.zeros((3, 6)), np.zeros((3, 6))
    motion[:, 0], motion[:, 4] = time, 0.01 * time
    force[:, 0], force[:, 4] = 1000.0 * time, [0.0, 1.5e-6, -0.8e-6]
    rows = six_panels("path", SixCurve(time, motion, force, free=(4,), lead=0), "path").rows
    assert [labels(plot) for row in rows for plot in row] == [["ux"], ["ry (free)"], ["fx"], []]
    force[:, 4] = 1.0 * time
    assert largest_reactions(force) == (2000.0, 2.0)


# -- a diagnosis -------------------------------------------------------------------------------------------------------


def test_areas_lie_between_recording_and_plain_law(case, diagnoses):
    found = diagnoses.diagnosis(case())
    (one,) = found.channels
    regions = curve_plot(found, one).regions
    assert [region.number for region in regions] == list(range(1, len(found.location.mismatch) + 1))
    assert {region.key for region in regions} == {"stiff", "soft"}
    first = found.location.mismatch[0]
    points = np.concatenate(regions[0].outlines)
    force = np.concatenate([one.recording.force, one.before])
    assert np.isin(points[:, 1], force).all()
    # Areas begin and end with the mismatch.
    assert points[:, 0].max() == pytest.approx(first.displacement_to)
    assert points[:, 0].min() >= first.displacement_from


def test_areas_that_overlap_are_one(case, diagnoses):
    # The outlines of loading and unloading would have opposite senses, and cut holes into each other.
    found = diagnoses.diagnosis(case())
    for region in curve_plot(found, found.channels[0]).regions:
        for x, y in (outline.T for outline in region.outlines):
            assert x @ np.roll(y, -1) - y @ np.roll(x, -1) >= 0


def enclosed(region):
    """Area of all outlines, each by itself."""
    return sum((x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2 for x, y in (part.T for part in region.outlines))


def test_an_area_on_the_way_there_and_back_is_not_cancelled(case, diagnoses):
    """If the model is twice as stiff everywhere, the outline of the whole path would enclose nothing."""
    _, q = diagnoses.program([3.0, 6.0], 0.5)
    force = 100.0 * q
    one = replace(
        diagnoses.channel(),
        recording=Recording("axial", q, force, name="axial"),
        before=2 * force,
        after=force,
        path=q,
        faulty=np.zeros(len(q), dtype=bool),
    )
    found = diagnoses.diagnosis(case(), channels=(one,))
    (region,) = curve_plot(found, one).regions
    assert found.location.mismatch[0].samples.all()
    # A triangle of area q * 100 q / 2 on loading and one on unloading.
    assert enclosed(region) == pytest.approx(2 * (50 * 3**2 + 50 * 6**2))


def test_curves_of_several_channels_are_told_apart(case, diagnoses):
    found = diagnoses.rivalling(case())
    for plot in (curve_plot, time_plot):
        assert plot(found, found.channels[1]).heading == "radial (held out)"
    alone = diagnoses.diagnosis(case())
    assert curve_plot(alone, alone.channels[0]).heading == ""


def test_the_misfit_is_in_percent(case, diagnoses):
    found = diagnoses.diagnosis(case())
    (one,) = found.channels
    plot = time_plot(found, one)
    for series, expected in zip(plot.series, (one.before_percent, one.after_percent), strict=True):
        assert np.sqrt(np.mean(series.y**2)) == pytest.approx(expected)
    (noise,) = plot.bands
    assert noise.y == pytest.approx((-2 * one.noise_percent, 2 * one.noise_percent))


def test_faulty_samples_are_marked_and_belong_to_no_line(case, diagnoses):
    found = diagnoses.rivalling(case())
    one = found.channels[0]
    curve, misfit = curve_plot(found, one), time_plot(found, one)
    assert [series.key for series in curve.series] == ["recorded", "before", "after", "left_out"]
    assert np.isnan(curve.series[0].y[one.faulty]).all()
    assert np.isfinite(curve.series[3].y).sum() == 3
    assert all(np.isnan(series.y[one.faulty]).all() for series in misfit.series)
    # A single sample and two neighbours, marked from the midpoint before them to the midpoint after them.
    t = one.recording.time
    assert [band.x for band in misfit.bands if band.key == "faulty"] == [
        pytest.approx((t[a - 1 : a + 1].mean(), t[b : b + 2].mean())) for a, b in ((40, 40), (90, 91))
    ]
    # The spikes do not extend the axis.
    assert misfit.y[1] < 20.0


def test_faulty_samples_that_no_pixel_parts_are_one_band(case, diagnoses):
    n = 20_000
    q = np.sin(np.linspace(0.0, 6.0, n))
    one = replace(
        diagnoses.channel(),
        recording=Recording("axial", q, 100 * q, np.arange(n) / 100.0, name="axial"),
        before=100 * q,
        after=100 * q,
        path=q,
        faulty=np.isin(np.arange(n), [*range(5000, 5040, 2), 12000]),
    )
    found = diagnoses.diagnosis(case(), channels=(one,))
    bands = [band for band in time_plot(found, one).bands if band.key == "faulty"]
    assert [band.x for band in bands] == [pytest.approx(x) for x in ((49.995, 50.385), (119.995, 120.005))]


def test_one_curve_is_drawn_where_nothing_was_changed(case, diagnoses):
    found = diagnoses.diagnosis(case(), "explained")
    plot = curve_plot(found, found.channels[0])
    assert [one.key for one in plot.series] == ["recorded", "before"]
    assert plot.regions == []


def test_a_plot_without_time_counts_samples(case, diagnoses):
    found = diagnoses.torsional(case())
    plot = time_plot(found, found.channels[0])
    assert plot.labels[0] == "sample"
    assert plot.series[0].x[0] == 1


def test_a_law_that_runs_away_leaves_the_picture(case, diagnoses):
    found = diagnoses.diagnosis(case())
    (one,) = found.channels
    wild = replace(one, before=50.0 * one.before)
    low, high = diagnosed_panels(replace(found, channels=(wild,)), wild, "axial").rows[0][0].y
    assert high - low < 2.5 * np.ptp(one.recording.force)


def test_the_record_is_mapped_before_and_after_on_one_scale(case, diagnoses):
    found = diagnoses.diagnosis(case())
    plots = [plot for row in record_panels(found, found.channels[0], "axial").rows for plot in row]
    assert [plot.heading for plot in plots] == [
        "plain law: loading",
        "plain law: unloading",
        "most probable model: loading",
        "most probable model: unloading",
    ]
    assert len({plot.scale for plot in plots}) == 1
    assert (
        len(plots[0].regions)
        == len(plots[2].regions)
        == sum(b.branch == "loading" for b in found.location.bins)
    )
    # Where the misfit is noise, hardly any bin is marked.
    dots = [len(plot.series[0].x) for plot in plots]
    assert dots[0] > 10 * dots[2]


def test_a_bar_is_as_long_as_its_probability(case, diagnoses):
    ((plot,),) = probability_panels(diagnoses.rivalling(case())).rows
    ends = [extent(one)[1] for one in plot.regions if one.key != "bar_ground"]
    assert ends == pytest.approx([99.4, 67.0, 31.0, 5.0, 2.1])
    expected = [title(name) for name in ("mullins", "friction", "viscoelasticity", "offset", "unknown")]
    assert [name for _, name in plot.y_names] == expected
    assert [note.text for note in plot.notes] == ["> 99 %", "67 %", "31 %", "5 %", "2 %"]


def test_each_value_lies_beside_its_prior(case, diagnoses):
    rows = prior_panels(diagnoses.rivalling(case())).rows
    assert len(rows) == 5
    prior, posterior = rows[0][0].regions
    assert extent(prior) == pytest.approx((0.02, 0.6))
    assert extent(posterior) == pytest.approx((0.296, 0.328))
    assert [plot.log for (plot,) in rows[:3]] == ["x", "x", ""]


def test_a_prior_of_the_absolute_value_lies_on_both_sides(case, diagnoses):
    (first,), (second,), *_ = prior_panels(diagnoses.torsional(case())).rows
    assert [extent(part) for part in zip_outlines(first.regions[0])] == [(0.0, 60.0), (-60.0, 0.0)]
    # 0.01 rad; a value that is positive has no second side.
    assert len(second.regions[0].outlines) == 1
    assert extent(second.regions[0])[1] == pytest.approx(0.57296, abs=1e-5)


def zip_outlines(region):
    """Return a region for each outline."""
    return [replace(region, outlines=[outline]) for outline in region.outlines]


def test_what_is_missing_is_drawn_by_all_that_it_may_depend_on(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained")
    (one,) = found.channels
    plots = [p for row in missing_panels(one, found.missing.profiles, "axial").rows for p in row]
    assert [plot.labels[0] for plot in plots] == ["displacement [mm]", "time [s]", "cycle", "rate [mm/s]"]
    loading = found.missing.profiles[0]
    assert extent(plots[0].regions[0], 1)[1] == pytest.approx((loading.mean + 2 * loading.std).max())
    assert labels(plots[0]) == ["loading", "unloading"]


@pytest.mark.parametrize("alongs", [("cycle",), ("displacement", "time", "cycle")])
def test_panels_without_a_profile_are_left_out(case, diagnoses, alongs):
    found = diagnoses.diagnosis(case(), "unexplained")
    own = [one for one in found.missing.profiles if one.along in alongs]
    rows = missing_panels(found.channels[0], own, "axial").rows
    assert sum(len(row) for row in rows) == len(alongs)


def test_angles_of_what_is_missing_are_degrees(case, diagnoses):
    found = diagnoses.torsional(case())
    plot = missing_panels(found.channels[0], found.missing.profiles, "torsional").rows[0][0]
    assert plot.labels[0] == "rotation [deg]"
    assert plot.series[0].x.max() == pytest.approx(22.918, abs=1e-3)


def test_the_program_of_a_test_takes_its_time(diagnoses):
    time, q = program(diagnoses.NEXT)
    # 6 mm at 0.5 mm/s twice, at 5 mm/s twice, two holds of 60 s.
    assert time[-1] == pytest.approx(12 + 60 + 12 + 1.2 + 60 + 1.2)
    assert list(q) == [0, 6, 6, 0, 6, 6, 0]


@pytest.mark.parametrize("x", [np.array([0.0, 1.0, 3.0]), np.array([3.0, 1.0, 0.0])])
def test_bands_of_both_directions_have_the_same_sense(x):
    """Otherwise the bands of loading and unloading, filled together, would take each other away."""
    at, y = around(x, np.zeros(3), np.ones(3)).T
    assert 0.5 * float(at @ np.roll(y, -1) - y @ np.roll(at, -1)) == pytest.approx(3.0)
