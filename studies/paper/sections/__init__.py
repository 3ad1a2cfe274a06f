"""The rows of the paper, a module a section: what it prints beside what our models give."""
