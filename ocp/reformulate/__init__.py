"""What is solved in place of a statement, where that has kinks: passes, and the way back.

A `Reformulation` is a pass from one statement to another (`reformulation`), and a `Form` holds what
all of them make of a problem (`form`). `standard` lists those of every solve: `kinked_costs` and
`vector_sizes` state kinks of minimised integrals and numbers as limits of further controls and
unknowns, and `split_controls` those of a rate by two parts of a control.
"""
