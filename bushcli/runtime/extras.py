"""How a user comes by an optional part of the program."""

from __future__ import annotations


def remedy(extra: str) -> str:
    """Return what to do where the libraries of an extra are not installed.

    Parameters
    ----------
    extra : str
        As in pyproject.toml: "rig", "fmu", "study", "slurm".
    """
    return f'make install in the checkout brings it; into an environment of your own: pip install "bushcli[{extra}]"'
