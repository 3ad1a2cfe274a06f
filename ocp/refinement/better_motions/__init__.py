"""Motions that are better than an answer of the loop, to go on from: `ocp.refinement.refine`."""
