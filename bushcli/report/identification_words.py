"""An identification in sentences: agreement with the curves, parameters, and what the curves determine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.inverse import Estimate, Fit, FittedCurve
from bushcli.inverse.certainty import UNDETERMINED
from bushcli.inverse.file_units import parameter_unit
from bushcli.inverse.result import POOR
from bushcli.inverse.verdict import POOR_FIT, POOR_NOISE, PREDICTED
from bushcli.report.data_faults import faulty_data
from bushcli.report.quantity import listed, number, percent, with_std

# A curve is met to its noise if the misfit is at most this multiple of the noise, which is an estimate itself.
MET = 1.3
# Largest number of parameters in the headline; more would obscure it.
_IN_HEADLINE = 3


@dataclass(frozen=True)
class IdentificationVerdict:
    """The verdict on an identification.

    Attributes
    ----------
    headline : str
        One clear sentence, without its full stop.
    lines : tuple of str
        Sentences with its consequences.
    tone : {"good", "bad", "plain"}
        Curves met to their noise, not met, in between.
    """

    headline: str
    lines: tuple[str, ...]
    tone: Literal["good", "bad", "plain"]


def answer(fit: Fit) -> IdentificationVerdict:
    """Return the verdict on an identification in words."""
    fitted = [curve for curve in fit.curves if not curve.held_out]
    values = listed([f"{name} = {with_error(fit, name)}" for name in fit.parameters])
    misfits = ", ".join(f"{curve.name} {percent(curve.rms_percent)}" for curve in fitted)
    them = "The curve is" if len(fitted) == 1 else "The curves are"
    tone: Literal["good", "bad", "plain"]
    if any(fault.fatal for fault in fit.faults):
        # Neither the misfit nor the standard errors say anything about the rubber.
        told = f"The law was fitted to these data ({misfits} rms): its values do not describe the rubber."
        return IdentificationVerdict(faulty_data(fit.faults), (told,), "bad")
    if not fitted:
        met, tone = "There is no fitted curve", "bad"
    elif not fit.converged:
        met, tone = (
            f"The search did not converge; the best point so far reproduces the curves to {misfits} rms",
            "bad",
        )
    elif all(is_met(curve) for curve in fitted):
        noise = "its noise" if len(fitted) == 1 else "their noise"
        met, tone = f"{them} reproduced to within {noise} ({misfits})", "good"
    elif any(is_poor(curve) for curve in fitted):
        off = [f"{c.name} {percent(c.rms_percent)}, noise {percent(c.noise_percent)}" for c in fitted]
        met, tone = f"{them} not reproduced ({'; '.join(off)})", "bad"
    else:
        off = [f"{c.name} {percent(c.rms_percent)}, noise {percent(c.noise_percent)}" for c in fitted]
        met, tone = (
            f"{them} reproduced closely, not to within {'its' if len(fitted) == 1 else 'their'} noise "
            f"({'; '.join(off)})",
            "plain",
        )
    if len(fit.parameters) > _IN_HEADLINE:
        return IdentificationVerdict(met, (f"{values}.", *_lines(fit)), tone)
    return IdentificationVerdict(f"{met}: {values}", tuple(_lines(fit)), tone)


def is_met(curve: FittedCurve) -> bool:
    """Whether the noise explains the misfit."""
    return bool(curve.rms_percent <= MET * max(np.nan_to_num(curve.noise_percent), 100 * NOISE_FLOOR))


def is_poor(curve: FittedCurve) -> bool:
    """Whether the misfit is so large that the law does not describe the curve."""
    return curve.rms_percent > POOR_FIT and curve.rms_percent > POOR_NOISE * np.nan_to_num(
        curve.noise_percent
    )


def is_uncertain(estimate: Estimate) -> bool:
    """Whether the standard error is so large that the value is poorly determined."""
    return not estimate.std <= POOR * abs(estimate.value)


def with_error(fit: Fit, name: str) -> str:
    """Return value, standard error and unit, as many digits as the error permits: "0.1175 ± 0.0002 MPa".

    Parameters
    ----------
    fit : Fit
        The identified law.
    name : str
        Full name of the parameter.
    """
    estimate = fit.parameters[name]
    unit = parameter_unit(fit, name)
    tail = "" if unit == "1" else f" {unit}"
    return f"{with_std(estimate.value, estimate.std)}{tail}"


def _lines(fit: Fit) -> list[str]:
    lines = []
    poor = [name for name, estimate in fit.parameters.items() if is_uncertain(estimate)]
    if poor and fit.converged:
        lines.append(
            f"{listed(poor)} {'is' if len(poor) == 1 else 'are'} poorly determined: the standard error exceeds "
            f"{100 * POOR:.0f} % of the value."
        )
    for curve in fit.curves:
        if curve.held_out:
            good = curve.rms_percent <= PREDICTED
            lines.append(
                f"{curve.name}, held out, is {'' if good else 'not '}predicted: {percent(curve.rms_percent)} rms "
                f"(noise {percent(curve.noise_percent)})."
            )
    if "compliance" in fit.parameters:
        bulk = bulk_modulus(fit)
        lines.append(
            f"Bulk modulus: {bulk}{' MPa' if bulk[-1].isdigit() else ''}, from the identified compliance."
        )
    return lines


def bulk_modulus(fit: Fit) -> str:
    """Return the identified bulk modulus, MPa; its lower limit if the rubber may be incompressible."""
    found = fit.parameters["compliance"]
    if found.value > 2 * found.std:
        return number(1 / found.value, 3)
    limit = found.value + 2 * found.std
    return f"above {number(1 / limit, 2)}" if limit > 0 else "not determined"


def determined(fit: Fit) -> list[str]:
    """Return a sentence on what the curves determine, judged by the singular values."""
    values = np.asarray(fit.singular_values)
    if not len(values):
        return []
    good = int(np.sum(values >= UNDETERMINED))
    shown = ", ".join(number(float(value), 2) for value in values)
    of = len(values)
    what = (
        f"{'Both' if of == 2 else f'All {of}'} combinations of the parameters are determined"
        if good == of and of > 1
        else "The parameter is determined"
        if good == of
        else f"{good} of {of} combinations of the parameters are determined"
    )
    return [f"{what} (relative singular values {shown}; below {UNDETERMINED:g} a combination is left open)."]


def search(fit: Fit) -> list[str]:
    """Return a line on how the result was found."""
    failed = f" ({fit.failed_solves} failed)" if fit.failed_solves else ""
    starts = f", {len(fit.end_points)} starts" if len(fit.end_points) > 1 else ""
    return [
        f"{fit.method}: {'converged' if fit.converged else 'not converged'} after {fit.iterations} iterations{starts}, "
        f"{fit.sweeps} evaluations{failed}, {fit.forward_solves} simulations of one channel, {fit.seconds:.1f} s"
        + (f" ({fit.message.rstrip('.').replace('`', '')})" if fit.message and not fit.converged else "")
    ]
