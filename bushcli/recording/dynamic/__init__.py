"""Dynamic tests: tables of stiffness and loss over frequency, amplitude, preload and temperature, or their raw loops.

Names, units and conditions of a table's columns are recognised (`names`, `columns`). Two of |K*|, K', K'', loss angle,
tan delta and damping give K' and K'' (`stiffness`); sine bursts give them by a fit of harmonics (`harmonics`).
"""
