"""Solvers of nonlinear programs.

`solver` says what is asked of one and `result` what it answers. `ipopt` is the one that comes with
the package; `kept` lends its objects again. `saddle` tells a saddle from a least value.
`interrupts` notes Ctrl-C. `failures` says in words what went wrong, `collapse` when a motion takes
no time, and `non_finite` what is NaN or infinite.
"""
