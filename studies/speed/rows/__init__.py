"""One script for each contestant, each run as a fresh process, and what they share."""
