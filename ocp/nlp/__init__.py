"""Solvers of nonlinear programs.

`solver` says what is asked of one, `ipopt` is the one that comes with the package. `interrupts`
notes Ctrl-C. `failures` says in words what went wrong, by the names of the rows, and `non_finite`
what is NaN or infinite.
"""
