"""Pareto fronts: one objective is minimised under a limit on the other, and the limit moves.

`continuation` chooses the next limit from the slope at the last point, `both_ways` walks from
either end and into gaps, `envelope` keeps the points that no other one dominates, `neighbours`
solves a problem from its neighbour. `pareto` is the front of a problem, `ocp.front`; whatever has a
front of its own is a `FrontSubject` for `ocp.front_between`.
"""
