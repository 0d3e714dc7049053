"""Simulates the curve of a shape in a mode: mesh, model and march in one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from cases.feature import Installed
from cases.history import Interrupted
from cases.march import TOLERANCE, History, NotConverged, Observer, Progress, march
from cases.mode import Mode, setting_for
from cases.model import FiniteElementModel
from cases.program import Program
from cases.snubber import plates
from cases.stretches import principal_stretches
from forms.law import Law
from geometry.mesh import build
from geometry.shape import Mirrors, Refinement, Shape

Array = NDArray[np.float64]

# A recording that ends this close to rest, as a share of its range, is not worth a march of its own on that side.
NEGLIGIBLE = 0.01
DEFAULT = Refinement()


@dataclass(frozen=True)
class Rubber:
    """A law with its parameters (MPa) and bulk modulus (MPa, infinite = incompressible)."""

    law: Law
    parameters: Mapping[str, float]
    bulk_modulus: float = np.inf


def prepare(
    shape: Shape,
    mode: Mode,
    rubber: Rubber,
    refinement: Refinement = DEFAULT,
    comm: MPI.Comm = MPI.COMM_WORLD,
    features: Sequence[Installed] = (),
) -> FiniteElementModel:
    """Mesh the shape as the mode's symmetry allows, in the half-plane where both are axisymmetric.

    Parameters
    ----------
    shape : Shape
        The body.
    mode : Mode
        Mode of deformation.
    rubber : Rubber
        Law, parameters and bulk modulus.
    refinement : Refinement
        Number of elements in each direction.
    comm : MPI.Comm
        Ranks that take part.
    features : Sequence[Installed]
        Further changes of the rubber and the assembly.
    """
    dimension = 2 if mode.section is not None and shape.axisymmetric else 3
    mirrors = setting_for(mode, dimension).mirrors & symmetries(shape, features)
    if "z" in setting_for(mode, dimension).mirrors & shape.mirror_planes - mirrors:
        # The change by the features must not be mixed with that by another mesh.
        refinement = replace(refinement, doubled=True)
    # A bond that may end inside the body needs elements there; where it does not, both meshes have the same force
    # within 0.05 % (`geometry.ring.PARTLY_BONDED`).
    if any(installed.feature.released for installed in features):
        refinement = replace(refinement, partly_bonded=True)
    for installed in features:
        if installed.feature.shape is not None:
            shape = installed.feature.shape(shape, installed.values)
    mesh = build(shape, dimension, mirrors, refinement, comm)
    features = [*features, *plates(shape)]
    return FiniteElementModel(mesh, mode, rubber.law, rubber.parameters, rubber.bulk_modulus, features)


Prepare = Callable[..., FiniteElementModel]
"""A function with the arguments of `prepare`, for callers that reuse models made before."""


def symmetries(shape: Shape, features: Sequence[Installed] = ()) -> Mirrors:
    """Return the planes of symmetry of a shape that its features do not break.

    Parameters
    ----------
    shape : Shape
        The body.
    features : Sequence[Installed]
        Further changes of the rubber and the assembly.
    """
    planes = shape.mirror_planes
    for component in (*features, *plates(shape)):
        planes -= component.breaks
    return planes


def is_odd(shape: Shape, mode: Mode, features: Sequence[Installed] = ()) -> bool:
    """Whether the force reverses with the displacement, so that one side of the curve determines the other.

    Parameters
    ----------
    shape : Shape
        The body.
    mode : Mode
        Mode of deformation.
    features : Sequence[Installed]
        Further changes of the rubber and the assembly.
    """
    return mode.reversed_by is not None and mode.reversed_by in symmetries(shape, features)


def even_targets(lower: float, upper: float, steps: int) -> Array:
    """Return displacements from `lower` to `upper` through zero: `steps` on the longer side, fewer on the other.

    A side that ends within `NEGLIGIBLE` of the range from rest is left out; the other sides get at least four steps.

    Parameters
    ----------
    lower : float
        Least displacement, mm or rad.
    upper : float
        Largest displacement, mm or rad.
    steps : int
        Number of steps.
    """
    largest = max(upper, -lower)
    sides = [end for end in (lower, upper) if abs(end) > NEGLIGIBLE * (upper - lower)]
    parts = [np.linspace(0.0, end, max(4, int(np.ceil(steps * abs(end) / largest))) + 1) for end in sides]
    return np.unique(np.concatenate([[0.0], *parts]))


def sweep(
    model: FiniteElementModel,
    targets: Array,
    *,
    tolerance: float = TOLERANCE,
    keep_states: bool = False,
    sensitivity: Sequence[str] = (),
    progress: Progress | None = None,
    observer: Observer | None = None,
    failure_limit: int | None = None,
) -> History:
    """Curve of a path-independent body: from rest outward to the targets on each side.

    Parameters
    ----------
    model : FiniteElementModel
        Prepared model.
    targets : Array
        Displacements, mm or rad, in any order; rest is added where it is missing.
    tolerance : float
        Residual at which an equilibrium is accepted, over the norm of the reactions: a ratio.
    keep_states, sensitivity, progress, failure_limit
        As in `march`, for each side.
    observer : Observer | None
        Called at each target, at rest once for each side.

    Returns
    -------
    History
        Ordered by displacement, each target once, with the rubber's stretches at the ends.

    Raises
    ------
    NotConverged, Interrupted
        One side could not be followed to its end; carries both sides as far as they went.
    """
    sides, histories, stretches = _sides(targets), list[History](), list[Array]()
    failure: NotConverged | Interrupted | None = None
    for number, side in enumerate(sides):
        try:
            history = march(
                model,
                Program(side),
                tolerance=tolerance,
                keep_states=keep_states,
                sensitivity=sensitivity,
                progress=_progress(progress, sum(map(len, sides[:number])), sum(map(len, sides))),
                observer=observer,
                failure_limit=failure_limit,
            )
            stretches.append(principal_stretches(model).reshape(-1, 3))
        except (NotConverged, Interrupted) as stopped:
            failure, history = stopped, stopped.history
        histories.append(history)
        if isinstance(failure, Interrupted):
            break
    joined = replace(_join(histories), stretches=tuple(stretches))
    if failure is None:
        return joined
    raise failure.with_history(joined) from failure


def _sides(targets: Array) -> list[Array]:
    """Return the targets below and above rest, each from rest outward."""
    targets = np.unique(np.append(targets, 0.0))
    return [side for side in (targets[targets <= 0][::-1], targets[targets >= 0]) if len(side) > 1]


def _progress(progress: Progress | None, steps_before: int, total: int) -> Progress | None:
    """Return a callback that adds the number of steps on the previous sides to the step's number."""
    if progress is None:
        return None
    return lambda step, _, newton, q: progress(steps_before + step, total, newton, q)


def _join(histories: Sequence[History]) -> History:
    """Join histories into one that is ordered by displacement and contains the state at rest once."""
    q = np.concatenate([h.displacement for h in histories])
    _, order = np.unique(q, return_index=True)

    def column(name: str) -> Array | None:
        parts = [getattr(h, name) for h in histories]
        return None if any(p is None for p in parts) else np.concatenate(parts)[order]

    return History(
        displacement=q[order],
        force=np.concatenate([h.force for h in histories])[order],
        time=None,
        energy=np.concatenate([h.energy for h in histories])[order],
        newton=np.concatenate([h.newton for h in histories])[order],
        attempts=tuple(a for h in histories for a in h.attempts),
        states=column("states"),
        sensitivity=column("sensitivity"),
    )
