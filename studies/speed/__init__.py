"""Speed: our engine beside other tools and hand-written programs, growth, memory, imports."""
