"""Points at which the derivative of an expression jumps: where they are, and how to do without.

`surfaces` finds them, `raised` states those of a minimised integral as limits of controls, and
`vector_sizes` finds sizes of vectors, which have such a point where they are zero.
"""
