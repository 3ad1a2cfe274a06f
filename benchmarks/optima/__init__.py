"""Optimal control problems of the literature with trusted optima, solved with default settings."""
