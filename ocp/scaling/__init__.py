"""Typical sizes of signals, rows and the objective, which the solver divides by.

`automatic` is the way in: from a problem and a guess to `scales`. `symbol_sizes` holds what tells
the size of a signal or an unknown, `joint_limits` how large limits let signals be that share them,
`negligible_guesses` leaves out guesses that tell none, and `variations` moves expressions by such
sizes. `far_sizes` finds sizes far above what a motion has.
"""
