"""Systems made from systems: elements, sliding, the smoothed switch, `mechanical`, maps."""
