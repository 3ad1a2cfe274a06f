"""Fronts and surfaces of the arm: two or three of its quantities against each other."""
