"""Proof that an answer is right, by means that share nothing with the solver.

`simulation` drives the stated dynamics with the controls by another integrator, restarted where
`error_growth` says that it has to be. `bernstein_bounds` bounds a constraint between the points,
and `verify` gives the verdict. `certificate` tests the `conditions` of an optimum too, among them
the `minimum_principle`, which is judged strictly where the active set does not change.
"""
