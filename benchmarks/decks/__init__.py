"""Frozen decks of recordings with known physics: drawn once and kept as manifests; made, diagnosed and scored.

    python -m benchmarks.decks make own DIR/own
    python -m benchmarks.decks run own DIR/own --label new
    python -m benchmarks.decks score --label old --label new -o docs/decks.md

`about.md` says what the decks are and by what rules they are scored.
"""
