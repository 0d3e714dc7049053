"""The recordings' forces by third-order elements on finer meshes, and those of the diagnosis' default model.

The finer model has displacement of third order and pressure of second order on the default mesh (solid) or on one with
half as many elements again in each direction (half-plane), and with memory a step per sample. The default model has
second-order elements, and for memory the steps that the tool would choose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.truth import Specimen
from bushcli.effects.active import ActiveEffect, effects_on_channel
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law
from geometry.shape import Refinement, Shape
from geometry.shapes.plain import Plain
from geometry.shapes.tapered import Tapered

Array = NDArray[np.float64]


class FinePlain(Plain):
    """Plain, with third-order elements."""

    displacement_order: ClassVar[int] = 3


class FineTapered(Tapered):
    """Tapered, with third-order elements."""

    displacement_order: ClassVar[int] = 3


SHAPES: Mapping[bool, Mapping[str, type[Shape]]] = {
    False: {"plain": Plain, "tapered": Tapered},
    True: {"plain": FinePlain, "tapered": FineTapered},
}
# Noise that is practically zero, but lets the tool choose its steps.
NOISELESS = 1e-12


@dataclass(frozen=True)
class Channel:
    """A channel's program: name (and mode), time (s) and displacement (mm or rad) at the samples, shape (n,)."""

    name: str
    time: Array
    displacement: Array


def force(
    specimen: Specimen,
    channel: Channel,
    active: Sequence[ActiveEffect] = (),
    *,
    finer: bool,
    names: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
) -> tuple[Array, Array]:
    """Force (n,) at the samples, and its derivatives (n, parameters) by the named parameters.

    Parameters
    ----------
    names, values
        Parameters of the law and "effect.parameter"; values that replace those of specimen and effects.

    Raises
    ------
    NotConverged
    NoEquilibrium
    """
    mode = modes()[channel.name]
    shape = SHAPES[finer][specimen.shape](**dict[str, Any](specimen.dimensions))
    solid = mode.section is None
    refinement = Refinement(factor=1.5) if finer and not solid else Refinement()
    rubber = Rubber(law(specimen.law), specimen.parameters, specimen.bulk_modulus)
    simulation = Simulation(
        shape,
        mode,
        rubber,
        refinement,
        effects_on_channel(active, channel.name, mode.name),
        channel.time,
        channel.displacement,
        None if finer else NOISELESS,
    )
    answer = simulation.solve(values or {}, tuple(names))
    return answer.force, answer.slope
