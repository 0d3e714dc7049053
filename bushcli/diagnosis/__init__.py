"""Diagnosis: where a simulation misses its recording, which physics is missing, how probable it is, and the next test.

`diagnose` computes the answer from the recordings, in the order of docs/diagnosis.md. `question` poses the problem, the
search of `bushcli.selection` fits models and calculates their evidence, and `posterior` the probabilities that follow.
`values` and `intervals` give the values of the parameters, `aftermath` the maps and the next test.
"""
