"""`antenna-ocp report`: a results folder as one page that opens offline, its motion and figures."""

from studies.common.study import Command

COMMAND = Command(
    "a results folder as a page, figures and a film",
    "studies.report.command",
    "Prints what a result says, and writes it as one page that opens offline: answer, "
    "verdict, costs, curves, the antenna in motion, tables, exact input. With two "
    "folders the page compares them. Nothing is solved, but by --gallery.",
)
