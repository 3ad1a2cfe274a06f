"""What all rows of the race share, and the rows that need no environment of their own."""
