"""The command `antenna-ocp`: finds the sub-command, turns errors into one sentence and a code."""

import argparse
import importlib
import os
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError, exit_code_table

# One line a sub-command: its module has `add_to(subparsers)`, which sets the parser's `run`.
COMMANDS = (
    "studies.truss.command",
    "studies.arm.command",
    "studies.arm.questions.robust.command",
    "studies.benchmarks.command",
    "studies.table",
)

# Former sub-commands, and the sentence that says what to write instead.
FORMER = {
    "benchmark-speed": "'antenna-ocp benchmark-speed' is now 'make race' in the source tree; "
    "'python -m benchmarks.race --help' names its parts and flags",
    "arm-speed": "'antenna-ocp arm-speed' is now 'make exudyn' in the source tree",
    "build-time": "'antenna-ocp build-time' is now 'python -m benchmarks.race --only build' in "
    "the source tree",
}

Run = Callable[[argparse.Namespace, Console], ExitCode]


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command."""
    parser = argparse.ArgumentParser(
        prog="antenna-ocp",
        description="Optimal deployment of a large ring-truss space antenna.",
        epilog=f"exit codes:\n{exit_code_table()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    subparsers = parser.add_subparsers(title="sub-commands", metavar="COMMAND", required=True)
    for module in COMMANDS:
        importlib.import_module(module).add_to(subparsers)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with `arguments` (those of the process by default); return its exit code."""
    console, words = Console(), sys.argv[1:] if arguments is None else arguments
    if words and words[0] in FORMER:
        console.complain(FORMER[words[0]])
        return int(ExitCode.BAD_INPUT)
    options = build_parser().parse_args(words)
    try:
        return int(options.run(options, console))
    except StudyError as error:
        console.complain(str(error))
        return int(error.exit_code)
    except KeyboardInterrupt:
        console.complain("interrupted; what was written until then is kept")
        return int(ExitCode.INTERRUPTED)
    except BrokenPipeError:  # as in `antenna-ocp table | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return int(ExitCode.OK)
    except Exception as error:
        return _report_defect(error, console)


def _report_defect(error: Exception, console: Console) -> int:
    """Write the traceback of an unforeseen `error` to a file and say where it is."""
    with tempfile.NamedTemporaryFile(
        "w", prefix="antenna-ocp-", suffix=".txt", delete=False
    ) as report:
        report.write(" ".join(sys.argv) + "\n\n" + "".join(traceback.format_exception(error)))
    console.complain(
        f"unforeseen {type(error).__name__}: {error}; this is a defect, "
        f"please send its authors the report {report.name}"
    )
    return int(ExitCode.INTERNAL)


if __name__ == "__main__":
    sys.exit(main())
