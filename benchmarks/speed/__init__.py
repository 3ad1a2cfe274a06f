"""Parts that measure our own code alone: growth, memory, imports, problems with known optima."""
