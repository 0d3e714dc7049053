"""Diagnosis: where a simulation misses its recording, which missing physics would close the gap, and what would tell.

Here are the parts that need no simulation: values in, values out.
"""
