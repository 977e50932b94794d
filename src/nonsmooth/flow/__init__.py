"""Trajectories: methods, sections, one run."""
