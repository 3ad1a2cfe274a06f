"""Solvers of nonlinear programs.

`solver` says what is asked of one and what it answers. `ipopt` is the one that comes with the
package; `kept` lends its objects again. `interrupts` notes Ctrl-C. `failures` says in words what
went wrong, and `non_finite` what is NaN or infinite.
"""
