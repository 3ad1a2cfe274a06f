"""Mesh refinement: solve, estimate the errors between the points, choose the next mesh.

`loop` is the algorithm. `error_estimate` says what is wrong with a mesh, `switch_detection` finds
the jumps of controls, and `policy` makes the next mesh. A refinement rule of one's own is a
`policy.RefinementPolicy`. `accuracy` is what is asked for, `mesh_iteration` the record of a round.
"""
