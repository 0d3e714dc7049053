"""Diagnosis: where a simulation misses its recording, which physics is missing, how probable it is, and the next test.

`diagnose` computes the answer from the recordings, in the order of docs/diagnosis.md. `question` poses the problem, the
search of `bushcli.selection` fits models and calculates their evidence, and `posterior` the probabilities that follow.
`values` and `intervals` are of the effects and parameters, `aftermath` of what follows: maps and the next test.
"""
