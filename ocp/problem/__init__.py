"""What the user states: signals, phases, bounds, functionals, and the checks of a statement.

Nothing here is numerical. `symbols` declares signals and numbers, `statement` joins them to phases
and problems, `validation` refuses what contradicts itself, and `integrator_chains` finds controls
whose effect a polynomial follows exactly.
"""
