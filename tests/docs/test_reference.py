"""The reference names all that is public, and its tables hold what the code holds."""

import importlib.util
import inspect
import re
import sys
from pathlib import Path
from types import ModuleType

import ocp

DOCS = Path(__file__).parents[2] / "docs"


def extension(name: str) -> ModuleType:
    """One of the site's Sphinx extensions."""
    spec = importlib.util.spec_from_file_location(
        f"docs_{name}", DOCS / "extensions" / f"{name}.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def test_the_reference_names_all_that_the_engine_exports() -> None:
    page = (DOCS / "reference" / "engine.md").read_text("utf-8")
    named = re.findall(r"^\.\. auto\w+:: ocp\.(\w+)$", page, re.MULTILINE)
    assert sorted(named) == sorted(set(named))
    assert set(ocp.__all__) <= set(named)


def test_each_argument_of_what_is_public_is_explained() -> None:
    unexplained = {}
    for name in ocp.__all__:
        thing = getattr(ocp, name)
        if not callable(thing) or (isinstance(thing, type) and issubclass(thing, BaseException)):
            continue
        text = inspect.getdoc(thing) or ""
        named = " ".join(re.findall(r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*) :", text, re.MULTILINE))
        arguments = set(inspect.signature(thing).parameters) - {"args", "kwargs"}
        if missing := arguments - set(re.findall(r"\w+", named)) - set(named.split(", ")):
            unexplained[name] = sorted(missing)
    assert unexplained == {}


def test_a_request_to_elsewhere_is_found(tmp_path: Path) -> None:
    offline = extension("offline")
    (tmp_path / "page.html").write_text(
        '<a href="https://example.org">a link waits for a click</a>'
        '<link rel="canonical" href="https://example.org/page"><img src="plot.png">'
        '<script src="https://example.org/math.js"></script>'
    )
    (tmp_path / "site.css").write_text('@import "//example.org/x.css"; a { src: url(font.woff) }')
    assert offline.remote_addresses(tmp_path) == [
        "page.html: https://example.org/math.js",
        "site.css: //example.org/x.css",
    ]


def test_parameters_are_listed_with_unit_and_default() -> None:
    tables = extension("tables")
    assert (
        "| `link` | d, from the crank joint to the slider | m | 0.15 |"
        in tables.GENERATED["truss_parameters"]()
    )
    assert "| 0 | done; every check passed |" in tables.GENERATED["exit_codes"]()


def test_a_dollar_in_a_text_begins_no_formula() -> None:
    assert not re.search(r"(?<!\\)\$", extension("tables").commands())
