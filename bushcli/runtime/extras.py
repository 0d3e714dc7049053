"""How a user installs an optional part of the program."""

from __future__ import annotations


def remedy(extra: str) -> str:
    """Return what the user can do if the libraries of an extra are not installed.

    Parameters
    ----------
    extra : str
        As in pyproject.toml: "rig", "fmu", "study", "slurm".
    """
    return f'make install in the checkout installs it; in another environment: pip install "bushcli[{extra}]"'
