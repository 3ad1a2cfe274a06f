"""Shows of bad input: command lines, study files and results folders that are wrong at random."""
