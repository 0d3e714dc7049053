"""Diagnosis: where a simulation misses its recording, which physics is missing, how probably, and what would decide.

`diagnose` leads from the recordings to the answer, from top to bottom in the order of docs/diagnosis.md. Models are
fitted (`fit`) and judged by their evidence (`likelihood`, `evidence`); what others would be worth is predicted to first
order (`columns`, `predict`) and decides which is fitted next (`queue`); the evidence of all makes the posterior.
"""
