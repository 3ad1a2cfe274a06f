"""`antenna-ocp report`: a stored result as a page, as figures and as a film."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.report.page_file import PAGE, taken, unwritable, write_page

if TYPE_CHECKING:
    from studies.common.result import Result

FIGURE_KINDS = ("pdf", "svg", "png")
FILM_KINDS = ("gif", "mp4")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument(
        "results", nargs="*", type=Path, metavar="RESULTS", help="a results folder, or two of them"
    )
    parser.add_argument(
        "--to", type=Path, metavar="DIR", help="folder for the files [the results folder]"
    )

    parser.add_argument("--no-page", action="store_true", help="print only")
    parser.add_argument(
        "--figures",
        type=_kinds(FIGURE_KINDS),
        default=(),
        metavar="KIND",
        help="also draw its figures: pdf, svg, png, or several with commas",
    )
    parser.add_argument(
        "--animation",
        type=_kinds(FILM_KINDS),
        default=(),
        metavar="KIND",
        help="also film its motion: gif, mp4 (which needs ffmpeg), or both with a comma",
    )

    parser.add_argument("--overwrite", action="store_true", help="replace files that are there")
    parser.add_argument(
        "--partial", action="store_true", help="report the existing parts of an incomplete result"
    )
    parser.add_argument(
        "--gallery",
        action="store_true",
        help="solve the example studies on coarse meshes, and write a page that links to theirs",
    )


def _kinds(known: Sequence[str]) -> Callable[[str], tuple[str, ...]]:
    """What reads a choice of file kinds with commas."""

    def read(text: str) -> tuple[str, ...]:
        kinds = tuple(part.strip() for part in text.split(","))
        for kind in kinds:
            if kind not in known:
                raise argparse.ArgumentTypeError(
                    f"'{kind}' is no kind of file; choose from {', '.join(known)} "
                    "(the folder is named by --to)"
                )
        return kinds

    return read


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Print the report, and write the requested files.

    The exit code is 0 if the result could be read, whatever it says.

    Raises
    ------
    StudyError
        If a folder is no result or incomplete, or a file cannot be written.
    """
    if options.gallery:
        from studies.report.gallery import write_gallery

        return write_gallery(options, console)
    if len(options.results) not in (1, 2):
        raise StudyError(
            f"{len(options.results)} results folders are named; give one, or two to compare them"
        )
    _check_films(options)

    from studies.common.result import reading

    with reading(*options.results):
        return _report(options, console)


def _report(options: argparse.Namespace, console: Console) -> ExitCode:
    """Load, print, and write."""
    from studies.common.writers import report_text

    results = [_load(folder, options.partial) for folder in options.results]
    target = options.to or options.results[0]
    for folder, result in zip(options.results, results, strict=True):
        if len(results) > 1:
            console.say(f"{folder}\n")
        console.say(report_text(result))
    if not options.no_page:
        path = _write_page(options.results, results, target, options.overwrite)
        console.say(f"\nthe page is {path}")
    if options.figures:
        draw_figures(results[0], target / "figures", options.figures, options.overwrite, console)
    for kind in options.animation:
        _film(results[0], target / f"motion.{kind}", options.overwrite, console)
    return ExitCode.OK


def _check_films(options: argparse.Namespace) -> None:
    from studies.common.scene.pictures import check_film

    for kind in options.animation:
        check_film(kind)


def _load(folder: Path, partial: bool) -> Result:
    from studies.common.result import Result

    try:
        return Result.load(folder, partial=partial)
    except StudyError as error:
        sentence = str(error).replace("load it with partial=True", "report it with --partial")
        raise StudyError(sentence, error.exit_code) from error


def _write_page(
    folders: Sequence[Path], results: Sequence[Result], target: Path, overwrite: bool
) -> Path:
    from studies.report.comparison import beside
    from studies.report.page import page

    if len(results) == 1:
        text, path = page(results[0], input_text(folders[0])), target / PAGE
    else:
        names = [_name(folder) for folder in folders]
        text, path = beside(results, names), target / f"report-beside-{names[1]}.html"
    return write_page(text, path, overwrite)


def _name(folder: Path) -> str:
    return folder.resolve().name


def input_text(folder: Path) -> str:
    """The study of a results folder as it was run; empty if that is not there."""
    path = folder / "input.toml"
    try:
        return path.read_text("utf-8") if path.is_file() else ""
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"{path} cannot be read ({error}); repair or delete it") from error


def draw_figures(
    result: Result, folder: Path, kinds: Sequence[str], overwrite: bool, console: Console
) -> None:
    """Draw all figures of a result into a folder."""
    from studies import registry
    from studies.common.drawing import save
    from studies.common.folder import ResultsFolder
    from studies.common.study import placed

    study = registry.study_of(result.kind)
    if study is None or study.figures is None:
        known = ", ".join(one.kind for one in registry.studies() if one.figures is not None)
        raise StudyError(f"results of the kind '{result.kind}' have no figures; {known} have")
    draw = placed(study.figures)
    there = [path for kind in kinds for path in folder.glob(f"*.{kind}")]
    if there and not overwrite:
        raise taken(there[0])
    try:
        folder.mkdir(parents=True, exist_ok=True)
        save(draw(result), ResultsFolder(folder), console, kinds)
    except OSError as error:
        raise unwritable(folder, error) from error
    console.say(f"the figures are in {folder}")


def _film(result: Result, path: Path, overwrite: bool, console: Console) -> None:
    from studies.common.scene.pictures import save_film
    from studies.report.page import shown

    picture = shown(result).picture
    if picture is None:
        raise StudyError("the result contains no motion; run its study again for a film")
    if path.exists() and not overwrite:
        raise taken(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save_film(picture, path, console)
    except OSError as error:
        raise unwritable(path, error) from error
    console.say(f"the film is {path}")
