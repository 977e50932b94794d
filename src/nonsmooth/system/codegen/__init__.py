"""Code for the steppers: matrices of linear modes, Taylor jets, equations of variation."""
