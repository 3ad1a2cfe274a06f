"""What a process of its own measures: one run, and the problems that runs solve."""
