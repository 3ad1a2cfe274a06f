"""The rows of the paper, one module for each section: printed values and those of our models."""
