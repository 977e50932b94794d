"""Brute-force questions to a flow, one per file."""
