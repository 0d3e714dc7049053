"""Numbers beside a limit, with as many digits as show on which side of it they are."""

from __future__ import annotations

# Beyond twelve digits two numbers are the same but for rounding.
_MOST = 12


def with_decimals(value: float, *limits: float, decimals: int = 0) -> str:
    """Return a number with at least these decimals: 10.3 or 10.004 beside 10.

    Parameters
    ----------
    value : float
        In any unit.
    *limits : float
        In the same unit.
    decimals : int
        Fewest decimals, a number of characters.
    """
    return _text_beside(value, limits, "f", decimals)


def with_digits(value: float, *limits: float, digits: int = 3) -> str:
    """Return a number with at least these significant digits: 140.4 beside 140, and 150 beside it.

    Parameters
    ----------
    value : float
        In any unit.
    *limits : float
        In the same unit.
    digits : int
        Fewest significant digits, a number of characters.
    """
    return _text_beside(value, limits, "g", digits)


def _text_beside(value: float, limits: tuple[float, ...], form: str, least: int) -> str:
    for digits in range(least, _MOST):
        text = f"{value:.{digits}{form}}"
        shown = float(text)
        if all((shown > end, shown < end) == (value > end, value < end) for end in limits):
            return text
    return f"{value:.{least}{form}}"
