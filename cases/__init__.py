"""Load cases and their solution with PETSc SNES: modes, programs, the march, the reaction force."""
