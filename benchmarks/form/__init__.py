"""Measure the error of form, the misfit left by the right physics in another formula, on the development deck."""
