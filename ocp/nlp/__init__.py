"""Solvers of nonlinear programs.

`solver` says what is asked of one, `ipopt` is the one that comes with the package. `retries` makes
several attempts within a `budget`. `interrupts` notes Ctrl-C. `failures` says in words what went
wrong, by the names of the rows (`row_names`) and of what is NaN or infinite (`non_finite`).
"""
