"""Mechanical models as pure functions of symbols; they know no optimiser and no plot."""
