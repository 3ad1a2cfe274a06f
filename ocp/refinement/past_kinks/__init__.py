"""A first motion where kinks are in the way of the solver.

`first_motion` solves the first mesh, and goes by `past_kinks` where the solver is lost: that runs
the loop of mesh iterations on the problem of `rounded_kinks`, and takes its answer as a start.
`loop_past_kinks` is the loop that does so.
"""
