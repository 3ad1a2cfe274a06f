"""What the user states: signals, phases, bounds, functionals, and the checks of a statement.

Nothing here is numerical. `symbols` declares signals and numbers, `phase` and `problem` join them,
`parameters` evaluates the limits at given constants, `statement_checks` and, before a solve,
`validation` refuse what contradicts itself, `integrator_chains` finds controls whose effect a
polynomial follows exactly, and `linear_controls` those that may have singular arcs.
"""
