"""Signatures of orbits: whether a path obeys its own, and which one follows where it ends."""
