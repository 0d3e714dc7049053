"""Simulate rubber bushings, identify their rubber from recorded curves, say what a model leaves out."""

__version__ = "0.1.0"
