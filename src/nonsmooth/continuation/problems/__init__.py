"""Equations, Jacobians and measures of points: periodic orbits, equilibria, special points in two parameters."""
