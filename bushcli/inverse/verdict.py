"""Doubts about an identification: named conditions, each with its remedy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bushcli.case.checks import moduli
from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.inverse.file_units import in_file_units
from bushcli.inverse.local import STAYED, Minimum
from bushcli.inverse.result import EndPoint, Fit, FittedCurve
from bushcli.inverse.task import Task
from bushcli.runtime.condition import CONTINUE, Condition
from cases.mode import modes
from forms.law import laws

# Principal stretches that a bushing's rubber rarely leaves: instability within them is reported.
USUAL_STRETCHES = (0.5, 2.0)
# A fit is poor if its rms misfit exceeds both this percentage of the force range and this many times the noise.
POOR_FIT, POOR_NOISE = 3.0, 3.0
# Rms misfit over the noise, itself known to 10 % with 60 samples, above which a recording is not reproduced within it.
ABOVE_NOISE = 1.5
# Two ends are equally good if their costs differ by less than this share, and distinct if a parameter differs by more
# than that one.
EQUAL_COST, DISTINCT = 0.05, 0.10
# Share of failed trials above which they are reported as a condition; the result counts them in any case.
FAILED = 0.3
# A parameter that changes by more than this share with 1 % of a channel's force is reported.
DELICATE = 0.10
# A held-out channel counts as predicted up to this rms misfit, the accepted 10 %.
PREDICTED = 10.0


def conditions(fit: Fit, task: Task, best: Minimum, interrupted: bool) -> tuple[Condition, ...]:
    """Return all conditions of a fit, the most serious first."""
    found = []
    if interrupted:
        found.append(
            Condition(
                "interrupted",
                f"stopped after {fit.sweeps} evaluations; this is the best point so far",
                "run it again" if task.source == "coupons" else CONTINUE,
            )
        )
    elif best.beside_failure:
        found.append(
            Condition(
                "beside_failure",
                "the search ended at parameters beyond which the model cannot be solved, although the misfit would "
                "fall further; the intervals come from profiles and end where the model can no longer be solved",
                _instead(task, "use a law with fewer parameters", "leave out the largest displacements"),
            )
        )
    elif not fit.converged:
        found.append(
            Condition(
                "not_converged",
                f"the search ended without a minimum: {fit.message}",
                _instead(task, "give start values in [material.parameters]"),
            )
        )
    found += _stuck(fit, best, task)
    found += _poor(fit) if task.source == "recordings" else _poor_coupons(fit, task)
    found += _above_noise(fit, task) + _tables(fit)
    found += _bounds(in_file_units(fit))
    found += _tests(fit, task)
    found += _stability(fit) + _moduli(fit)
    found += _edge(best)
    found += _undetermined(fit, task) + _not_identified(fit, task)
    found += _delicate(fit, task)
    found += _several(in_file_units(fit).end_points)
    found += _predictions(fit, task)
    if fit.failed_solves > FAILED * fit.sweeps:
        found.append(
            Condition(
                "failed_solves",
                f"{fit.failed_solves} of {fit.sweeps} trials could not be solved and made the search step back",
                "give start values nearer to the answer in [material.parameters]",
            )
        )
    return tuple(found)


def profiles_cut_short() -> Condition:
    """Return the condition that the search was complete, but the profiles were interrupted."""
    return Condition(
        "interrupted",
        "stopped after the search, while profiles were computed: intervals are missing",
        CONTINUE,
    )


def history_not_saved(reason: str) -> Condition:
    """Return the condition that the evaluations could not be saved."""
    return Condition(
        "history_not_kept",
        f"the history could not be written: {reason}; the result is complete",
        "free some space or choose another -o, so that the run can be continued",
    )


def start_replaced(instead: Mapping[str, float], task: Task) -> Condition:
    """Return the condition that the start values were unstable or could not be solved, and were replaced."""
    listed = ", ".join(f"{name} = {value:.3g}" for name, value in instead.items())
    return Condition(
        "start_replaced",
        "with the start values the law is unstable or could not be simulated; the search began with "
        f"{listed}, scaled to the curves",
        _instead(
            task,
            "nothing to do if the fit is good; otherwise give other start values in [material.parameters]",
        ),
    )


def _stuck(fit: Fit, best: Minimum, task: Task) -> list[Condition]:
    poor = any(_poorly(curve) for curve in fit.curves if not curve.held_out)
    moved = np.max(np.abs(best.x - best.start) / np.maximum(np.abs(best.start), 1e-12))
    if moved > STAYED or best.stationary or fit.iterations > 2 or not poor:
        return []
    return [
        Condition(
            "start_not_left",
            "the search did not leave its start values, although the fit is poor",
            _instead(task, "give other start values in [material.parameters]"),
        )
    ]


def _poorly(curve: FittedCurve) -> bool:
    return curve.rms_percent > POOR_FIT and curve.rms_percent > POOR_NOISE * curve.noise_percent


def _poor(fit: Fit) -> list[Condition]:
    poor = [curve for curve in fit.curves if not curve.held_out and _poorly(curve) and curve.recording.source]
    bushing = [curve for curve in poor if modes()[curve.recording.mode].specimen == "bushing"]
    if not bushing or not fit.converged:
        return []
    listed = ", ".join(f"{c.name} {c.rms_percent:.2g} % (noise {c.noise_percent:.2g} %)" for c in bushing)
    return [
        Condition(
            "poor_fit",
            f"the search found a minimum, but the curves are not reproduced: rms {listed}",
            "`bushcli diagnose` finds which physics is missing, if any; else try another law (--model all) or more "
            "starts (--starts 8)",
        )
    ]


def _poor_coupons(fit: Fit, task: Task) -> list[Condition]:
    """Report coupon tests that the law misses by more than the case accepts of a bushing that is predicted with it."""
    accepted = task.case.tolerance.percent
    poor = [
        curve for curve in fit.curves if curve.rms_percent > accepted and fit.converged and not curve.held_out
    ]
    if not poor:
        return []
    listed = ", ".join(f"{curve.name} {curve.rms_percent:.2g} %" for curve in poor)
    volumetric = [curve.name for curve in poor if modes()[curve.recording.mode].needs_compressibility]
    remedy = "try another law (--model), fit only the stretches that the bushing reaches (largest_stretch), "
    remedy += "and see in `bushcli check` whether mode, columns and units are those of the test"
    if any(curve.branch == "both" for curve in poor):
        remedy = (
            'fit one branch (branch = "loading" or "unloading"), which a law without memory can follow; '
            + remedy
        )
    if len(volumetric) == len(poor):
        remedy = "the bulk modulus is constant in the model: leave out the largest pressures, or settling at the first "
        remedy += "ones, and see in `bushcli check` how columns and units were read"
    return [
        Condition(
            "poor_fit",
            f"the law does not reproduce its own tests: rms {listed} of the recorded stress range, and {accepted:g} % "
            "is accepted",
            remedy,
        )
    ]


def _instead(task: Task, *remedies: str) -> str:
    """Return remedies as a sentence; in `inverse`, which has the option, with further starts as one more."""
    return ", or ".join((*remedies, "use --starts 8") if task.source == "recordings" else remedies)


def _not_identified(fit: Fit, task: Task) -> list[Condition]:
    """Report the parameters of the law that keep their start values, because all coupon tests are volumetric."""
    if task.source != "coupons" or not {*fit.material.parameters} <= {*task.fixed}:
        return []
    values = ", ".join(f"{name} = {value:g}" for name, value in fit.material.parameters.items())
    return [
        Condition(
            "undetermined",
            f"volumetric tests determine the bulk modulus alone; the law keeps its start values: {values}",
            "add a coupon test that changes the shape of the rubber, such as a uniaxial one",
        )
    ]


def _above_noise(fit: Fit, task: Task) -> list[Condition]:
    above = [
        curve
        for curve in fit.curves
        if not curve.held_out
        and not _poorly(curve)
        and curve.rms_percent > ABOVE_NOISE * max(curve.noise_percent, 100 * NOISE_FLOOR)
    ]
    if not above or not fit.converged or task.source != "recordings":
        return []
    listed = ", ".join(f"{c.name} {c.rms_percent:.2g} % (noise {c.noise_percent:.2g} %)" for c in above)
    return [
        Condition(
            "misfit_above_noise",
            f"the curves are reproduced closely, but not to within their noise: rms {listed}. Something small is not "
            "in the model, and the standard errors and intervals do not cover its influence on the parameters",
            "refine the mesh (bushcli direct --mesh-check), check dimensions and load cells (`leverage` says what an "
            "error of 1 % does), or let `bushcli diagnose` look for what is missing",
        )
    ]


def _tables(fit: Fit) -> list[Condition]:
    """Report fitted tables that are missed by more than their standard errors explain."""
    rig = "fixture_mass, rig_resonance, time_lag, rig_compliance"
    return [
        Condition(
            "table_above_errors",
            f"{one.table.name}: the table is missed by {one.stiffness_percent:.2g} % and {one.loss_angle_deg:.2g} "
            f"degrees (rms), its standard errors being {one.errors_in_words}",
            f'add an effect of its rig ({rig}) with channels = ["{one.table.name}"], or a branch of viscoelasticity: '
            "the plot of the table on the page shows where it is missed",
        )
        for one in fit.tables
        if not one.held_out and one.over_errors > ABOVE_NOISE
    ]


def _edge(best: Minimum) -> list[Condition]:
    if not best.at_edge:
        return []
    return [
        Condition(
            "at_stability_limit",
            "the misfit would be lower with a law that is unstable in the strained rubber: the parameters are held at "
            "the edge of stability, where standard errors are not valid and intervals are one-sided",
            "add a recording to a larger displacement or with less noise, or use a law with fewer parameters",
        )
    ]


def _bounds(fit: Fit) -> list[Condition]:
    return [
        Condition(
            "at_bound",
            f"{name} = {estimate.value:g} lies on its bound ({estimate.lower:g} to {estimate.upper:g})",
            "the fit drives it to a value without physical meaning: choose another law, or check the dimensions",
        )
        for name, estimate in fit.parameters.items()
        # A compliance of zero is a valid result: by its curves the rubber is incompressible.
        if estimate.at_bound and not (name == "compliance" and estimate.value < estimate.upper / 2)
    ]


def _tests(fit: Fit, task: Task) -> list[Condition]:
    used = {curve.recording.mode for curve in fit.curves if not curve.held_out}
    kinds = [modes()[mode] for mode in used if not modes()[mode].needs_compressibility]
    # Simple shear reaches the states of a planar test.
    elastic = list(dict.fromkeys("planar" if one.sheared else one.name for one in kinds))
    if task.source != "coupons" or task.law.basis == "I1" or len(elastic) != 1:
        return []
    what = f"{task.law.name} depends on more than I1, and only {kinds[0].name} tests are given: what it predicts "
    simple = ", ".join(one.name for one in laws().values() if one.basis == "I1")
    remedy = f"add a coupon test of another mode, or use a law in I1 alone ({simple})"
    return [Condition("one_coupon_mode", f"{what}in other modes is not determined", remedy)]


def _stability(fit: Fit) -> list[Condition]:
    found = []
    for mode, (low, high) in fit.stability.items():
        used = [(modes()[c.recording.mode], c.recording.displacement) for c in fit.curves]
        # Simple shear reaches the states of a planar test.
        reached = [one.stretch(q) for one, q in used if ("planar" if one.sheared else one.name) == mode]
        largest = max((float(r.max()) for r in reached), default=0.0)
        if high < largest:
            found.append(
                Condition(
                    "unstable_law",
                    f"the fitted law is unstable in {mode} deformation beyond stretch {high:.3g}, inside the test's "
                    "range",
                    "choose another law, or leave out the part of the test that it cannot follow (largest_stretch)",
                )
            )
        elif high < USUAL_STRETCHES[1] or low > USUAL_STRETCHES[0]:
            found.append(
                Condition(
                    "unstable_outside_data",
                    f"the fitted law is stable in {mode} deformation only between stretches {low:.3g} and {high:.3g}",
                    "do not use it beyond these stretches; `bushcli direct` checks the states that the bushing reaches",
                )
            )
    return found


def _moduli(fit: Fit) -> list[Condition]:
    return [
        Condition(
            "bulk_modulus_too_small", f"{finding.what}: {finding.expected}", "correct [material] bulk_modulus"
        )
        for finding in moduli(fit.material)
        if finding.keys[-1] == "bulk_modulus"
    ]


def _undetermined(fit: Fit, task: Task) -> list[Condition]:
    if task.source == "coupons":
        remedy = "add a coupon test of another mode or of larger stretch, or use a law with fewer parameters"
    else:
        used = {curve.recording.mode for curve in fit.curves}
        held = [curve.name for curve in fit.curves if curve.held_out]
        # Translations first, then rotations.
        known = sorted(modes().values(), key=lambda mode: (mode.rotational, mode.name))
        single = [mode for mode in known if mode.specimen == "bushing" and mode.follow is None]
        other = [f" or in mode {mode.name}" for mode in single if mode.name not in used][:1]
        again = f"fit {' and '.join(held)} as well, which was held out; " if held else ""
        remedy = f"{again}a recording to a larger displacement{''.join(other)} would determine it; or "
        remedy += "fix one of them (--fix), or use a law with fewer parameters"
    return [Condition("undetermined", combination.text, remedy) for combination in fit.undetermined]


def _delicate(fit: Fit, task: Task) -> list[Condition]:
    """Report parameters that an error of 1 % in the force of one channel would change by more than `DELICATE`."""
    if task.source == "coupons":
        return []
    worst: dict[str, tuple[float, str]] = {}
    for channel, changes in fit.leverage.items():
        for name, change in changes.items():
            # A parameter on its bound stays there, and relative to zero any change is infinite.
            if fit.parameters[name].at_bound:
                continue
            if abs(change) > DELICATE and abs(change) > abs(worst.get(name, (0.0, ""))[0]):
                worst[name] = (change, channel)
    if not worst:
        return []
    listed = ", ".join(
        f"{name} by {100 * change:+.0f} % ({channel})" for name, (change, channel) in worst.items()
    )
    return [
        Condition(
            "delicate",
            f"a force 1 % larger in one channel would change {listed}; the standard errors "
            "account for noise alone",
            "trust the curves more than these parameters; calibrate the load cell, refine the mesh (bushcli direct "
            "--mesh-check), or record larger displacements",
        )
    ]


def _several(ends: tuple[EndPoint, ...]) -> list[Condition]:
    if len(ends) < 2:
        return []
    best = ends[0]
    for end in ends[1:]:
        if end.cost > best.cost * (1 + EQUAL_COST):
            continue
        apart = {
            name: value
            for name, value in end.parameters.items()
            if abs(value - best.parameters[name]) > DISTINCT * max(abs(value), abs(best.parameters[name]))
        }
        if apart:
            listed = ", ".join(
                f"{name} {best.parameters[name]:.4g} or {value:.4g}" for name, value in apart.items()
            )
            return [
                Condition(
                    "several_minima",
                    f"distinct parameter sets fit equally well: {listed}",
                    "add another recording, or use a law with fewer parameters; these curves cannot tell them apart",
                )
            ]
    return []


def _predictions(fit: Fit, task: Task) -> list[Condition]:
    solved = {curve.name for curve in fit.curves} | {one.table.name for one in fit.tables}
    unsolved = [
        Condition(
            "held_out_not_predicted",
            f"{name}, which was held out, cannot be simulated with the identified parameters",
            "check whether the law is stable with them; use another law, or fit this channel too",
        )
        for name in task.hold_out
        if name not in solved
    ]
    return unsolved + [
        Condition(
            "held_out_not_predicted",
            f"{curve.name}, which was held out, is predicted only to {curve.rms_percent:.2g} % rms "
            f"(noise {curve.noise_percent:.2g} %)",
            "fit it too, and see which channel the law then no longer describes: something differs between them",
        )
        for curve in fit.curves
        if curve.held_out and curve.rms_percent > PREDICTED
    ]
