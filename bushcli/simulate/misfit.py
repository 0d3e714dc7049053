"""How far a simulated curve is from its recording.

Both are compared at the recorded displacements that the simulation reached, and the difference is referred
to the recorded force range there, so that curves of different bushings can be compared. The literature
accepts a simulated stiffness within 10 %; a case may ask for another tolerance (`bushcli.case.tolerance`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.case.tolerance import DEFAULT, Tolerance
from bushcli.curve.curve import Curve
from bushcli.curve.misfit import peak_percent, rms_percent

if TYPE_CHECKING:
    from bushcli.simulate.response import Response, Simulated

Array = NDArray[np.float64]

# A misfit over fewer samples has no meaning.
FEWEST = 5


@dataclass(frozen=True)
class Stiffness:
    """Initial and secant (peak to peak) stiffness, N/mm or N mm/rad; `bushcli.curve.curve` has the definitions."""

    initial: float
    secant: float


@dataclass(frozen=True)
class Misfit:
    """A simulated channel against its recording.

    Attributes
    ----------
    channel : str
    displacement, difference : shape (n,)
        Compared displacements (mm or rad) and simulated minus recorded force (N or N mm).
    simulated : shape (n,)
        Simulated force at the recorded displacements.
    force_range : float
        Recorded force range over the compared displacements, N or N mm.
    rms_percent, peak_percent : float
        Root mean square and largest difference, percent of the force range.
    noise_percent : float
        Noise of the recording itself (1 sigma), percent of the force range.
    measured, predicted : Stiffness
        Stiffness of the recorded and of the simulated curve, over the same displacements.
    compared : float
        Share of the recorded samples that the simulation reached.
    tolerance : Tolerance
        Band within which the simulation is accepted.
    """

    channel: str
    displacement: Array
    difference: Array
    simulated: Array
    force_range: float
    rms_percent: float
    peak_percent: float
    noise_percent: float
    measured: Stiffness
    predicted: Stiffness
    compared: float
    tolerance: Tolerance = DEFAULT

    @property
    def stiffness_ratio(self) -> float:
        """Simulated over measured secant stiffness."""
        return self.predicted.secant / self.measured.secant

    @property
    def within(self) -> bool:
        """Whether secant stiffness and curve are within the tolerance, and all of the recording was reached."""
        return self.within_band(self.tolerance)

    @property
    def within_10_percent(self) -> bool:
        """As `within`, for 10 % whatever the tolerance."""
        return self.within_band(DEFAULT)

    def within_band(self, tolerance: Tolerance) -> bool:
        """Whether the secant stiffness is within a tolerance, and the curve within that share of the force range."""
        return bool(
            abs(self.stiffness_ratio - 1.0) <= tolerance.band
            and self.peak_percent <= tolerance.percent
            and self.compared == 1.0
        )


def misfit(channel: Simulated, tolerance: Tolerance = DEFAULT) -> Misfit:
    """Return the misfit between a simulated channel and its recording.

    Raises
    ------
    ValueError
        The channel has no recording, or the simulation reached too few of its samples.
    """
    recording = channel.recording
    if recording is None:
        raise ValueError(f"channel {channel.name} has no recording")
    curve, compared = Curve(recording.mode, recording.displacement, recording.force, recording.time), 1.0
    simulated = channel.curve.force
    if not channel.along:
        backbone = channel.curve.backbone()
        slack = 0.01 * float(np.ptp(curve.displacement))
        low, high = backbone.displacement[0] - slack, backbone.displacement[-1] + slack
        in_range = (curve.displacement >= low) & (curve.displacement <= high)
        if np.count_nonzero(in_range) < 3:
            raise ValueError(
                f"channel {channel.name}: the simulation ended before the recording's third sample"
            )
        time = None if curve.time is None else curve.time[in_range]
        curve = Curve(curve.mode, curve.displacement[in_range], curve.force[in_range], time)
        # The tolerance of `at` is a share of the simulated range, which may be much shorter than the recorded one.
        tolerated = slack / float(np.ptp(backbone.displacement)) * 1.001
        simulated, compared = backbone.at(curve.displacement, tolerance=tolerated), float(np.mean(in_range))
    difference = simulated - curve.force
    force_range = float(np.ptp(curve.force))
    return Misfit(
        channel=channel.name,
        displacement=curve.displacement,
        difference=difference,
        simulated=simulated,
        force_range=force_range,
        rms_percent=rms_percent(difference, curve.force),
        peak_percent=peak_percent(difference, curve.force),
        noise_percent=100 * recording.force_noise / force_range,
        measured=stiffness(curve),
        predicted=stiffness(Curve(curve.mode, curve.displacement, simulated, curve.time)),
        compared=compared,
        tolerance=tolerance,
    )


def misfits(response: Response) -> dict[str, Misfit]:
    """Return the misfit of every channel with a recording of which enough samples were simulated, by channel name."""
    by_channel = {}
    for channel in response.channels:
        if channel.recording is None:
            continue
        q, simulated = channel.recording.displacement, channel.curve.displacement
        # A recorded displacement may lie beyond the simulated ends because of noise.
        slack = 0.01 * float(np.ptp(q))
        in_range = (q >= simulated.min() - slack) & (q <= simulated.max() + slack)
        if np.count_nonzero(in_range) >= FEWEST:
            by_channel[channel.name] = misfit(channel, response.case.tolerance)
    return by_channel


def stiffness(curve: Curve) -> Stiffness:
    """Return initial and secant stiffness of a curve."""
    return Stiffness(curve.initial_stiffness(), curve.secant_stiffness())
