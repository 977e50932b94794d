"""Systems of equations that a march follows: periodic orbits, equilibria, special points in two parameters."""
