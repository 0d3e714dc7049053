"""Doubts about an identification: named conditions, each with its remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain

import numpy as np

from bushcli.case.checks import moduli
from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.errors import count_of
from bushcli.inverse.file_units import in_file_units
from bushcli.inverse.local import STAYED, Minimum
from bushcli.inverse.result import Fit, FittedCurve
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
#: Ratio of measured to simulated dynamic stiffness, on average, that no effect of a rig is likely to cause (judgement).
_FAR = 2.0


def history_not_saved(reason: str) -> Condition:
    """Return the condition that the evaluations could not be saved."""
    what = f"the history could not be written: {reason}; the result is complete"
    remedy = "free some space or choose another -o, so that the run can be continued"
    return Condition("history_not_kept", what, remedy)


def start_replaced(instead: Mapping[str, float], task: Task) -> Condition:
    """Return the condition that the start values were unstable or could not be solved, and were replaced."""
    listed = ", ".join(f"{name} = {value:.3g}" for name, value in instead.items())
    what = "with the start values the law is unstable or could not be simulated; the search began with "
    remedy = "nothing to do if the fit is good; otherwise give other start values in [material.parameters]"
    return Condition("start_replaced", f"{what}{listed}, scaled to the curves", _instead(task, remedy))


def conditions(fit: Fit, task: Task, best: Minimum, interrupted: bool) -> tuple[Condition, ...]:
    """Return all conditions of a fit, the most serious first."""
    doubts = _Doubts(fit, task, best)
    return tuple(
        chain(
            doubts.end(interrupted),
            doubts.start(),
            doubts.poor_curves() if task.source == "recordings" else doubts.poor_coupons(),
            doubts.misfits_above_noise(),
            doubts.tables(),
            doubts.bounds(),
            doubts.coupon_modes(),
            doubts.stability(),
            doubts.bulk_modulus(),
            doubts.edge(),
            doubts.undetermined_parameters(),
            doubts.delicate_parameters(),
            doubts.several_minima(),
            doubts.predictions(),
            doubts.failed_solves(),
        )
    )


def _misses_badly(curve: FittedCurve) -> bool:
    return curve.rms_percent > POOR_FIT and curve.rms_percent > POOR_NOISE * curve.noise_percent


def _misfits(curves: list[FittedCurve]) -> str:
    return ", ".join(f"{c.name} {c.rms_percent:.2g} % (noise {c.noise_percent:.2g} %)" for c in curves)


def _instead(task: Task, *remedies: str) -> str:
    """Return remedies as a sentence; in `inverse`, which has the option, with further starts as one more."""
    return ", or ".join((*remedies, "use --starts 8") if task.source == "recordings" else remedies)


@dataclass(frozen=True)
class _Doubts:
    """What is doubtful about a fit of a task, and about the minimum in which its search ended."""

    fit: Fit
    task: Task
    best: Minimum

    @property
    def fitted_curves(self) -> list[FittedCurve]:
        """Curves that were fitted."""
        return [curve for curve in self.fit.curves if not curve.held_out]

    def end(self, interrupted: bool) -> Iterator[Condition]:
        """How the search ended."""
        if interrupted:
            what = f"stopped after {count_of(self.fit.sweeps, 'evaluation')}; this is the best point so far"
            remedy = "run it again" if self.task.source == "coupons" else CONTINUE
            yield Condition("interrupted", what, remedy)
        elif self.best.beside_failure:
            what = "the search ended at parameters beyond which the model cannot be solved, although the misfit would "
            what += "fall further; the intervals come from profiles and end where the model can no longer be solved"
            remedies = ("use a law with fewer parameters", "leave out the largest displacements")
            yield Condition("beside_failure", what, _instead(self.task, *remedies))
        elif not self.fit.converged:
            remedy = _instead(self.task, "give start values in [material.parameters]")
            what = f"the search ended without a minimum: {self.fit.message}"
            yield Condition("not_converged", what, remedy)

    def start(self) -> Iterator[Condition]:
        """Whether the search stayed at a start that is no minimum."""
        best = self.best
        relative_change = np.max(np.abs(best.x - best.start) / np.maximum(np.abs(best.start), 1e-12))
        stayed = relative_change <= STAYED and not best.stationary and self.fit.iterations <= 2
        if stayed and any(map(_misses_badly, self.fitted_curves)):
            what = "the search did not leave its start values, although the fit is poor"
            remedy = _instead(self.task, "give other start values in [material.parameters]")
            yield Condition("start_not_left", what, remedy)

    def poor_curves(self) -> Iterator[Condition]:
        """Recordings of a bushing that are missed by far."""
        poor = [curve for curve in self.fitted_curves if _misses_badly(curve) and curve.recording.source]
        poor = [curve for curve in poor if modes()[curve.recording.mode].specimen == "bushing"]
        if poor and self.fit.converged:
            what = f"the search found a minimum, but the curves are not reproduced: rms {_misfits(poor)}"
            remedy = "`bushcli diagnose` finds which physics is missing, if any; else try another law (--model all) or "
            yield Condition("poor_fit", what, f"{remedy}more starts (--starts 8)")

    def poor_coupons(self) -> Iterator[Condition]:
        """Coupon tests that are missed by more than is accepted of a bushing that is predicted with the law."""
        accepted = self.task.case.tolerance.percent
        poor = [curve for curve in self.fitted_curves if curve.rms_percent > accepted]
        if not poor or not self.fit.converged:
            return
        remedy = 'fit one branch (branch = "loading" or "unloading"), which a law without memory can follow; '
        remedy = remedy if any(curve.branch == "both" for curve in poor) else ""
        remedy += (
            "try another law (--model), fit only the stretches that the bushing reaches (largest_stretch), "
        )
        remedy += "and see in `bushcli check` whether mode, columns and units are those of the test"
        if all(modes()[curve.recording.mode].needs_compressibility for curve in poor):
            remedy = "the bulk modulus is constant in the model: leave out the largest pressures, or settling at the "
            remedy += "first ones, and see in `bushcli check` how columns and units were read"
        listed = ", ".join(f"{curve.name} {curve.rms_percent:.2g} %" for curve in poor)
        what = f"the law does not reproduce its own tests: rms {listed} of the recorded stress range, and "
        yield Condition("poor_fit", f"{what}{accepted:g} % is accepted", remedy)

    def misfits_above_noise(self) -> Iterator[Condition]:
        """Recordings that are reproduced closely, but not to within their noise."""
        above = [curve for curve in self.fitted_curves if not _misses_badly(curve)]
        floor = 100 * NOISE_FLOOR
        above = [c for c in above if c.rms_percent > ABOVE_NOISE * max(c.noise_percent, floor)]
        if above and self.fit.converged and self.task.source == "recordings":
            what = "the curves are reproduced closely, but not to within their noise: rms "
            what += f"{_misfits(above)}. Something small is not in the model, and the standard errors and intervals "
            what += "do not cover its influence on the parameters"
            remedy = "refine the mesh (bushcli direct --mesh-check), check dimensions and load cells (`leverage` says "
            remedy += "what an error of 1 % does), or let `bushcli diagnose` look for what is missing"
            yield Condition("misfit_above_noise", what, remedy)

    def tables(self) -> Iterator[Condition]:
        """Fitted tables that are missed by more than their standard errors explain."""
        rig = "fixture_mass, rig_resonance, time_lag, rig_compliance"
        for fitted in self.fit.tables:
            name = fitted.table.name
            if not fitted.held_out and fitted.over_errors > ABOVE_NOISE:
                what = f"{name}: the table is missed by {fitted.stiffness_percent:.2g} % and "
                what += f"{fitted.loss_angle_deg:.2g} degrees (rms), its standard errors being {fitted.errors_in_words}"
                ratio = float(np.median(fitted.table.stiffness / np.abs(fitted.simulated)))
                remedy = f'add an effect of its rig ({rig}) with channels = ["{name}"], or a branch of viscoelasticity'
                remedy += ": the plot of the table on the page shows where it is missed"
                if abs(np.log(ratio)) > np.log(_FAR):
                    far = f"its stiffness is {ratio:.2g} times the simulated one: check the units of its columns"
                    remedy = f"{far}; or {remedy}"
                yield Condition("table_above_errors", what, remedy)

    def bounds(self) -> Iterator[Condition]:
        """Parameters on their bounds."""
        for name, estimate in in_file_units(self.fit).parameters.items():
            # A compliance of zero is a valid result: by its curves the rubber is incompressible.
            if estimate.at_bound and not (name == "compliance" and estimate.value < estimate.upper / 2):
                what = f"{name} = {estimate.value:g} lies on its bound ({estimate.lower:g} to {estimate.upper:g})"
                remedy = (
                    "the fit drives it to a value without physical meaning: choose another law, or check the "
                )
                yield Condition("at_bound", what, f"{remedy}dimensions")

    def coupon_modes(self) -> Iterator[Condition]:
        """Coupons of one mode, which do not determine a law that depends on more than I1."""
        kinds = [modes()[mode] for mode in {curve.recording.mode for curve in self.fitted_curves}]
        kinds = [mode for mode in kinds if not mode.needs_compressibility]
        # Simple shear reaches the states of a planar test.
        elastic = {"planar" if mode.sheared else mode.name for mode in kinds}
        law = self.task.law
        if self.task.source == "coupons" and law.basis != "I1" and len(elastic) == 1:
            what = f"{law.name} depends on more than I1, and only {kinds[0].name} tests are given: what it predicts in "
            simple = ", ".join(other.name for other in laws().values() if other.basis == "I1")
            remedy = f"add a coupon test of another mode, or use a law in I1 alone ({simple})"
            yield Condition("one_coupon_mode", f"{what}other modes is not determined", remedy)

    def stability(self) -> Iterator[Condition]:
        """Stretches of the usual ones, or of the tests, at which the law is unstable."""
        for mode, (low, high) in self.fit.stability.items():
            used = [(modes()[c.recording.mode], c.recording.displacement) for c in self.fit.curves]
            # Simple shear reaches the states of a planar test.
            used = [(test, q) for test, q in used if ("planar" if test.sheared else test.name) == mode]
            if high < max((float(test.stretch(q).max()) for test, q in used), default=0.0):
                what = f"the fitted law is unstable in {mode} deformation beyond stretch {high:.3g}, inside the test's "
                remedy = "choose another law, or leave out the part of the test that it cannot follow (largest_stretch)"
                yield Condition("unstable_law", f"{what}range", remedy)
            elif high < USUAL_STRETCHES[1] or low > USUAL_STRETCHES[0]:
                what = f"the fitted law is stable in {mode} deformation only between stretches {low:.3g} and {high:.3g}"
                remedy = "do not use it beyond these stretches; `bushcli direct` checks the states that the bushing "
                yield Condition("unstable_outside_data", what, f"{remedy}reaches")

    def bulk_modulus(self) -> Iterator[Condition]:
        """A bulk modulus that is too small beside the law."""
        for finding in moduli(self.fit.material):
            if finding.keys[-1] == "bulk_modulus":
                what = f"{finding.what}: {finding.expected}"
                yield Condition("bulk_modulus_too_small", what, "correct [material] bulk_modulus")

    def edge(self) -> Iterator[Condition]:
        """Whether the law's stability holds the parameters."""
        if self.best.at_edge:
            what = "the misfit would be lower with a law that is unstable in the strained rubber: the parameters are "
            what += "held at the edge of stability, where standard errors are not valid and intervals are one-sided"
            remedy = "add a recording to a larger displacement or with less noise, or use a law with fewer parameters"
            yield Condition("at_stability_limit", what, remedy)

    def undetermined_parameters(self) -> Iterator[Condition]:
        """Parameters that the curves do not determine."""
        remedy = "add a coupon test of another mode or of larger stretch"
        if self.task.source == "recordings":
            used = {curve.recording.mode for curve in self.fit.curves}
            held = [curve.name for curve in self.fit.curves if curve.held_out]
            # Translations first, then rotations.
            ordered = sorted(modes().values(), key=lambda mode: (mode.rotational, mode.name))
            single = [mode for mode in ordered if mode.specimen == "bushing" and mode.follow is None]
            other = [f" or in mode {mode.name}" for mode in single if mode.name not in used][:1]
            remedy = f"fit {' and '.join(held)} as well, which was held out; " if held else ""
            remedy += f"a recording to a larger displacement{''.join(other)} would determine it; or "
            remedy += "fix one of them (--fix)"
        for combination in self.fit.undetermined:
            yield Condition("undetermined", combination.text, f"{remedy}, or use a law with fewer parameters")
        parameters = self.fit.material.parameters
        if self.task.source == "coupons" and {*parameters} <= {*self.task.fixed}:
            values = ", ".join(f"{name} = {value:g}" for name, value in parameters.items())
            what = (
                f"volumetric tests determine the bulk modulus alone; the law keeps its start values: {values}"
            )
            remedy = "add a coupon test that changes the shape of the rubber, such as a uniaxial one"
            yield Condition("undetermined", what, remedy)

    def delicate_parameters(self) -> Iterator[Condition]:
        """Parameters that an error of 1 % in the force of one channel would change by more than `DELICATE`."""
        worst: dict[str, tuple[float, str]] = {}
        for channel, changes in self.fit.leverage.items():
            for name, change in changes.items():
                # A parameter on its bound stays there, and relative to zero any change is infinite.
                if self.fit.parameters[name].at_bound:
                    continue
                if abs(change) > max(DELICATE, abs(worst.get(name, (0.0, ""))[0])):
                    worst[name] = (change, channel)
        if worst and self.task.source != "coupons":
            listed = ", ".join(
                f"{n} by {100 * change:+.0f} % ({channel})" for n, (change, channel) in worst.items()
            )
            what = f"a force 1 % larger in one channel would change {listed}; the standard errors account for noise "
            remedy = "trust the curves more than these parameters; calibrate the load cell, refine the mesh (bushcli "
            remedy += "direct --mesh-check), or record larger displacements"
            yield Condition("delicate", f"{what}alone", remedy)

    def several_minima(self) -> Iterator[Condition]:
        """Another end that fits as well with other parameters."""
        best, *others = in_file_units(self.fit).end_points
        for end in others:
            apart = {
                name: (best.parameters[name], value)
                for name, value in end.parameters.items()
                if abs(value - best.parameters[name]) > DISTINCT * max(abs(value), abs(best.parameters[name]))
            }
            if apart and end.cost <= best.cost * (1 + EQUAL_COST):
                listed = ", ".join(f"{name} {a:.4g} or {b:.4g}" for name, (a, b) in apart.items())
                what, remedy = (
                    f"distinct parameter sets fit equally well: {listed}",
                    "add another recording, or use ",
                )
                remedy += "a law with fewer parameters; these curves cannot tell them apart"
                yield Condition("several_minima", what, remedy)
                return

    def predictions(self) -> Iterator[Condition]:
        """Channels held out that are not predicted."""
        names = [*(curve.name for curve in self.fit.curves), *(table.table.name for table in self.fit.tables)]
        for name in self.task.hold_out:
            if name not in names:
                what = f"{name}, which was held out, cannot be simulated with the identified parameters"
                remedy = "check whether the law is stable with them; use another law, or fit this channel too"
                yield Condition("held_out_not_predicted", what, remedy)
        for curve in self.fit.curves:
            if curve.held_out and curve.rms_percent > PREDICTED:
                what = (
                    f"{curve.name}, which was held out, is predicted only to {curve.rms_percent:.2g} % rms "
                )
                what += f"(noise {curve.noise_percent:.2g} %)"
                remedy = (
                    "fit it too, and see which channel the law then no longer describes: something differs "
                )
                yield Condition("held_out_not_predicted", what, f"{remedy}between them")

    def failed_solves(self) -> Iterator[Condition]:
        """Many trials that could not be solved."""
        failed, sweeps = self.fit.failed_solves, self.fit.sweeps
        if failed > FAILED * sweeps:
            what = f"{failed} of {sweeps} trials could not be solved and made the search step back"
            remedy = "give start values nearer to the answer in [material.parameters]"
            yield Condition("failed_solves", what, remedy)
