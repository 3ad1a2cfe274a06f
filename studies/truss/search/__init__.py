"""The search for the best motion of the truss: starts, smoothness, and how sure the answer is."""
