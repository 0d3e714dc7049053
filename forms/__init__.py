"""Hyperelastic potentials in UFL: kinematics, laws, volumetric energy, path-dependent branches."""
