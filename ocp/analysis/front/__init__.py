"""Pareto fronts: one objective is minimised under a limit on the other, and the limit moves.

`continuation` chooses the next limit from the slope at the last point, `both_ways` walks from
either end and into gaps, `envelope` keeps the points that no other one dominates. They take any
`Subject`; `pareto` is the one of a problem, behind `ocp.front`.
"""
