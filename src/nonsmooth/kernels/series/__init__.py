"""The stepper of generated Taylor series, and Runge-Kutta-Fehlberg."""
