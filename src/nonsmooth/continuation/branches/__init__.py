"""Orbits and branches as records and files, and the branches that leave special points."""
