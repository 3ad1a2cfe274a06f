"""Proof that an answer is right, by means that share nothing with the solver.

`simulation` replays the controls by another integrator, `bernstein_bounds` bounds a constraint
between the points, `verify` gives the verdict, and `certificate` tests the optimality conditions.
"""
