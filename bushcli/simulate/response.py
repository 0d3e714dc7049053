"""Result of a prediction: its curves, and the doubts about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import Curve, ExactCurve
from bushcli.curve.earlier import not_from_rest
from bushcli.effects.names import readable_name
from bushcli.runtime.condition import Condition
from cases.history import Interrupted
from cases.load import LIMIT_POINT
from cases.mode import modes
from cases.six import PAIR_MODES
from forms.law import laws

if TYPE_CHECKING:
    from bushcli.case import Case, Material
    from bushcli.curve.earlier import Earlier
    from bushcli.faults import DataFault
    from bushcli.recording import Recording
    from bushcli.simulate.contact import SurfaceContact
    from bushcli.simulate.strains import Strains
    from cases.march import Attempt
    from cases.stretches import Surface

Array = NDArray[np.float64]

# Share of the way within which distorted elements are attributed to the assembly: the first step of five (judgement).
AT_ONCE = 0.2
# Force at rest over the force range above which the zero of a rig matters: as large as a load cell's error, 0.5 to 1 %.
AT_REST = 0.01
# Volume ratio of a coupon, or its reciprocal, beyond which the law no longer describes a rubber: with 2000 MPa in bulk
# it takes 200 MPa, and in tension rubber cavitates at some 2.5 times its shear modulus (Gent and Lindley 1959,
# doi:10.1098/rspa.1959.0016); a tenth is judgement.
SWOLLEN = 1.1
# Elements of the finer mesh of a mesh check over those of the mesh in use, in each direction. The edges of the bonds
# reduce convergence to about first order, for which the error is twice the change that halving the elements makes
# (measured against converged curves: 1.4 to 2.6 times).
FINER, ERROR_OVER_CHANGE = 2.0, 2.0

# Remedies where rubber folds over the edge of a bond, radially from 40 % of its thickness on (docs/contact.md); and
# where it is already to meet the sleeves beyond its bonds.
LONGER_SLEEVES = (
    "; where the rubber folds over the edges of its bonds and rigid sleeves continue beyond these, set "
    'geometry.contact = "sleeves"'
)
OVERHANGING = (
    '; where the rubber overhangs a bond, geometry.contact = "sleeves" places the sleeve inside the rubber: '
    "omit this setting, or draw the sleeve as a body"
)

Progress = Callable[[str, int, int, int, float], None]
"""Called with channel, step, number of steps, Newton iterations, displacement (mm or rad)."""


@dataclass(frozen=True)
class SixCurve:
    """Motions and reactions of the inner sleeve along a path.

    Attributes
    ----------
    time : shape (n,)
        s.
    motion, force : shape (n, 6)
        mm and rad; N and N mm, on the sleeve, about its centre, in axes that do not turn.
    free : tuple of int
        Motions that are not prescribed.
    loaded : tuple of int
        Those of them whose force is prescribed.
    lead : int
        The motion that does most of the work.
    """

    time: Array
    motion: Array
    force: Array
    free: tuple[int, ...]
    lead: int
    loaded: tuple[int, ...] = ()

    def follows(self, k: int) -> str:
        """Return in words how a motion follows, where it is not prescribed."""
        return "" if k not in self.free else " (by force)" if k in self.loaded else " (free)"

    @property
    def mode(self) -> str:
        """The mode whose displacement and force are the leading motion and its reaction."""
        return PAIR_MODES[self.lead]

    @property
    def curve(self) -> Curve:
        """Reaction of the leading motion over that motion, with at least two points."""
        k = self.lead
        if len(self.time) < 2:
            return Curve(self.mode, np.array([0.0, 1e-9]), np.zeros(2))
        return ExactCurve(self.mode, self.motion[:, k], self.force[:, k], self.time)


@dataclass(frozen=True)
class Simulated:
    """One simulated channel.

    Attributes
    ----------
    name, mode : str
    curve : Curve
        At the steps of the march, as far as it went.
    recording : Recording or None
        The measured curve to compare with.
    attempts
        Every step tried.
    stopped : str
        Why the march could not go on; empty when it reached its end.
    reach : float
        Last displacement in equilibrium, mm or rad, when it stopped early.
    target : float
        Displacement that it had to reach.
    unknowns : int
        Size of the linear systems.
    strained : Strains
        Strains of the rubber at the checked steps.
    seconds : mapping
        Time of "mesh_and_forms" and "march".
    surface : Surface or None
        For pictures, at the largest displacement; on rank 0 only.
    mesh_error : float or None
        Estimated discretisation error, percent of the force range, when a mesh check was asked for.
    step_error : float or None
        Estimated error of following the recorded path in steps (rms), percent of the force range; None where the force
        does not depend on the path.
    in_time : bool
        `reach`, `target` and the surface's displacement are times on a path of six motions, s.
    along : bool
        The curve is the force at the recording's samples, one by one.
    unwritten : str
        Why its fields could not be written; empty if they were, or were not requested.
    six : SixCurve or None
        Motions and reactions on a path of six motions; ``mode`` and ``curve`` are then those of the leading motion.
    stiffness : mapping of str to (float, (6, 6) array), or None
        Displacement (mm, rad; s of a path) and stiffness matrix (N, mm, rad) by state, "start", "end" and "at"; None
        if the march without planes of symmetry did not reach its end.
    unrelaxed, state : bool, str
        Whether the matrices are those in a sudden step; the state in words, empty where no effect fades.
    touched : tuple of SurfaceContact
        Surfaces that met at the steps of the march.
    before : Earlier or None
        The path before the recording that was assumed, where the rubber remembers it.
    by_force : bool
        Its force was prescribed.
    largest : (float, float) or None
        Where the march did not reach a prescribed force: displacement (mm, rad) and force (N, N mm) nearest to it.
    """

    name: str
    mode: str
    curve: Curve
    recording: Recording | None
    attempts: tuple[Attempt, ...]
    stopped: str
    reach: float
    target: float
    unknowns: int
    strained: Strains
    seconds: Mapping[str, float]
    surface: Surface | None = field(default=None, repr=False)
    mesh_error: float | None = None
    step_error: float | None = None
    in_time: bool = False
    along: bool = False
    unwritten: str = ""
    six: SixCurve | None = None
    stiffness: Mapping[str, tuple[float, Array]] | None = field(default_factory=dict)
    unrelaxed: bool = False
    state: str = ""
    touched: tuple[SurfaceContact, ...] = ()
    before: Earlier | None = None
    by_force: bool = False
    largest: tuple[float, float] | None = None

    @property
    def newton(self) -> int:
        """Number of Newton iterations of the whole march."""
        return sum(attempt.newton for attempt in self.attempts)


@dataclass(frozen=True)
class Response:
    """Result of a prediction: simulated channels, conditions (doubts about them), and faults of the recordings."""

    case: Case
    material: Material
    channels: tuple[Simulated, ...]
    conditions: tuple[Condition, ...]
    faults: tuple[DataFault, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether every march reached its end."""
        return not any(channel.stopped for channel in self.channels)


