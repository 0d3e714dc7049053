"""Columns -> channels with clocks: time stamps, rates, rasters, and counts of cycles."""
