"""An answer held against others: the same problem solved from several starts.

`multistart` asks and compares; a start is drawn by `random_guess`, `start_answer` is what comes of
one, and `worker_processes` runs them side by side.
"""
