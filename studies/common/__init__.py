"""What all studies share: results, configuration, flags, console, folder, figures, exit codes."""
