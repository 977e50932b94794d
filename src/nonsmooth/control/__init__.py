"""Experiments under feedback: a rig as three methods, and the continuation of its orbits, stable or not."""
