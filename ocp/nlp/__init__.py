"""Solvers of nonlinear programs: IPOPT, repeated attempts, Ctrl-C, and failures in words."""
