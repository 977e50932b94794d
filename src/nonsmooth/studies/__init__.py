"""Reproductions of published papers: each is a package with ``reproduce(out, figures, quick, progress)``."""
