"""What the user states: signals, phases, bounds, functionals, and the checks of a statement.

Nothing here is numerical. `symbols` declares signals and numbers, `phase` and `problem` join them,
and `parameters` evaluates the limits at given constants. `statement_checks` and
`checks_before_solve` refuse what contradicts itself. `integrator_chains` finds controls whose
effect a polynomial follows exactly, and `linear_controls` those that may have singular arcs.
"""
