"""Mesh refinement: solve, estimate the errors between the points, choose the next mesh.

`refine` is the loop, and `planning` what it solves next. `mesh_solver` solves one mesh, in as many
`attempts` as it takes and within the `budget`. A `solved_mesh` is what the solver finished, and
`mesh_iteration` its record. `first_round` tries other starts on the first mesh.

`estimates` say what is wrong with a mesh and where controls jump, and `policies` make the next
mesh. A refinement rule of one's own is a `policies.policy.RefinementPolicy`. `accuracy` is what is
asked for, `endings` say when no finer mesh would help, and `stopped` makes the error of a
refinement without an answer.

`unwrapping` takes whole turns out of angles, `raised_peaks` sets peaks to what the motion has
between its points, and `impulses` and `growth` find what needs a limit. `saddles` and
`other_controls` look for what is better than an answer, for those who ask.
"""
