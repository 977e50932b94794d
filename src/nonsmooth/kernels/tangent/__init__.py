"""Frames carried along trajectories: saltation, legs of an orbit, spectra."""
