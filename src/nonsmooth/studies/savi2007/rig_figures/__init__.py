"""Figures measured on the virtual rig, over the model with the parameters identified on it."""
