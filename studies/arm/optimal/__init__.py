"""One stage as an optimal control problem: phase, objectives, meshes, solve and refinement."""
