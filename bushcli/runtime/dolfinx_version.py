"""Checks, without loading DOLFINx, whether bushcli was tested with the installed version."""

from __future__ import annotations

import importlib.metadata

from bushcli.runtime.condition import Condition
from geometry.dolfinx_api import TRIED, is_tried, release


def installed_dolfinx() -> str | None:
    """Return the version of the installed DOLFINx; None if it is not installed or declares no version."""
    try:
        return importlib.metadata.version("fenics-dolfinx")
    except importlib.metadata.PackageNotFoundError:
        return None


def untried_dolfinx(version: str | None) -> tuple[Condition, ...]:
    """Return a condition if bushcli was not tried with this version of DOLFINx, else an empty tuple."""
    if version is None or is_tried(version):
        return ()
    oldest, newest = (".".join(map(str, bound)) for bound in TRIED)
    where = "older" if release(version) < TRIED[0] else "newer"
    return (
        Condition(
            "untried_dolfinx",
            f"DOLFINx {version} is {where} than those that bushcli was tested with, {oldest} to {newest}: "
            "commands may end with an internal error",
            "run `make setup` in the checkout, or create the conda environment of environment.yml: "
            f"both take a DOLFINx from {oldest} to {newest}",
        ),
    )
