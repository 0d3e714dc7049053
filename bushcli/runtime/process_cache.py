"""The caches of a worker process: all that it retains from one piece of work to the next.

A finite-element model cannot be sent to another process. Work that needs a cache takes it as its first argument: in
the process of the caller this is the caller's own, and in a worker process one of the same class, which the process
makes when it is first needed and retains until it ends.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any

_caches: dict[type, Any] = {}
# A Dask worker may have several threads; PETSc and the cached models serve one at a time.
_alone = threading.Lock()


def with_cache(work: Callable[..., Any], cache: object | None, in_process: bool) -> Callable[..., Any]:
    """Return work with its first argument given, so that it can be sent to other processes.

    Parameters
    ----------
    work : callable
        Function at module level.
    cache : object or None
        The caller's cache, of a class that can be made without arguments; None for work that takes no cache.
    in_process : bool
        Whether the work is done in this process.
    """
    if cache is None:
        return work
    return partial(work, cache) if in_process else partial(_with_own_cache, type(cache), work)


def _with_own_cache(kind: type, work: Callable[..., Any], *question: Any) -> Any:
    """Do work in a worker process, with the process's cache of a class."""
    with _alone:
        if kind not in _caches:
            _caches[kind] = kind()
        return work(_caches[kind], *question)
