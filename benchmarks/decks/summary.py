"""The scores of the first and the last label, in brief, for the page of concealed effects."""

from __future__ import annotations

import re
from collections.abc import Sequence

from benchmarks.decks.report import items, scores

BEGIN, END = "<!-- scores of the decks -->", "<!-- end of the scores -->"
_PLACE = re.compile(f"{re.escape(BEGIN)}.*?{re.escape(END)}", re.DOTALL)


def summary(labels: Sequence[str], decks: Sequence[str]) -> str:
    """Return the table of scores under the first and the last label, with the command that makes it."""
    ends = list(dict.fromkeys([labels[0], labels[-1]]))
    by_deck = {deck: {label: items(deck, label) for label in ends} for deck in decks}
    counts = ", ".join(
        f"{label}: {' + '.join(str(len(runs[label])) for runs in by_deck.values())} recordings"
        for label in ends
    )
    command = " ".join(f"--label {label}" for label in ends)
    return (
        f"Decks {', '.join(decks)} ({counts}), by `setup/enter python -m benchmarks.decks score {command}`:\n\n"
        + scores(by_deck)
    )


def with_new_scores(page: str, text: str) -> str:
    """Return a page with new scores between its two marks.

    Parameters
    ----------
    page, text : str
        Markdown.

    Raises
    ------
    ValueError
        If the page does not have the marks.
    """
    if not _PLACE.search(page):
        raise ValueError(f"the page has no place for the scores: {BEGIN} ... {END}")
    return _PLACE.sub(lambda _: f"{BEGIN}\n\n{text}\n{END}", page)
