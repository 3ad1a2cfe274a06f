"""The supporting arm: motions that leave it still, and the laws they are compared with."""
