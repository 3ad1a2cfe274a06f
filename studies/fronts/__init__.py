"""Pareto fronts of any mechanism: keys, the walk between both ends, series, sentences, a figure.

A mechanism brings a `MechanismFront`, see `found`: it finds both ends, and a point from another.
"""
