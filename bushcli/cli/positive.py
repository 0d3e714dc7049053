"""Type of options that are a positive number."""

from __future__ import annotations

import math
from typing import Any

import click


class PositiveNumber(click.FloatRange):
    """A finite number above zero.

    Comparisons with nan are false, so that it would pass the bounds of its base class.
    """

    def __init__(self) -> None:
        super().__init__(min=0.0, min_open=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number.

        Parameters
        ----------
        value : object
            As given on the command line.
        param : click.Parameter or None
        ctx : click.Context or None

        Raises
        ------
        click.BadParameter
            It is not a finite number above zero.
        """
        found = float(super().convert(value, param, ctx))
        if not math.isfinite(found):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return found
