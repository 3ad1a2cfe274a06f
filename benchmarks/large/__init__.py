"""Large public problems: what an answer costs, and whether it is as accurate as it says."""
