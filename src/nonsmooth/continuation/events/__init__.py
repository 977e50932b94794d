"""Policy of branches: the events along curves, and how a branch goes on where its equations end."""