class PredictionInterrupted(KeyboardInterrupt):
    """The user interrupted a prediction; `response` has the channels so far, of the last one the part simulated."""

    def __init__(self, response: Response) -> None:
        self.response = response
        super().__init__("the prediction was interrupted")


def conditions(case: Case, channel: Simulated) -> list[Condition]:
    """Return what is doubtful about a channel: an early end, distorted elements, an unstable law, a coarse mesh."""
    folded = OVERHANGING if case.geometry.contact_surfaces == "sleeves" else LONGER_SLEEVES
    acting = [active.effect for active in case.effects if active.acts_on(channel.name, channel.mode)]
    acts = {effect.acts for effect in acting}
    # An effect of the rig, such as an offset, may give a force at rest as well.
    assembled = _of_the_assembly(channel) if "assembly" in acts and "rig" not in acts else []
    assembly = " and ".join(readable_name(effect.name) for effect in acting if effect.acts == "assembly")
    conditions, strained = [*_of_the_march(case, channel, folded, assembly), *assembled], channel.strained
    if strained.unstable > 0:
        what = f"{channel.name}: the law violates Drucker's stability in {100 * strained.unstable:.2g} % of the states "
        what += f"that the rubber reaches (principal stretches {strained.range[0]:.2f} to {strained.range[1]:.2f})"
        remedy = "fit to coupons that reach these stretches, or choose a law that is stable there (yeoh with C30 > 0)"
        conditions.append(Condition("unstable_law", what, remedy))
    if channel.stiffness is None:
        what = f"{channel.name}: no stiffness matrix, since the march of the body without planes of symmetry stopped"
        conditions.append(Condition("no_stiffness_matrix", what, "set a smaller displacement, or more steps"))
    if channel.unwritten:
        what = f"{channel.name}: the field file could not be written ({channel.unwritten}); the curve is complete"
        remedy = "free some space and run again, or use another -o; --no-fields leaves fields out"
        conditions.append(Condition("fields_not_written", what, remedy))
    if channel.mesh_error is not None and channel.mesh_error > 1.0:
        suggested = f"suggests an error of {channel.mesh_error:.2g} % of the force range"
        suggested = suggested if np.isfinite(channel.mesh_error) else "does not get as far"
        what = f"{channel.name}: a mesh {FINER:g} times as fine in each direction {suggested}"
        remedy = "raise mesh.elements_across, elements_along and elements_around"
        conditions.append(Condition("coarse_mesh", what, remedy))
    conditions += _left_out(case, channel)
    if channel.before is not None:
        conditions.append(not_from_rest(channel.name, channel.before))
    return conditions


