"""Rows -> columns with quantity and unit: where a header is, and what its names, units and remarks mean."""
