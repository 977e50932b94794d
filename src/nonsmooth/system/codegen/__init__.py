"""What the steppers need of a system: matrices of linear modes, Taylor jets, equations of variation."""
