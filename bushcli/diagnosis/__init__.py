"""Diagnosis: where a simulation misses its recording, which missing physics would close the gap, and what would tell.

`diagnose` leads from the plain law to the answer. Models are solved and fitted (`model`, `start`), tried with more
physics (`candidates`), made to foretell recordings (`proposing`) and looked into (`local`). What judges them has values
in and values out: noise and its weighing, tests and scores, places in the record.
"""
