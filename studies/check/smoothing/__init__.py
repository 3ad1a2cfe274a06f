"""Rows into a motion with derivatives: the noise, a smoothing spline, and how sure both are."""
