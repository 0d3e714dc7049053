"""Sections of revolution: outlines of named edges, from the case file or a DXF, and their meshes."""
