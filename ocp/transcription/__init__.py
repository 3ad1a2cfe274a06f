"""From a problem and a mesh to a nonlinear program, and back.

`transcribe` is the way in. `columns` places the unknowns and `rows` the constraints. `blocks`
states them, `kernels` assembles programs from small functions that are differentiated once, and
`packing` goes between decision vectors and trajectories.
"""
