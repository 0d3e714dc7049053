"""Contact in a prediction: where surfaces met, and what follows for a mesh that several processes share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mpi4py import MPI

from bushcli.runtime.condition import Condition
from cases.contact.touch import touches
from cases.passing import passes_through

if TYPE_CHECKING:
    from bushcli.case import Case
    from cases.march import History
    from cases.model import FiniteElementModel


@dataclass(frozen=True)
class SurfaceContact:
    """Two surfaces that met in a march.

    Attributes
    ----------
    surfaces : tuple of str
        Names of the boundaries; the same name twice if one met itself.
    first : float
        Displacement of the first step with contact, mm or rad (s on a path of six motions).
    force : float
        Largest force between them at a step, N, of the whole bushing: the pressure integrated over the area.
    at : float
        Displacement of that step.
    radius, height : float
        Mean position of that force in the deformed body: distance from the axis, and z, mm.
    """

    surfaces: tuple[str, str]
    first: float
    force: float
    at: float
    radius: float
    height: float


def surfaces_that_met(model: FiniteElementModel, history: History) -> tuple[SurfaceContact, ...]:
    """Return which surfaces met at the steps of a march, in the order in which they did."""
    contact = model.surfaces.contact
    if contact is None or history.states is None:
        return ()
    model.take_parameters()
    met: dict[tuple[str, str], SurfaceContact] = {}
    for q, state in zip(history.displacement, history.states, strict=False):
        for touch in touches(contact, state):
            pair, force, at = touch.surfaces, touch.force * model.multiplicity, float(q)
            if pair not in met or force > met[pair].force:
                first = met[pair].first if pair in met else at
                met[pair] = SurfaceContact(pair, first, force, at, touch.radius, touch.height)
    return tuple(met.values())


def processes_sharing_mesh(case: Case, comm: MPI.Comm) -> MPI.Comm:
    """Return the processes that share a mesh: only this one if the case file asks for contact.

    Otherwise surfaces that can meet are shared at first, and solved again where they do (`met_unnoticed`).
    """
    shape = case.geometry
    if comm.size == 1 or not (shape.contact_surfaces and "contact" in shape.model_fields_set):
        return comm
    return MPI.COMM_SELF


def met_unnoticed(
    case: Case, model: FiniteElementModel, history: History, whole_model: Callable[[], FiniteElementModel]
) -> bool:
    """Whether surfaces passed through each other in a march on a mesh that several processes share."""
    if model.comm.size == 1 or not case.geometry.contact_surfaces or history.states is None:
        return False
    return passes_through(model, history.states, whole_model)


def not_shared(met: Mapping[str, Sequence[SurfaceContact]], comm: MPI.Comm) -> list[Condition]:
    """Return the condition that channels were solved by each process alone, if there are any."""
    names = ", ".join(name for name, touched in met.items() if touched)
    if comm.size == 1 or not names:
        return []
    what = f"surfaces meet ({names}), and contact is modelled in one process only: each process solved the whole mesh"
    return [Condition("not_shared", what, "nothing to do; mpirun saves no time here")]
