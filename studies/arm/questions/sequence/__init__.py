"""Big arm, locked dwell and small arm as one problem."""
