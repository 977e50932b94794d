"""Frames carried along trajectories: saltation, segments of an orbit, spectra."""
