"""Points at which the derivative of an expression jumps: where they are, and how to do without.

`surfaces` finds them. `raised` states those of a minimised integral as limits of controls,
`raised_ends` those of minimised numbers as limits of unknowns, and `split_controls` those of a rate
by two parts of a control. `costs` finds those that only cost, and `vector_sizes` finds sizes of
vectors, which have such a point where they are zero.
"""
