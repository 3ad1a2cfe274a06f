"""How fast a report opens and moves in a real browser."""
