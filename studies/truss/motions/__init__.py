"""Motions of the truss: laws, where they come from, and what they do to the truss."""
