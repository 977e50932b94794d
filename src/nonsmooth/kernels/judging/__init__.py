"""Period numbers, transient-judge-perturb cycles, exponents of two neighbours."""
