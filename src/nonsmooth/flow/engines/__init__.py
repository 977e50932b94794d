"""Steppers bound to systems, one engine for each."""
