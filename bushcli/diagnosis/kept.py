"""Finite-element models that a process keeps from one run of a diagnosis to the next.

A diagnosis runs the same few models many times with other values. To mesh a body and to derive its forms takes as long
as half a march, so what differs in values only is made once. Effects of the rig change nothing in the body: all of them
share that of the law alone.
"""

from __future__ import annotations

import pickle
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from mpi4py import MPI

from bushcli.effect import ActiveEffect
from bushcli.inverse.channel import Channel
from bushcli.inverse.task import Task
from cases.feature import Installed
from cases.mode import Mode
from cases.model import Model as Body
from cases.simulate import Prepare, Rubber, prepare
from geometry.shape import Refinement, Shape

T = TypeVar("T")

# At a time: bodies of the law alone and of the effect at hand, each for up to three channels.
BODIES, SETS = 9, 4

_bodies: OrderedDict[bytes, Body] = OrderedDict()
_sets: OrderedDict[bytes, list[Channel]] = OrderedDict()


def channels(task: Task, fineness: float = 1.0) -> list[Channel]:
    """Channels of a task, for any values of its parameters, with `fineness` times the usual steps.

    Every solution has to be given all values: what a kept model had before is not what the task says.
    """
    name = pickle.dumps((replace(task.case, effects=()), _law(task), _structure(task.effects), fineness))

    def made() -> list[Channel]:
        found, _ = task.channels(prepared=bodies(task))
        for channel in found:
            if channel.simulation is not None and fineness != 1.0:
                channel.simulation.plan(fineness)
        return found

    return _kept(_sets, SETS, name, made)


def bodies(task: Task) -> Prepare:
    """As `cases.simulate.prepare`, for the law and effects of a task: a body that is known is not made again."""

    def body(
        shape: Shape,
        mode: Mode,
        rubber: Rubber,
        refinement: Refinement,
        comm: MPI.Comm,
        features: Sequence[Installed] = (),
    ) -> Body:
        acting = [one for one in task.effects if one.name in {item.name for item in features}]
        what = (shape, mode.name, _law(task), rubber.bulk_modulus, refinement, _structure(acting))
        return _kept(
            _bodies,
            BODIES,
            pickle.dumps(what),
            lambda: prepare(shape, mode, rubber, refinement, comm, features),
        )

    return body


def _kept(store: OrderedDict[bytes, T], most: int, name: bytes, made: Callable[[], T]) -> T:
    """The entry of that name, made if it is not there; the one that was not asked for longest goes."""
    if name not in store:
        store[name] = made()
        if len(store) > most:
            store.popitem(last=False)
    store.move_to_end(name)
    return store[name]


def _law(task: Task) -> tuple[str, tuple[str, ...]]:
    return task.law.name, tuple(task.material.parameters)


def _structure(active: Sequence[ActiveEffect]) -> list[Any]:
    """What of effects is more than values: which they are, with which parameters, and what they make of the mesh."""
    return [
        (
            one.name,
            one.channels,
            [(p.name, one.values[p.name] if p.of_mesh else None) for p in one.parameters],
        )
        for one in active
    ]
