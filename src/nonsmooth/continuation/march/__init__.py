"""One march along a branch: step size, range, events and endings."""
