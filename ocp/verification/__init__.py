"""Proof that an answer does what was stated, by means that share nothing with the solver.

`simulation` drives the stated dynamics with the controls by another integrator, restarted where
the motion amplifies errors too much. `verify` bounds the constraints between the points and gives
the verdict.
"""
