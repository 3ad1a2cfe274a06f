"""Processes that this program starts, and parts of a study that they do side by side."""
