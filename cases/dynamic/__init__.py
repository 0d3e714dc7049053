"""Small vibrations about an equilibrium: K_eq + s K_N - omega^2 M, its reduction, and dynamic stiffness from it."""
