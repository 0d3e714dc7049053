"""The channels of a case: its material tests, or its recordings."""

from __future__ import annotations

from mpi4py import MPI

from bushcli.case import Case
from bushcli.faults import bad_samples
from bushcli.inverse.channel import Channel, Corrected
from bushcli.inverse.result import Weighting
from bushcli.recording import read_coupon
from bushcli.simulate.measured import Measured
from bushcli.simulate.six_simulation import SixSimulation
from cases.simulate import Prepare, Rubber, prepare
from geometry.shape import shapes


def coupon_channels(
    case: Case, rubber: Rubber, weighting: Weighting, measured: Measured | None = None
) -> list[Channel]:
    """Return the channels of the case's material tests; every rank of a parallel run solves these small models itself.

    Parameters
    ----------
    case : Case
        The case.
    rubber : Rubber
        Law, parameters and bulk modulus to begin with.
    weighting : Weighting
        What the misfit of a coupon is divided by.
    measured : Measured, optional
        Cache of the recordings that the caller reads.
    """
    shape, tables = shapes()["coupon"](), None if measured is None else measured.tables
    return [
        Channel(read_coupon(source, tables), shape, rubber, case, weighting, MPI.COMM_SELF)
        for source in case.coupons
    ]


def bushing_channels(
    case: Case,
    rubber: Rubber,
    comm: MPI.Comm = MPI.COMM_WORLD,
    prepared: Prepare = prepare,
    measured: Measured | None = None,
    corrected: Corrected | None = None,
) -> list[Channel]:
    """Return the channels of the case's recordings; `prepared` makes their finite-element models.

    Parameters
    ----------
    case : Case
        The case.
    rubber : Rubber
        Law, parameters and bulk modulus to begin with.
    comm : MPI.Comm
        Ranks that share each model.
    prepared : Prepare
        Makes the finite-element model of a channel.
    measured : Measured, optional
        Cache of the recordings that the caller reads.
    corrected : Corrected, optional
        Returns the correction of a channel's mesh.
    """
    measured = Measured() if measured is None else measured
    paths: dict[str, SixSimulation] = {}
    found = []
    for source in case.recordings:
        recording = measured.recording(source)
        channel = Channel(
            recording,
            case.geometry,
            rubber,
            case,
            "relative",
            comm,
            prepared,
            paths,
            corrected,
            bad_samples(recording, measured.faults(recording)),
        )
        found.append(channel)
    return found
