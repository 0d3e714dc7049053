"""Curves as values: force over displacement and time, their segments, cycles, holds and noise; no file is read here."""
