"""What may be asked of the arm beyond one motion, a module or a folder each."""
