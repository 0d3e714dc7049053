"""Recognises an interruption (Ctrl-C, SIGTERM) after a library written in C has turned it into another exception."""

from __future__ import annotations


def is_interrupt(error: BaseException | None) -> bool:
    """Whether an exception is an interruption or was caused by one, in a callback of PETSc or ctypes.

    ctypes preserves only the name of an interruption, in the message of its own error.
    """
    while error is not None:
        if isinstance(error, KeyboardInterrupt) or KeyboardInterrupt.__name__ in str(error):
            return True
        error = error.__cause__ or error.__context__
    return False
