"""Mesh refinement: solve, estimate the errors between the points, choose the next mesh.

`loop` is the algorithm. `mesh_solver` solves one mesh, in as many `attempts` as it takes and within
the `budget`. A `solved_mesh` is what the solver finished, and `mesh_iteration` its record.
`estimates` say what is wrong with a mesh and where controls jump, and `policy` makes the next mesh.
A refinement rule of one's own is a `policy.RefinementPolicy`. `accuracy` is what is asked for.
"""
