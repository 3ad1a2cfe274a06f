"""Shows of studies of many motions: fronts, sweeps, designs, laws for many trusses."""
