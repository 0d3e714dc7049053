"""Diagnosis: where a simulation misses its recording, which physics is missing, how probable it is, and the next test.

`diagnose` computes the answer from the recordings, in the order of docs/diagnosis.md. Models are fitted (`fit`) and
judged by their evidence (`likelihood`, `evidence`). The evidence of others is predicted to first order (`columns`,
`predict`), which decides what is fitted next (`queue`). The posterior follows from the evidence of all models.
"""
