"""Contact in a prediction: where surfaces met, and where it cannot be modelled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bushcli.errors import InputError, Problem
from bushcli.runtime.condition import Condition
from cases.contact.touch import touches

if TYPE_CHECKING:
    from mpi4py import MPI

    from bushcli.case import Case
    from cases.march import History
    from cases.model import Model


@dataclass(frozen=True)
class Touched:
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


def touched(model: Model, history: History) -> tuple[Touched, ...]:
    """Return which surfaces met at the steps of a march, in the order in which they did.

    Parameters
    ----------
    model : Model
        Model with the parameters of the march; its state is not changed.
    history : History
        March with its states.
    """
    contact = model.surfaces.contact
    if contact is None or history.states is None:
        return ()
    model.take_parameters()
    met: dict[tuple[str, str], Touched] = {}
    for q, state in zip(history.displacement, history.states, strict=False):
        for one in touches(contact, state):
            known = met.get(one.surfaces)
            force, here = one.force * model.multiplicity, float(q)
            if known is None or force > known.force:
                first = here if known is None else known.first
                met[one.surfaces] = Touched(one.surfaces, first, force, here, one.radius, one.height)
    return tuple(met.values())


def parallel_contact(case: Case, comm: MPI.Comm) -> list[Condition]:
    """Return the condition that contact is left out, if several processes share the mesh.

    Parameters
    ----------
    case : Case
        The validated case.
    comm : MPI.Comm
        Processes that share a mesh.

    Raises
    ------
    InputError
        The case file asks for contact.
    """
    shape = case.geometry
    if comm.size == 1 or not shape.meeting:
        return []
    # Pairs of facets on different ranks have no place in a distributed matrix yet.
    if "contact" in shape.model_fields_set:
        what = f"contact = {shape.meeting!r} needs all of the mesh in one process".lower()
        raise InputError(Problem("mpirun", what, "", "run it without mpirun, or with contact = false"))
    return [
        Condition(
            "no_contact",
            f"the mesh is shared by {comm.size} processes, where contact is not modelled: surfaces that meet pass "
            "through each other",
            "run without mpirun if surfaces can meet at this travel; contact = false in [geometry] acknowledges it",
        )
    ]
