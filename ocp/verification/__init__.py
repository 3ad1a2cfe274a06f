"""Proof that an answer is right, by means that share nothing with the solver.

`simulation` drives the stated dynamics with the controls by another integrator, restarted where
the motion amplifies errors too much. `verify` bounds the constraints between the points and gives
the verdict. `certificate` tests all `conditions` of an optimum: `motion_conditions`,
`optimality_conditions`, which judge the `minimum_principle` strictly where the active set does not
change, and the `program_conditions` of the nonlinear program. `tolerances` says what each of them
allows.
"""
