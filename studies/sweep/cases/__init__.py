"""The cases of a sweep: where they lie, what each asks, and the files that hold the answers."""
