"""Draw a deck's recordings into its manifest, one by one; existing entries stay."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

from benchmarks.decks import manifest
from benchmarks.decks.drawing import Unsuitable
from benchmarks.decks.manifest import Entry
from benchmarks.decks.plan import Card, cards


def deal(deck: str, parts: Sequence[str] = ()) -> Iterator[str]:
    """Draw what the manifest lacks, in some parts or all; yield a line for each that does not reveal its content."""
    known = manifest.read(deck)
    for name, card in cards(deck).items():
        if name in known or (parts and card.part not in parts):
            continue
        begin = time.perf_counter()
        try:
            entry = replace(_draw(card), name=name)
        except Unsuitable as failure:
            yield f"{name}: none: {failure}"
            continue
        manifest.put(deck, entry)
        yield f"{name}: {time.perf_counter() - begin:.0f} s"


def _draw(card: Card) -> Entry:
    if card.part == "own":
        from benchmarks.decks import own

        return own.draw_recording(card)
    if card.part == "foreign":
        from benchmarks.decks.foreign import draw

        return draw.draw_recording(card)
    from benchmarks.decks import outside

    return outside.draw_recording(card)
