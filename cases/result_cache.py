"""Cache of a body's last results, which a search uses again when only parameters of the rig have changed."""

from __future__ import annotations

from typing import Generic, TypeVar

Result = TypeVar("Result")


class ResultCache(Generic[Result]):
    """The last results, by what they depend on.

    Parameters
    ----------
    most : int
        Number of results that are kept.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        # The most recent one is last. A shape may hold lists, which have no hash.
        self._results: list[tuple[object, Result]] = []

    def get(self, asked: object) -> Result | None:
        """Return the result of the same question, or None.

        Parameters
        ----------
        asked : object
            Everything that the result depends on.
        """
        for i, (key, result) in enumerate(self._results):
            if key == asked:
                self._results.append(self._results.pop(i))
                return result
        return None

    def put(self, asked: object, result: Result) -> None:
        """Store a result; the least recently used one is discarded.

        Parameters
        ----------
        asked : object
            Everything that the result depends on.
        result : Result
        """
        other_entries = [entry for entry in self._results if entry[0] != asked]
        self._results = [*other_entries, (asked, result)][-self._most :]
