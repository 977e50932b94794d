"""Piecewise-smooth systems: states, parameters, modes, indicators, transitions, and their equations."""
