"""Our simulator beside Exudyn, a compiled multibody code with the same beam element."""
