"""One march along a branch: predictor, corrector, step size, range, events and endings."""
