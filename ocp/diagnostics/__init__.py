"""What is asked of an answer that is there: the certificate and its conditions.

`certificate` tests all `conditions` of an optimum: `motion_conditions`, `optimality_conditions`,
which judge the `minimum_principle` strictly where the active set does not change, and the
`program_conditions` of the nonlinear program. `other_controls` estimates the gain by controls far
away, which `control_trials` tries. `second_solve` solves the problem in another way.
"""
