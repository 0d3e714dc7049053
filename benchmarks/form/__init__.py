"""How wrong formulas of the right physics are: the numbers of the error of form, from the development deck."""
