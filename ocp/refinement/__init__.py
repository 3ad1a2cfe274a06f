"""Mesh refinement: solve, estimate the errors between the points, choose the next mesh.

`loop` is the algorithm, `error_estimate` says what is wrong with a mesh, `switch_detection`
brackets
the jumps of controls, and `policy` makes the next mesh.
"""
