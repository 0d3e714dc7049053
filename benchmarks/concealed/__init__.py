"""Recordings with a concealed effect: made by one process, diagnosed by a second, scored by a third.

    python -m benchmarks.concealed make --count 100 --seed 1000 DIR
    python -m benchmarks.concealed run DIR
    python -m benchmarks.concealed score DIR -o docs/concealed.md

``DIR/cases`` holds what a user would have, and is all that the diagnosis is given; ``DIR/truth`` what is concealed;
``DIR/results`` what the diagnosis said.
"""
