"""Usual ranges of a rubber bushing's numbers: a number outside its range gives a condition, never an error.

Most wrong numbers are in another unit (kPa, m, ms), or are another quantity, such as a hardness in Shore A in place of
a modulus. Each can be true of some specimen, so that a result with it carries a condition instead of an error.

Shear modulus: rubber of 30 to 90 Shore A has 0.4 to 7 MPa (Gent 1958: a third of Young's modulus of 1.1 to 21 MPa);
soft elastomers, such as silicone gels, have 0.01 MPa, hard compounds 10 MPa. Bulk modulus: about 2000 MPa for solid
rubber (Wood and Martin 1964); the range is wide enough for inclusions of air and for stiff fillers. Sizes and travels:
engineering judgement, from vehicle and machine bushings of 10 to 200 mm with walls of 2 to 50 mm. Rates: standard
tests go from 10 mm/min on 12.5 mm (ISO 7743, 0.013 per s) to 500 mm/min on 25 mm (ISO 37, 0.3 per s); the range has
two decades more below, for creep, and one and a half above, for cycles of some Hz.

References
----------
Gent (1958), On the relation between indentation hardness and Young's modulus, Rubber Chem. Technol. 31:896-906,
doi:10.5254/1.3542351. Wood and Martin (1964), Compressibility of natural rubber at pressures below 500 kg/cm2, J. Res.
Natl. Bur. Stand. 68A:259-268.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bushcli.case.case import Case, Material
from bushcli.runtime.condition import Condition
from cases.mode import modes
from forms.law import laws
from geometry.shape import Shape

Array = NDArray[np.float64]

#: MPa: shear and bulk modulus.
SHEAR, BULK = (0.01, 10.0), (200.0, 20_000.0)
#: The range in words.
SHEAR_WORDS = f"rubber has {SHEAR[0]:g} to {SHEAR[1]:g} MPa"
#: mm: largest extent of a bushing, thickness of its rubber.
OVERALL, THICKNESS = (5.0, 500.0), (0.5, 150.0)
#: Shear strain of the rubber along or about the axis.
STRAIN = (1e-3, 3.0)
#: Shear strain rate, or rate of the stretch of a coupon, 1/s.
RATE = (1e-4, 10.0)
#: Share of the largest displacement below which the whole path of a recording is the noise of a hold; judgement.
_HELD = 0.01
# Shore A: numbers that are hardnesses where a modulus is far too large.
_SHORE = (20.0, 95.0)


class Path(Protocol):
    """A recording, or the program of a load case: mm, rad or stretch - 1, over s."""

    @property
    def name(self) -> str:
        """Name of the channel."""

    @property
    def mode(self) -> str:
        """Name of the mode."""

    @property
    def displacement(self) -> Array:
        """Shape (n,)."""

    @property
    def time(self) -> Array | None:
        """Shape (n,), or None."""


def unusual_values(case: Case, material: Material, paths: Iterable[Path] = ()) -> tuple[Condition, ...]:
    """Return a condition for each number of a case that rubber bushings do not have.

    Parameters
    ----------
    case : Case
    material : Material
        That is simulated; its moduli are looked at if it has parameters.
    paths : iterable of Path
        Recordings of the bushing and of coupons, and programs of load cases from files; those of the case file are
        looked at in any case. A recording of six motions is left out.
    """
    remarks: list[tuple[str, str]] = []
    shear = laws()[material.law].shear_modulus(**material.parameters) if material.parameters else SHEAR[0]
    if not SHEAR[0] <= shear <= SHEAR[1]:
        message = f"the rubber has an initial shear modulus of {shear:.3g} MPa; {SHEAR_WORDS}"
        hardness = [name for name, value in material.parameters.items() if _SHORE[0] <= value <= _SHORE[1]]
        if case.needs_fit:
            remedy = "the law is identified from [[coupons]]: check their unit of stress, and the size of the specimens"
        elif shear > SHEAR[1] and hardness:
            remedy = f"material.parameters.{hardness[0]} is in MPa; a rubber of 60 Shore A has C10 of about 0.6 MPa"
        elif SHEAR[0] <= shear / 1e3 <= SHEAR[1]:
            remedy = "give material.parameters in MPa: if they are in kPa, divide them by 1000"
        elif SHEAR[0] <= shear * 1e3 <= SHEAR[1]:
            remedy = "give material.parameters in MPa: if they are in GPa, multiply them by 1000"
        else:
            remedy = "check that material.parameters are in MPa"
        remarks.append((message, remedy))
    bulk = material.bulk_modulus
    if material.parameters and np.isfinite(bulk) and not BULK[0] <= bulk <= BULK[1]:
        message = f"the bulk modulus is {bulk:.4g} MPa; solid rubber has some 2000, at least {BULK[0]:g} MPa"
        remedy = "give material.bulk_modulus in MPa, or leave it out for an incompressible rubber"
        remarks.append((message, remedy))
    units = "give the dimensions in mm; of a file in another unit than it states, set geometry.unit"
    overall, wall = case.geometry.overall, case.geometry.wall
    if overall is not None and not OVERALL[0] <= overall <= OVERALL[1]:
        usual_range = f"bushings are {OVERALL[0]:g} to {OVERALL[1]:g} mm large"
        remarks.append((f"the bushing is {overall:.4g} mm in size; {usual_range}", units))
    elif wall is not None and not THICKNESS[0] <= wall.thickness <= THICKNESS[1]:
        usual_range = f"bushings have {THICKNESS[0]:g} to {THICKNESS[1]:g} mm"
        message = f"the rubber is {wall.thickness:.4g} mm thick between the bonds; {usual_range}"
        remarks.append((message, units))
    looked_at: dict[str, tuple[str, Array, Array | None]] = {}
    for load_case in case.load_cases:
        if load_case.by_force or not load_case.path:
            continue
        q = np.asarray(load_case.path, dtype=float)
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q)))])
        time = along / load_case.rate if load_case.rate else None
        looked_at[load_case.label] = (load_case.mode, q, time)
    looked_at |= {
        path.name: (path.mode, path.displacement, path.time)
        for path in paths
        if getattr(path, "six", None) is None
    }
    for name, (mode, q, time) in looked_at.items():
        remarks += _of_the_path(case.geometry, name, mode, q, time)
    return tuple(Condition("unusual_value", message, remedy) for message, remedy in remarks)


def _of_the_path(
    shape: Shape, name: str, mode_name: str, q: Array, time: Array | None
) -> Iterator[tuple[str, str]]:
    mode, wall = modes()[mode_name], shape.wall
    reference = 1.0
    if mode.specimen == "bushing":
        if wall is None:
            return
        reference = mode.per_shear(wall)
    strain = float(np.abs(q).max(initial=0.0)) / reference
    size = f"{'' if wall is None else f'{wall.thickness:.3g} mm of '}rubber"
    unit = "degrees" if mode.rotational else "mm"
    if mode.specimen == "bushing" and strain > 0.0 and not STRAIN[0] <= strain <= STRAIN[1]:
        travel = np.degrees(strain * reference) if mode.rotational else strain * reference
        message = (
            f"{name}: a travel of {travel:.4g} {unit} on {size} is a shear strain of {100 * strain:.3g} %"
        )
        remedy = f"give the travel in {unit} and [geometry] in mm; check the columns and units of a recording"
        yield message, remedy
    rate = 0.0
    if time is not None and np.ptp(q) >= _HELD * np.abs(q).max(initial=0.0):
        # The median speed of the moving samples: holds and noise do not count.
        steps = np.diff(time)
        speed = np.abs(np.diff(q))[steps > 0.0] / steps[steps > 0.0]
        moving = speed[speed > 0.1 * speed.max(initial=0.0)]
        rate = float(np.median(moving)) / reference if len(moving) else 0.0
    if rate > 0.0 and not RATE[0] <= rate <= RATE[1]:
        usual_range = f"tests of rubber have {RATE[0]:g} to {RATE[1]:g} per s"
        message = f"{name}: the rubber is strained by {rate:.2g} per s; {usual_range}"
        remedy = 'give time in s: of a recording in ms, units = { time = "ms" }; of a load case, rate per s'
        yield message, remedy
