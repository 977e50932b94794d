"""Diagrams over parameters, and measures of a trajectory."""
