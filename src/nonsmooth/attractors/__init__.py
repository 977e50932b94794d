"""Attractors: settled, recognised, counted, and their basins."""
