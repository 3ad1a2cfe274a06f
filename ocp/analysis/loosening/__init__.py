"""A problem rewritten so that its limits may give way.

`limit_slack` is the unknown that moves a limit, and `loosened` the statement that has one for each.
"""
