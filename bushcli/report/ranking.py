"""Ranking of laws: by their prediction of held-out channels, or else by an information criterion."""

from __future__ import annotations

import numpy as np

from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.inverse import Fit, FittedCurve
from bushcli.inverse.certainty import autocorrelation_time
from bushcli.report.document import Array

# Degree of the smooth curve through a recording: higher than any law without history needs over the displacement.
_SMOOTH = 9


def rank(fit: Fit) -> tuple[bool, bool, float, int]:
    """Return the sort key of an identified law; the best law is the first.

    A law that converged precedes one that did not. If channels were held out, their mean rms misfit decides:
    the law is needed for predictions, and a prediction cannot be overfitted. A law that could not be solved on them
    comes last. Otherwise `information_criterion` decides; the number of parameters breaks a tie.

    All laws must have been identified from the same recordings.
    """
    held_out = [curve.rms_percent for curve in fit.curves if curve.held_out]
    score = float(np.mean(held_out)) if held_out else information_criterion(fit)
    return not fit.converged, not held_out, score if np.isfinite(score) else np.inf, len(fit.parameters)


#: Difference of the information criterion that is strong evidence (Kass and Raftery).
CLEAR = 6.0


def information_criterion(fit: Fit) -> float:
    """Return the Bayesian information criterion N ln(cost) + p ln N; lower is better.

    `cost` is the mean over the fitted channels of (rms misfit / noise)^2, as the identification minimises it. Its
    logarithm means that the remaining misfit is treated as the noise: where no law meets the recordings, a law with
    a slightly smaller misfit is not favoured as much as if the misfit were white noise of known standard deviation.
    Misfit and noise count as at least 0.1 % of the force range, because no recording is more accurate.

    `N` is the effective number of samples. It must not depend on the law: a poor law, whose misfit is correlated
    along the whole curve, would have few effective samples and therefore a good score. It is calculated from the part
    of the recording that no law without history can follow: the recording less a smooth curve in the displacement.

    References
    ----------
    Schwarz (1978), Estimating the dimension of a model, Annals of Statistics 6:461-464, doi:10.1214/aos/1176344136.
    Kass, Raftery (1995), Bayes factors, J. Am. Stat. Assoc. 90:773-795, doi:10.1080/01621459.1995.10476572.
    """
    curves = [curve for curve in fit.curves if not curve.held_out]
    if not curves:
        return float("nan")
    floor = 100 * NOISE_FLOOR
    ratios = [max(c.rms_percent, floor) / max(np.nan_to_num(c.noise_percent), floor) for c in curves]
    count = sum(effective_samples(curve) for curve in curves)
    cost = float(np.mean(np.square(ratios)))
    return count * float(np.log(cost)) + len(fit.parameters) * float(np.log(count))


def effective_samples(curve: FittedCurve) -> float:
    """Return the effective number of independent samples, from the recording alone."""
    q, force = curve.recording.displacement, curve.recording.force
    degree = min(_SMOOTH, max(len(np.unique(q)) - 2, 0))
    centre, half = (q.max() + q.min()) / 2, max(float(np.ptp(q)) / 2, 1e-300)
    basis = np.polynomial.chebyshev.chebvander((q - centre) / half, degree)
    residual: Array = force - basis @ np.linalg.lstsq(basis, force, rcond=None)[0]
    # The residual of a noise-free recording is rounding and a wavy error of the polynomial, not noise.
    if float(np.sqrt(np.mean(residual**2))) < 0.1 * NOISE_FLOOR * float(np.ptp(force)):
        return float(len(q))
    return len(q) / autocorrelation_time(residual)
