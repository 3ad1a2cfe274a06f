"""The commands of the arm: their flags, which are the keys of their studies, and what they run.

The studies and their work are loaded when a command is called.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode
from studies.common.running import (
    Job,
    add_results_flags,
    add_resume_flag,
    add_study_argument,
    carry_out,
    take_up,
)

QUOTES = '"'


@dataclass(frozen=True)
class Question:
    """A sub-command: what is asked of the arm.

    Attributes
    ----------
    command : its words after `antenna-ocp`.
    kind : of result.
    study : name of its configuration in `studies.arm`.
    folder : default name of the results folder; `{stage}`, `{drive}`, `{least}` are filled in.
    goes_on : whether a run that was stopped can go on, as its solves are kept.
    """

    command: str
    kind: str
    study: str
    folder: str
    goes_on: bool = False

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """A file of the study, a flag for each of its keys, and where results go."""
        from studies.common.configuration import key_lines

        add_study_argument(parser)
        for line in key_lines(self._configuration):
            unit = f" [{line.unit}]" if line.unit else ""
            default = "" if line.default in ("none", "") else f"; {line.default.strip(QUOTES)}"
            text = f"{line.meaning}{unit}{default}".replace("%", "%%")
            # a flag leaves out the table that its key is in
            flag = line.key.split(".")[-1].replace("_", "-")
            if line.default == "false":  # what is off unless it is said takes no value
                parser.add_argument(
                    f"--{flag}", dest=line.key, action="store_const", const=True, help=text
                )
                continue
            parser.add_argument(f"--{flag}", dest=line.key, metavar="X", help=text)
        add_results_flags(parser)
        if self.goes_on:
            add_resume_flag(parser)

    def run(self, options: argparse.Namespace, console: Console) -> ExitCode:
        """Answer the question that the file and the flags state."""
        from studies.arm.config import as_dictionary
        from studies.arm.study import check, run
        from studies.common.configuration import toml_text
        from studies.common.finished import FinishedStarts

        if self.goes_on:
            take_up(options, self.add_arguments, self.kind)
        study = self.read(options)
        opened: list[FinishedStarts] = []  # the folder is known when it is opened
        configuration = as_dictionary(study)
        job = Job(
            kind=self.kind,
            name=self.folder.format_map(configuration),
            command=f"antenna-ocp {self.command}",
            question=study.question,
            configuration=configuration,
            input_text=toml_text(configuration),
            check=lambda: check(study),
            solve=lambda: run(study, console, *opened),
            draw=_draw,
            files=_files,
            opened=lambda folder: opened.append(FinishedStarts(folder.path)),
            resume=options.resume if self.goes_on else None,
            go_on=f"antenna-ocp {self.command} --resume" if self.goes_on else "",
        )
        return carry_out(job, options, console)

    def read(self, options: argparse.Namespace) -> Any:
        """The study that a file and the flags on top of it state.

        Raises
        ------
        StudyError
            Naming the key, its value and the remedy.
        """
        from studies.arm.config import question_from
        from studies.common.configuration import as_number, key_lines, put, read_toml

        raw = read_toml(options.study)
        for line in key_lines(self._configuration):
            text = getattr(options, line.key)
            if text is not None:
                put(raw, line.key.split("."), text if text is True else as_number(text))
        return question_from(self._configuration, raw)

    @property
    def _configuration(self) -> type[Any]:
        configuration: type[Any] = getattr(import_module("studies.arm"), self.study)
        return configuration


solve = Question("arm solve", "arm", "ArmStudy", "arm-{stage}", goes_on=True)
baselines = Question("arm baselines", "arm-baselines", "BaselinesStudy", "arm-{stage}-{drive}")
least_duration = Question(
    "arm least-duration", "arm-least-duration", "LeastDurationStudy", "arm-{stage}-least"
)
sequence = Question(
    "arm sequence", "arm-sequence", "SequenceStudy", "arm-sequence-{least}", goes_on=True
)
trade_off = Question("pareto arm", "pareto-arm", "TradeOffStudy", "arm-{stage}-trade-off")
robust = Question("robust arm", "robust", "RobustStudy", "arm-robust-{stage}-{drive}")


def _draw(result: Any) -> Any:
    from studies.arm.report.comparison_figures import draw  # Matplotlib loads with it

    return draw(result)


def _files(result: Any) -> dict[str, str]:
    """What is written beside the files of every study."""
    if result.kind not in ("arm", "arm-sequence"):
        return {}
    from studies.arm.report.profile import loads_csv

    return {"loads.csv": loads_csv(result)}
