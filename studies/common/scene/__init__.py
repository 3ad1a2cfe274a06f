"""What moves in a picture: points and lines over time, chains of links, and their projection."""
