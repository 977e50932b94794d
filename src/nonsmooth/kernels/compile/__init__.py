"""From Python to machine code: cache, joined texts, vectors, addresses, what is compiled ahead."""
