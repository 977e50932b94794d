"""Stable and unstable manifolds of saddle orbits."""
