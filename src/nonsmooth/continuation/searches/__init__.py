"""From a simulation to a first guess of a periodic orbit, within a budget."""
