"""What is done to a bushing, solved with PETSc SNES: modes, programs, the march, the reaction."""
