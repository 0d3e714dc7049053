"""Recordings with a concealed effect: one process makes them, a second diagnoses them, a third scores the answers.

    python -m benchmarks.concealed make --count 100 --seed 1000 DIR
    python -m benchmarks.concealed run DIR
    python -m benchmarks.concealed score DIR -o docs/concealed.md

``DIR/cases`` holds the files that a user would have, which are all that the diagnosis gets; ``DIR/truth`` holds the
concealed effects; ``DIR/results`` the answers.
"""
