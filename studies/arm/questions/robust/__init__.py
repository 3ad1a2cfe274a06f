"""One motion for a spread of arms."""
