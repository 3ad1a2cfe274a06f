"""`antenna-ocp table`: figures of the paper, or that follow from it, beside ours."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from studies.common.console import Console, Table, number
from studies.common.exit_codes import ExitCode

if TYPE_CHECKING:
    from studies.paper import Row


def add_to(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the sub-command."""
    parser = subparsers.add_parser(
        "table",
        help="the paper's figures beside ours",
        description="Prints figures of the paper, or that follow from it in closed form, beside "
        "what the models give, and the difference.",
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Print the table."""
    from studies.paper import rows

    table = Table(
        title="Lu, Qi, Hu, Li, Zhang, IEEE Access 2019, DOI 10.1109/ACCESS.2019.2918614",
        head=("quantity", "unit", "paper", "formula", "ours", "to paper", "to formula"),
        rows=[_cells(row) for row in rows()],
        notes=(
            "paper: printed there.  formula: a closed form written out beside the models.",
            "T = 140 s.  (m): with our assumption on the tubes, whose section the paper omits:",
            "20 mm outer and 18 mm inner diameter, 1800 kg/m^3, joints without mass.",
        ),
    )
    console.say(table)
    return ExitCode.OK


def _cells(row: Row) -> tuple[str, ...]:
    return (
        row.quantity,
        row.unit,
        number(row.paper),
        number(row.formula, 6),
        number(row.ours, 6),
        _difference(row.paper, row.ours),
        _difference(row.formula, row.ours),
    )


def _difference(reference: float | None, ours: float) -> str:
    if reference is None:
        return "-"
    percent = 100 * (ours / reference - 1)
    return "< 1e-8 %" if abs(percent) < 1e-8 else f"{percent:+.2f} %"
