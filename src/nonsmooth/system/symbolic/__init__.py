"""Expressions: what calling a user's functions gives, its derivatives, its text, its printing as code."""
