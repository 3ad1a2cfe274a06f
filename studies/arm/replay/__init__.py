"""Motions replayed on models that the optimiser did not use, and what the replays say."""
