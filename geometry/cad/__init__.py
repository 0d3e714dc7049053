"""CAD parts: STEP and BREP files -> axis, bonds, symmetry and graded tetrahedra."""
