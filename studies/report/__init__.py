"""`antenna-ocp report`: a results folder as one page that opens offline, its motion and figures."""

from studies.common.study import Command

COMMAND = Command(
    "a results folder as a page, figures and a film",
    "studies.report.command",
    "Prints the answer of a result, and writes one page that opens offline: answer, "
    "verdict, costs, curves, the antenna in motion, tables, exact input. With two "
    "folders the page compares them. Nothing is solved, except with --gallery.",
)
