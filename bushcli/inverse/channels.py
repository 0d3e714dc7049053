"""The channels of a case: its material tests, or its recordings."""

from __future__ import annotations

from mpi4py import MPI

from bushcli.case import Case
from bushcli.inverse.channel import Channel, Corrected
from bushcli.inverse.result import Weighting
from bushcli.recording import read_coupon, read_recording
from bushcli.recording.table_cache import TableCache
from bushcli.simulate.six_simulation import SixSimulation
from cases.simulate import Prepare, Rubber, prepare
from geometry.shape import shapes


def coupon_channels(
    case: Case, rubber: Rubber, weighting: Weighting, tables: TableCache | None = None
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
    tables : TableCache, optional
        Cache of the binary files that the caller reads.
    """
    shape = shapes()["coupon"]()
    return [
        Channel(read_coupon(source, tables), shape, rubber, case, weighting, MPI.COMM_SELF)
        for source in case.coupons
    ]


def bushing_channels(
    case: Case,
    rubber: Rubber,
    comm: MPI.Comm = MPI.COMM_WORLD,
    prepared: Prepare = prepare,
    tables: TableCache | None = None,
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
    tables : TableCache, optional
        Cache of the binary files that the caller reads.
    corrected : Corrected, optional
        Returns the correction of a channel's mesh.
    """
    tables = TableCache() if tables is None else tables
    paths: dict[str, SixSimulation] = {}
    return [
        Channel(
            read_recording(source, tables=tables),
            case.geometry,
            rubber,
            case,
            "relative",
            comm,
            read_recording(source, whole=True, tables=tables) if case.effects else None,
            prepared,
            paths,
            corrected,
        )
        for source in case.recordings
    ]
