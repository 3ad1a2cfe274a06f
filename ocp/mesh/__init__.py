"""Meshes and what lives on them: trajectories, initial guesses, expressions along a motion."""
