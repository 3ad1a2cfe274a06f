"""Motions that are better than an answer of the loop, for `ocp.refinement.reviews`."""
