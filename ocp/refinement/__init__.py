"""Mesh refinement: solve, estimate the errors between the points, choose the next mesh.

`refine` is the loop, and `planning` what it solves next. `mesh_solver` solves one mesh, in as many
attempts as it takes and within the `budget`. A `solved_mesh` is what the solver finished.
`first_start` tries other starts on the first mesh, by `search`, unless the problem seems convex.

`policies` make the next mesh. A refinement rule of one's own is a `policies.policy.MeshPolicy`.
`endings` say when no finer mesh would help, and `stopped` makes the error of a refinement without
an answer.

`raised_peaks` sets peaks to what the motion has between its points, `runaway` finds what needs a
limit, and `switch_multipliers` the multipliers where a switch is held, for those who ask.
"""
