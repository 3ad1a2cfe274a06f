"""Pictures that scripts draw when the site is built, and the gallery.

Each script of `docs/figures` draws a picture of the explanations. Each script of `docs/examples` is
run, and becomes a page of the gallery with its code and picture.

A script is what a user would write. Its docstring (title, then text in MyST) opens the page, what
it prints and the picture `NAME.png` that it saves close it. Runs are kept until the script or the
code it uses changes. A script that fails is named in a warning and on its page, and the rest of the
site is built: with `-W --keep-going` Sphinx fails at the end.
"""

import ast
import hashlib
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.logging import getLogger

log = getLogger(__name__)
PACKAGES = ("ocp", "models", "studies")
SOURCES = (".py", ".js", ".css", ".toml")
SECONDS = 300  # for one script; the longest takes some seconds
ORDER = "ORDER.txt"  # of the scripts: the simplest first


@dataclass(frozen=True)
class Example:
    """A script of the gallery and what it says of itself."""

    path: Path
    title: str
    text: str
    code: str

    @property
    def name(self) -> str:
        """Name of the script, its page and its picture."""
        return self.path.stem


def read_example(path: Path) -> Example:
    """Split a script into title, text and code."""
    source = path.read_text("utf-8")
    try:
        tree = ast.parse(source)
    except SyntaxError:  # it fails when it is run, and its page says so
        return Example(path, path.stem, "", source)
    docstring = ast.get_docstring(tree)
    if not docstring:
        raise ExtensionError(f"the example {path.name} has no docstring; give it title and text")
    title, _, text = docstring.partition("\n")
    code = "\n".join(source.splitlines()[tree.body[0].end_lineno :]).strip()
    return Example(path, title.rstrip("."), text.strip(), code)


def example_paths(folder: Path) -> list[Path]:
    """All scripts in the order of the gallery."""
    names = (folder / ORDER).read_text("utf-8").split()
    found = {path.stem for path in folder.glob("*.py")}
    if set(names) != found:
        raise ExtensionError(
            f"{ORDER} and the scripts beside it differ in {sorted(set(names) ^ found)}; list each"
        )
    return [folder / f"{name}.py" for name in names]


def run(script: Path, folder: Path, code: str) -> str:
    """Run a script in `folder` unless its files are up to date; return why it failed, or ""."""
    name = script.stem
    stamp, picture = folder / f"{name}.stamp", folder / f"{name}.png"
    wanted = f"{code} {hashlib.sha256(script.read_bytes()).hexdigest()}"
    if stamp.exists() and stamp.read_text("utf-8") == wanted:
        return ""

    # nothing of an earlier run stands for this one
    for old in (stamp, picture):
        old.unlink(missing_ok=True)
    root = script.parents[2]
    environment = {**os.environ, "MPLBACKEND": "Agg", "PYTHONPATH": str(root)}
    try:
        done = subprocess.run(
            [sys.executable, "-W", "error", str(script)],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=True,
        )
    except subprocess.TimeoutExpired:
        return f"it takes more than {SECONDS} s"
    except subprocess.CalledProcessError as error:
        return str(error.stderr)[-2000:]
    if not picture.exists():
        return f"it saves no picture {picture.name}"
    (folder / f"{name}.txt").write_text(done.stdout, "utf-8")
    stamp.write_text(wanted, "utf-8")
    return ""


def page(example: Example, failed: bool) -> str:
    """The page of an example in MyST."""
    picture = [f"![Plot of the example {example.name}]({example.name}.png)\n"]
    printed = [
        "It prints:\n",
        f"```{{literalinclude}} {example.name}.txt\n:language: text\n```\n",
    ]
    if failed:
        picture, printed = ["**The script failed when this site was built.**\n"], []
    return "\n".join(
        [
            f"# {example.title}\n",
            f"{example.text}\n",
            *picture,
            f"```{{literalinclude}} {example.name}.code\n:language: python\n```\n",
            *printed,
            f"The script is [docs/examples/{example.path.name}]"
            f"(../../examples/{example.path.name}). "
            "A test runs it and compares its numbers with their source.\n",
        ]
    )


def index(examples: list[Example], failed: set[str]) -> str:
    """The opening page: every picture with its title; no picture of a script that failed."""
    cards = [
        f"- [{example.title}]({example.name}.md) (failed)"
        if example.name in failed
        else f"- [![{example.title}]({example.name}.png)]({example.name}.md)\n"
        f"  [{example.title}]({example.name}.md)"
        for example in examples
    ]
    names = "\n".join(example.name for example in examples)
    return "\n".join(
        [
            "# Examples\n",
            "Each page is a script with the picture that it draws. The simplest come first.\n",
            "::::{container} gallery",
            *cards,
            "::::\n",
            f"```{{toctree}}\n:hidden:\n\n{names}\n```\n",
        ]
    )


def fingerprint(root: Path) -> str:
    """Changes with any file of the packages that examples import, and of what pages hold."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*")):
            if path.suffix in SOURCES:
                digest.update(path.read_bytes())
    return digest.hexdigest()


def _build(app: Sphinx) -> None:
    source = Path(app.srcdir)
    scripts = {
        "figures": sorted((source / "figures").glob("*.py")),
        "examples": example_paths(source / "examples"),
    }
    code = fingerprint(source.parent)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = {}
        for folder, paths in scripts.items():
            target = source / "generated" / folder
            target.mkdir(parents=True, exist_ok=True)
            jobs |= {path: pool.submit(run, path, target, code) for path in paths}
    failures = {path: job.result() for path, job in jobs.items() if job.result()}
    for path, failure in failures.items():
        log.warning("the script %s failed:\n%s", path.name, failure)

    target = source / "generated" / "examples"
    examples = [read_example(path) for path in scripts["examples"]]
    failed = {path.stem for path in failures}
    for example in examples:
        write_if_new(target / f"{example.name}.code", example.code + "\n")
        write_if_new(target / f"{example.name}.md", page(example, example.name in failed))
    write_if_new(target / "index.md", index(examples, failed))


def write_if_new(path: Path, text: str) -> None:
    """Write unless it says so already: Sphinx reads again what is newer."""
    if not path.exists() or path.read_text("utf-8") != text:
        path.write_text(text, "utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Run the scripts before Sphinx looks for pages."""
    app.connect("builder-inited", _build)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
