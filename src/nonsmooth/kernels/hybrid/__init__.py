"""The hybrid loop, its records, and what observes it."""