def _left_out(case: Case, channel: Simulated) -> list[Condition]:
    """Return which effects a result lacks because they act on the curve of a single motion."""
    acting = [active for active in case.effects if active.acts_on(channel.name, channel.mode)]
    acting = [active for active in acting if active.effect.feature is None]
    results = ["its stiffness matrices"] if channel.stiffness else []
    results += ["its reactions"] if channel.in_time and channel.recording is None else []
    if channel.by_force:
        acting = [active for active in acting if active.effect.rig and active.effect.rig.parallel is None]
    names = " and ".join(readable_name(active.name) for active in acting)
    if not acting or not (channel.by_force or results):
        return []
    if channel.by_force:
        # The force acts on the bushing itself.
        what = f"{channel.name}: its force is prescribed at the bushing, whose curve is without {names}"
        remedy = "prescribe the travel where the curve that the rig would log is wanted"
    else:
        act = f"{'they act' if len(acting) > 1 else 'it acts'} on the curve of one motion"
        what = f"{channel.name}: {' and '.join(results)} are those without {names}: {act}"
        remedy = (
            "simulate the motions one by one (modes axial, radial, torsional, conical), or change the law's "
        )
        remedy += "parameters"
    return [Condition("effect_left_out", what, remedy)]


def _of_the_assembly(channel: Simulated) -> list[Condition]:
    """Return a condition if the assembled part exerts a force at rest, which a rig would have zeroed."""
    q, force, stiffness = channel.curve.displacement, channel.curve.force, channel.curve.initial_stiffness()
    small = abs(force[0]) <= AT_REST * float(np.ptp(force))
    if channel.in_time or q[0] != 0.0 or not abs(stiffness) > 0.0 or small:
        return []
    rotational = modes()[channel.mode].rotational
    unit, kind, factor = ("deg", "N mm", 180.0 / np.pi) if rotational else ("mm", "N", 1.0)
    # Where the curve carries no force: the nearest place on it, else along the slope at rest.
    order = np.argsort(q, kind="stable")
    x, y = q[order], force[order]
    (crossing,) = np.nonzero((y[:-1] * y[1:] <= 0.0) & (np.diff(y) != 0.0))
    crossings = x[crossing] - y[crossing] * (x[crossing + 1] - x[crossing]) / (y[crossing + 1] - y[crossing])
    free = factor * float(min(crossings, key=abs) if len(crossings) else -force[0] / stiffness)
    from bushcli.effects.effect import effects  # here: few parts are loaded before they move

    zero, rig = next(
        (item, item.rig) for item in effects().values() if item.rig is not None and item.rig.zero
    )
    shift = next(p.name for p in zero.amplitudes if p.unit == "mm" and p.name != rig.zero)
    what = f"{channel.name}: the assembled part is asymmetric and exerts {force[0]:.4g} {kind} before it is loaded; "
    what += f"without load its inner sleeve would settle at about {free:.3g} {unit}"
    remedy = (
        f"if the rig was set to zero on the free part, add the effect {zero.name} with {shift} = {-free:.3g}"
    )
    return [Condition("force_at_rest", what, remedy)]


