"""Rates of a design and their derivatives by dimensions, by parameters of the law, and by other keys.

The force at an equilibrium is Q = R(x; s) . v for every v that equals the sleeves' motion on the constrained unknowns,
since the residual R vanishes on the free ones. With v = dx/dq, for which the tangent's work on every free change of
the state vanishes, a dimension s enters by the residual's own derivative alone,

    dQ/ds = v . dR/ds   at the same state,

wherever the motion of the sleeves does not depend on their position: in axial and radial modes. dR/ds is a difference
of two residuals on slightly moved meshes (`geometry.morph`), without another solution; it is exact to about nine
digits. Derivatives by parameters of the law come from the march. All others are central differences of marches.

References
----------
Haftka and Guerdal (1992), Elements of Structural Optimization, chapter 7, doi:10.1007/978-94-011-2550-5
(semi-analytical shape derivatives).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.simulate.bodies import PreparedModels
from bushcli.simulate.predict import rubber_of
from bushcli.study.target import Target
from bushcli.study.task import DesignCache, StudyTask
from cases.equilibrium import Equilibrium
from cases.load import PrescribedForce
from cases.march import march
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.program import path
from cases.sensitivity import Sensitivity
from cases.snubber import plates
from geometry.shape import Shape

Array = NDArray[np.float64]

# Travel of an initial stiffness, as a share of the rubber's thickness or in rad: the secant over it equals the tangent
# at rest to 1e-6 (the curves are odd), and the march's tolerance leaves an error of 1e-8 of the force.
SMALL = 1e-4
# Thickness of the rubber, mm, of a shape that does not define it.
USUAL_GAP = 10.0
# Steps to a travel.
STEPS = 8
# Relative change of a key for a difference of residuals on moved meshes, and for a difference of marches.
HAIR, NUDGE = 1e-5, 1e-3
PARAMETERS = "material.parameters."


@dataclass(frozen=True)
class TargetRates:
    """Values of targets, shape (targets,), in internal units, and derivatives by keys, shape (targets, keys)."""

    value: Array
    slope: Array


def rates(
    cache: DesignCache,
    task: StudyTask,
    targets: Sequence[Target],
    values: Sequence[float],
    by: Sequence[str] = (),
) -> TargetRates:
    """Return the rates of a design.

    Raises
    ------
    InputError, GeometryError
        The case is not valid with these values.
    NotConverged
    """
    case, material = task.load(values, cache.tables)
    value, slope = np.zeros(len(targets)), np.full((len(targets), len(by)), np.nan)
    # By key the shapes with a slightly smaller and larger dimension, and the difference of the dimension.
    shapes: dict[str, tuple[Shape, Shape, float]] = {}
    for i, key in enumerate(task.keys):
        translated = any(not modes()[target.mode].rotational for target in targets)
        if key in by and key.startswith("geometry.") and translated and not plates(case.geometry):
            hair = HAIR * max(abs(values[i]), 1e-3)
            ends = (_with_change(values, i, step * hair) for step in (-1.0, 1.0))
            sides = [task.load(end, cache.tables)[0].geometry for end in ends]
            shapes[key] = (sides[0], sides[1], 2.0 * hair)
    names = {key: key.removeprefix(PARAMETERS) for key in by if key.startswith(PARAMETERS)}
    of_law = {key: name for key, name in names.items() if name in material.parameters}
    for i, target in enumerate(targets):
        value[i], derivatives = _rate(
            cache.bodies, case, material, target, {} if modes()[target.mode].rotational else shapes, of_law
        )
        for j, key in enumerate(by):
            slope[i, j] = derivatives.get(key, np.nan)
    for j, key in enumerate(by):
        missing = np.flatnonzero(np.isnan(slope[:, j]))
        if len(missing):
            k = task.keys.index(key)
            step = NUDGE * max(abs(values[k]), 1e-3)
            low, high = (
                rates(cache, task, [targets[i] for i in missing], _with_change(values, k, side * step)).value
                for side in (-1.0, 1.0)
            )
            slope[missing, j] = (high - low) / (2.0 * step)
    return TargetRates(value, slope)


def _with_change(values: Sequence[float], i: int, by: float) -> list[float]:
    return [value + by if j == i else value for j, value in enumerate(values)]


def _rate(
    bodies: PreparedModels,
    case: Case,
    material: Material,
    target: Target,
    shapes: Mapping[str, tuple[Shape, Shape, float]],
    of_law: Mapping[str, str],
) -> tuple[float, dict[str, float]]:
    """Return a rate, and those derivatives by key that need no other march."""
    mode = modes()[target.mode]
    model = bodies(case.geometry, mode, rubber_of(material), case.mesh.refinement, MPI.COMM_SELF)
    end, steps, drive = target.travel, STEPS, None
    if target.kind == "initial":
        gap = case.geometry.gap or USUAL_GAP
        end, steps = SMALL * (1.0 if mode.rotational else gap), 1
    elif not math.isnan(target.load):
        end, drive = target.load, PrescribedForce()
    program = path((0.0, end), steps)
    slopes: dict[str, float] = {}
    stiffness: list[float] = []

    def observe(solver: Equilibrium) -> None:
        at = solver.q if drive is None else solver.force
        if abs(at - end) > 1e-6 * abs(end):
            return
        if target.kind == "tangent" or drive is not None:
            stiffness.append(Sensitivity(model, ()).stiffness(solver))
        if shapes and target.kind != "tangent":
            slopes.update(_shape_derivatives(bodies, model, solver, shapes, case))

    names = () if target.kind == "tangent" else tuple(of_law.values())
    history = march(model, program, sensitivity=names, observer=observe, drive=drive)
    q, force = float(history.displacement[-1]), float(history.force[-1])
    if target.kind == "tangent":
        # Its derivatives are differences of marches.
        return stiffness[-1], {}
    if drive is not None:
        # The travel gives way to a change of the force at the same travel: dq/ds = -(dQ/ds)/K.
        slopes = {key: -slope / stiffness[-1] for key, slope in slopes.items()}
        if history.path_sensitivity is not None:
            slopes |= dict(zip(of_law, map(float, history.path_sensitivity[-1]), strict=True))
        return (
            (q, slopes)
            if target.kind == "travel"
            else (force / q, {k: -force / q**2 * s for k, s in slopes.items()})
        )
    if history.sensitivity is not None:
        slopes |= dict(zip(of_law, map(float, history.sensitivity[-1]), strict=True))
    divisor = 1.0 if target.kind == "force" else q
    return force / divisor, {key: slope / divisor for key, slope in slopes.items()}


def _shape_derivatives(
    bodies: PreparedModels,
    model: FiniteElementModel,
    solver: Equilibrium,
    shapes: Mapping[str, tuple[Shape, Shape, float]],
    case: Case,
) -> dict[str, float]:
    """Return the force's derivatives at the present equilibrium, by those dimensions to which the mesh can be moved."""
    v = solver.tangent_rate(factorised=True)
    b = model.system.create_vector()
    derivatives = {}
    for key, (low, high, distance) in shapes.items():
        works = []
        for other in (high, low):
            if not bodies.relocate(model, other, case.mesh.refinement):
                break
            model.system.residual(b)
            works.append(float(b.array_r @ v[: model.system.owned]))
        if len(works) == 2:
            derivatives[key] = model.multiplicity * (works[0] - works[1]) / distance
    bodies.relocate(model, case.geometry, case.mesh.refinement)
    b.destroy()
    return derivatives
