"""What a piecewise-smooth system is: states, parameters, modes, indicators, transitions, and their equations."""
