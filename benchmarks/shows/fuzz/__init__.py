"""Shows of bad input and of stops: lines and files that are wrong at random, Ctrl-C, kills."""
