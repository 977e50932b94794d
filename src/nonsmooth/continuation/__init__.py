"""Newton's side: periodic orbits, their stability, and how they change with a parameter."""
