"""Memory of the whole bushing: the models of vehicle dynamics, force over displacement and time.

All take samples (n,) of time, displacement or elastic force. Steps between samples are divided where a formula needs
short steps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Steps between two samples, for models that are integrated numerically.
FINE = 20


def power_law(time: Array, force: Array, share: float, exponent: float, shortest: float) -> Array:
    """A spring-pot on the elastic force: relaxation falls with a power of time (fractional derivative).

    The kernel share (t / shortest)^-exponent, from `shortest` (s) to three times the recording, as a sum of
    exponentials, four in each decade.

    References
    ----------
    Sjoeberg and Kari (2002), Non-linear behavior of a rubber isolator system using fractional derivatives, Vehicle
    Syst. Dyn. 37:217-236, doi:10.1076/vesd.37.3.217.3532.
    """
    decades = np.log10(3 * time[-1] / shortest)
    tau = np.geomspace(shortest, 3 * time[-1], int(np.ceil(4 * decades)) + 1)
    weight = tau**-exponent * np.log(tau[1] / tau[0])
    # t^-a = integral of tau^(-a) exp(-t / tau) d(ln tau) over Gamma(a); a factor at t = shortest corrects for the
    # truncation.
    weight = share * weight / float(weight @ np.exp(-shortest / tau)) * 1.0
    state, forces = np.zeros(len(tau)), np.zeros(len(time))
    for i in range(1, len(time)):
        x = (time[i] - time[i - 1]) / tau
        state = np.exp(-x) * state + weight * -np.expm1(-x) / x * (force[i] - force[i - 1])
        forces[i] = state.sum()
    return forces


def berg(q: Array, most: float, half: float) -> Array:
    """Berg's friction: `most` (N) after a long travel in one direction, half of it after `half` (mm) from rest.

    References
    ----------
    Berg (1998), A non-linear rubber spring model for rail vehicle dynamics analysis, Vehicle Syst. Dyn. 30:197-212,
    doi:10.1080/00423119808969447.
    """
    forces = np.zeros(len(q))
    start_q, start_f, way, force = q[0], 0.0, 0.0, 0.0
    for i in range(1, len(q)):
        step = q[i] - q[i - 1]
        if step != 0.0:
            if way * step < 0.0:
                start_q, start_f = q[i - 1], force
            way = step
            x, mu = q[i] - start_q, start_f / most
            if step > 0:
                force = start_f + x / (half * (1 - mu) + x) * (most - start_f)
            else:
                force = start_f + x / (half * (1 + mu) - x) * (most + start_f)
        forces[i] = force
    return forces


def bouc_wen(q: Array, most: float, reach: float, power: float, lean: float) -> Array:
    """Bouc and Wen's hysteresis: dz = dq (1 - |z|^power (lean sign(dq z) + 1 - lean)) / reach; the force is most z.

    References
    ----------
    Wen (1976), Method for random vibration of hysteretic systems, J. Eng. Mech. Div. 102:249-263.
    """
    z, forces = 0.0, np.zeros(len(q))
    for i in range(1, len(q)):
        step = (q[i] - q[i - 1]) / FINE
        for _ in range(FINE):
            z += step / reach * (1 - abs(z) ** power * (lean * np.sign(step * z) + 1 - lean))
        forces[i] = most * z
    return forces


def iwan(q: Array, most: float, reach: float, count: int = 30) -> Array:
    """Sliders in parallel behind springs of equal stiffness; their slip forces are evenly distributed up to a maximum.

    References
    ----------
    Iwan (1966), A distributed-element model for hysteresis and its steady-state dynamic response, J. Appl. Mech.
    33:893-900, doi:10.1115/1.3625199.
    """
    slip = reach * 2 * (np.arange(count) + 0.5) / count
    spring = np.zeros(count)
    forces = np.zeros(len(q))
    for i in range(1, len(q)):
        spring = np.clip(spring + q[i] - q[i - 1], -slip, slip)
        forces[i] = spring.sum()
    return most * forces / slip.sum()


def running(q: Array) -> tuple[Array, Array]:
    """Largest positive and largest negative displacement so far."""
    return np.maximum.accumulate(np.maximum(q, 0)), np.minimum.accumulate(np.minimum(q, 0))


def set_saturating(q: Array, share: float, way: float) -> Array:
    """Rest position that creeps towards a share of the excursions as the bushing is moved: exp(-path / way)."""
    high, low = running(q)
    rest, rests = 0.0, np.zeros(len(q))
    for i in range(1, len(q)):
        step = abs(q[i] - q[i - 1])
        rest += (share * (high[i] + low[i]) - rest) * -np.expm1(-step / way)
        rests[i] = rest
    return rests


def set_power(q: Array, share: float, amplitude: float, exponent: float) -> Array:
    """Rest position that grows with a power of the excursions."""
    high, low = running(q)
    return share * amplitude * ((high / amplitude) ** exponent - (-low / amplitude) ** exponent)


def low_pass(time: Array, force: Array, delay: float) -> Array:
    """Force behind a filter of first order with this time constant (s)."""
    forces = np.zeros(len(force))
    for i in range(1, len(time)):
        x = (time[i] - time[i - 1]) / delay
        slope = (force[i] - force[i - 1]) / x
        # Exact for a force that is linear between the samples.
        forces[i] = force[i] - slope + (forces[i - 1] - force[i - 1] + slope) * np.exp(-x)
    return forces
