"""Non-smooth (piecewise-smooth) dynamical systems, from the equations to the measured twin."""
