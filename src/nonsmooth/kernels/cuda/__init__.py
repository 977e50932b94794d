"""The GPU's entries over the same texts."""
