"""Random variants of the fifteen benchmark problems, solved by the engine and by plain means."""
