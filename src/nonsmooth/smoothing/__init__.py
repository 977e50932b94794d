"""Comparisons of smoothed systems with the event-driven ones that they stand for."""
