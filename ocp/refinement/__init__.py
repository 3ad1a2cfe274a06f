"""Mesh refinement: solve, estimate the errors between the points, choose the next mesh.

`refine` is the whole: the `loop` of mesh iterations, and `reviews` of its answer. `mesh_solver`
solves one mesh, in as many `attempts` as it takes and within the `budget`. A `solved_mesh` is what
the solver finished, and `mesh_iteration` its record. `first_round` tries other starts on the first
mesh, and `past_kinks` leads a solver that is lost among kinks, by a loop of its own.

`policies` make the next mesh. A refinement rule of one's own is a
`policies.policy.RefinementPolicy`. `endings` say when no finer mesh would help, and `stopped` makes
the error of a refinement without an answer.

`raised_peaks` sets peaks to what the motion has
between its points, `better_motions` looks for what is lower than an answer, and `impulses` finds
controls that need a limit.
"""
