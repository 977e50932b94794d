"""Work in chunks, spread over threads or machines, kept in stores. Knows nothing of what a chunk computes."""