def _force_not_reached(case: Case, channel: Simulated, q: float, force: float) -> Condition:
    """Return how near a march came to a prescribed force: q in mm or rad, force in N or N mm."""
    rotational = modes()[channel.mode].rotational
    travel = f"{np.degrees(q):.4g} deg" if rotational else f"{q:.4g} mm"
    kind = "N mm" if rotational else "N"
    if q == 0.0:
        what = f"{channel.name}: the first step towards the prescribed force found no equilibrium ({channel.stopped})"
        usual, remedy = usual_force(case, channel.mode), "prescribe a smaller force"
        if usual is not None:
            remedy += f", for instance force = {float(f'{usual:.1g}'):g} ({kind})"
        return Condition("not_converged", what, remedy)
    what = f"{channel.name}: the prescribed force was not reached: the largest found is {force:.5g} {kind} at {travel}"
    further = 1.2 * (float(np.degrees(q)) if rotational else q)
    remedy = f"prescribe the travel instead, for instance amplitude = {further:.2g}, to see the curve"
    if channel.stopped == LIMIT_POINT:
        what += (
            ", a limit point: beyond it the force falls with the travel, and the bushing would snap through"
        )
        remedy = f"prescribe less, or {remedy} beyond the limit point"
    else:
        what += f"; beyond it the march found no equilibrium ({channel.stopped})"
        remedy = f"prescribe less, set more steps, or {remedy}"
    return Condition("not_converged", what, remedy)


def usual_force(case: Case, mode: str) -> float | None:
    """Return the force (N, N mm) of a usual travel by the closed forms; None without them, or without parameters.

    Parameters
    ----------
    case : Case
    mode : str
    """
    from bushcli.faults.scale import USUAL, unit_stiffness  # it loads the units of recordings

    stiffness, annulus, parameters = (
        unit_stiffness(case.geometry, mode),
        case.geometry.annulus,
        case.material.parameters,
    )
    if stiffness is None or annulus is None or not parameters:
        return None
    travel = USUAL * (1.0 if modes()[mode].rotational else annulus.thickness)
    return stiffness[0] * laws()[case.material.law].shear_modulus(**parameters) * travel


def _of_the_volume(channel: Simulated) -> list[Condition]:
    """Return a condition if a coupon's volume changes as no rubber's does, unless its mode prescribes the volume."""
    low, high = channel.strained.volumes
    if modes()[channel.mode].needs_compressibility or max(high, 1.0 / low) <= SWOLLEN:
        return []
    change = 100.0 * max(high - 1.0, 1.0 - low)
    what = f"{channel.name}: the volume of the rubber changes by {change:.2g} % (ratios of {low:.3g} to {high:.3g})"
    what += ": its law has become as stiff as its bulk modulus, which is the same at all strains"
    remedy = (
        "leave material.bulk_modulus out (an incompressible rubber), or give a larger one, or stretch it less"
    )
    return [Condition("changed_volume", what, remedy)]


def _of_the_march(case: Case, channel: Simulated, folded: str, assembly: str) -> list[Condition]:
    """Return how far the march went, and how far its elements can be trusted."""
    conditions, strained = [], channel.strained
    unit, factor = ("deg", 180.0 / np.pi) if modes()[channel.mode].rotational else ("mm", 1.0)
    unit, factor = ("s of the path", 1.0) if channel.in_time else (unit, factor)
    reached = f"{channel.reach * factor:.4g} {unit} on the way to {channel.target * factor:.4g} {unit}"
    if channel.stopped == Interrupted.reason:
        what = f"{channel.name}: interrupted at {reached}; the curve ends there"
        conditions.append(Condition("interrupted", what, "run it again"))
    elif channel.stopped and channel.largest is not None:
        conditions.append(_force_not_reached(case, channel, *channel.largest))
    elif channel.stopped:
        what = f"{channel.name}: no equilibrium beyond {reached} ({channel.stopped}); the curve ends there"
        remedy = f"set a smaller displacement, more steps or a coarser mesh{folded}"
        conditions.append(Condition("not_converged", what, remedy))
    if modes()[channel.mode].specimen == "coupon":
        conditions += _of_the_volume(channel)
    elif strained.distorted is not None:
        where = f"at {abs(strained.distorted) * factor:.4g} {unit}"
        if assembly and abs(strained.distorted) < AT_ONCE * abs(channel.target):
            where, folded = f"{where}, after the assembly ({assembly}),", ""
        what = f"{channel.name}: {where} some rubber elements are distorted (volume ratios of "
        what += (
            f"{strained.volumes[0]:.2g} to {strained.volumes[1]:.2g} on the whole curve); from there on, or "
        )
        what += "somewhat before, the force depends on the mesh"
        remedy = f"compare with a finer mesh (--mesh-check){folded}"
        conditions.append(Condition("distorted_elements", what, remedy))
    return conditions
