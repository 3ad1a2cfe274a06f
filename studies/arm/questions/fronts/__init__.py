"""Fronts of the arm: two of its quantities against each other."""
