"""Shows of what is made for a drive: tables, points, formats, caps, checks of measured motions."""
