"""The stepper of linear modes with harmonic forcing, for any number of states."""
