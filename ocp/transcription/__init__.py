"""From a problem and a mesh to a nonlinear program, and back.

`transcribe` is the way in. `scaling` chooses the sizes, `variables` places the unknowns, `kernels`
assembles programs from small functions that are differentiated once, and `packing` goes between
decision vectors and trajectories.
"""
