"""Results: what a computation hands back, how it is labelled, kept and read again."""
