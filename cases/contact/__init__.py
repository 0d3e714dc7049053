"""Frictionless contact of a bushing's surfaces: with each other, and with the sleeves beyond the bonds."""
