"""Parametric bushing geometry: shapes, and the Gmsh meshes made of them."""
