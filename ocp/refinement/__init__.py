"""Mesh refinement: solve, estimate the errors between the points, choose the next mesh.

`loop` is the algorithm. `mesh_solver` solves one mesh, in as many `attempts` as it takes and within
the `budget`. A `solved_mesh` is what the solver finished, and `mesh_iteration` its record.
`first_round` finds a first motion where the first attempt fails. `unwrapping` takes whole turns out
of angles, `saddles` looks for a lower motion beside a saddle, and `impulses` finds controls that
need a limit. `estimates` say what is wrong with a mesh and where controls jump, `other_controls`
what controls far away could gain, and `policies` make the next mesh. A refinement rule of one's own
is a `policies.policy.RefinementPolicy`. `accuracy` is what is asked for, `endings` say when no
finer mesh would help, and `stopped` makes the error of a refinement without an answer.
"""
