"""Typical sizes of signals, rows and the objective, which the solver divides by.

`automatic` is the way in: from a problem and a guess to `scales`. `symbol_sizes` holds what tells
the size of a signal, an unknown or an expression.
"""
